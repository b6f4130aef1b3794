"""One sweep drawn on the map: what it saw, from its pose as known now, with the natures and walls as known now.

Must not know: other sweeps' sights, how layers add up.
"""

from dataclasses import dataclass, field

import numpy as np

from slam import dmath
from slam.disc import BINS, STEP_RAD, Disc, bins_about, depths, disc_around
from slam.dmath import DEGREE, Floats
from slam.evidence import Layer, cropped
from slam.geometry import Bools, Pose
from slam.grid import Grid
from slam.links import EndConfig, Gaps
from slam.paint import Canvas
from slam.seams import SeamConfig
from slam.shapes import ShapeConfig, Shapes
from slam.sweep import Ints


@dataclass(frozen=True)
class MapConfig:
    """Cell size, the weights of the evidence in log-odds × 10, and when a sweep is drawn again.

    `plain_cone = true` draws every reading's cone instead, to compare with.
    """

    cell_m: float = 0.05
    occupied_from: int = 15
    free_from: int = -6
    wall: int = 40
    narrow: int = 25  # whatever is no wall …
    far: int = 12  # … and the same farther away than `narrow_reach_m`: another sweep must say so too
    near: int = 2  # a class (ii) reading, to its RCD's own weight
    link: int = 40  # between neighbours of a chain
    end: int = 40  # between a wall and the corner it ends in
    seam: int = 25  # between things in line that were heard square on
    faint: int = 25  # what class (iii) readings agree on
    fan: int = 8  # before what was seen, or filled
    body: int = 20  # where the robot stood
    faint_reach_m: float = 3.0  # farther out half of it came back by way of something
    narrow_reach_m: float = 3.0  # farther out its bearing tells little of its place
    core_deg: float = 1.5  # half of what is free before a dot
    link_gap_m: float = 2.0
    solid_from: int = 20  # as sure as this, a wall stops fans
    body_radius_m: float = 0.16
    around_m: float = 6.0  # sweeps farther apart do not see the same things
    repaint_m: float = 0.04
    repaint_along_m: float = 0.10
    repaint_deg: float = 2.0
    plain_cone: bool = False
    shapes: ShapeConfig = field(default_factory=ShapeConfig)
    ends: EndConfig = field(default_factory=EndConfig)
    seams: SeamConfig = field(default_factory=SeamConfig)


WIDEST = 8
"""A cell covers at most so many bins to either side: nearer ones lie under the robot."""


def render(
    pose: Pose,
    shapes: Shapes,
    gaps: Gaps,
    curtains: Floats,
    grid: Grid,
    config: MapConfig,
) -> Layer:
    """The sweep's evidence: its shapes, the gaps that it closes, and what is free up to curtains.

    What the grid shows of walls stops fans, and so do the sweep's own.
    """
    disc = disc_around(pose.x, pose.y, _points(pose, shapes, gaps, curtains), config.cell_m)
    height, width = disc.bins.shape
    canvas = Canvas(disc.left, disc.bottom, width, height, config.cell_m)
    known = grid.window(disc.left, disc.bottom, width, height)
    weights = _weights(pose, shapes, config)
    canvas.mark(np.concatenate([shapes.ends, gaps.ends]), np.concatenate([weights, gaps.weight]))
    solid = np.maximum(known, canvas.occupied) >= config.solid_from
    fans, between = _profiles(pose, shapes, gaps, curtains, config)
    stops = _stops(disc, solid, config)
    # What lies before a gap or a curtain nobody saw: anything at all that was heard there stops it.
    shy = _stops(disc, np.maximum(known, canvas.occupied) > 0, config)
    fans = np.maximum(np.minimum(fans, stops), np.minimum(between, shy))
    canvas.free[disc.nearer(fans)] = -config.fan
    canvas.free[disc.ranges < config.body_radius_m] = -config.body
    return cropped(canvas.left, canvas.bottom, canvas.evidence())


def _weights(pose: Pose, shapes: Shapes, config: MapConfig) -> Ints:
    """What each of the shapes (n,) is worth, readings of class (ii) included."""
    off = shapes.foot - (pose.x, pose.y)
    near = off[:, 0] * off[:, 0] + off[:, 1] * off[:, 1] <= config.narrow_reach_m * config.narrow_reach_m
    narrow = np.where(shapes.faint, config.faint, np.where(near, config.narrow, config.far))
    base = np.where(shapes.wall >= 0, config.wall, narrow)
    return np.asarray(base + np.minimum(config.near * shapes.support, base // 2))


def _points(pose: Pose, shapes: Shapes, gaps: Gaps, curtains: Floats) -> Floats:
    """Points (n, 2) between which everything is painted."""
    rows = np.concatenate([shapes.ends, gaps.ends, curtains]).reshape(-1, 2)
    return np.concatenate([np.array([[pose.x, pose.y]]), rows])


def _stops(disc: Disc, solid: Bools, config: MapConfig) -> Floats:
    """How far it is to the nearest known wall in each direction (BINS,), less a cell and a half."""
    stops = np.full(BINS, np.inf)
    np.minimum.at(stops, disc.bins[solid], disc.ranges[solid])
    # A cell is wider than a bin where it is near: it stops the directions beside its middle, too.
    round_ = np.concatenate([stops[-WIDEST:], stops, stops[:WIDEST]])
    wide = np.minimum(np.minimum(stops, round_[WIDEST - 1 : -WIDEST - 1]), round_[WIDEST + 1 : BINS + WIDEST + 1])
    for k in range(2, WIDEST + 1):
        near = np.where(round_ < 0.7 * config.cell_m / (k * STEP_RAD), round_, np.inf)
        left, right = near[WIDEST - k : BINS + WIDEST - k], near[WIDEST + k : BINS + WIDEST + k]
        np.minimum(wide, np.minimum(left, right), out=wide)
    return np.asarray(np.maximum(wide - 1.5 * config.cell_m, config.body_radius_m))


def _profiles(pose: Pose, shapes: Shapes, gaps: Gaps, curtains: Floats, config: MapConfig) -> tuple[Floats, Floats]:
    """How far it is free in each direction (BINS,): to a cell and a half before what was seen; before gaps, and as far
    as the curtains."""
    wall = shapes.wall >= 0
    parts = (shapes.ends[wall], gaps.ends, curtains)
    far_to = depths(np.concatenate(parts), pose.x, pose.y)
    begin, end = len(parts[0]), len(parts[0]) + len(parts[1])
    drawn, filled, open_to = (
        some.max(axis=0, initial=0.0) for some in (far_to[:begin], far_to[begin:end], far_to[end:])
    )
    dots = shapes.foot[~wall] - (pose.x, pose.y)
    far = np.sqrt(dots[:, 0] * dots[:, 0] + dots[:, 1] * dots[:, 1])
    around = bins_about(dmath.atan2(dots[:, 1], dots[:, 0]), config.core_deg * DEGREE)
    np.maximum.at(drawn, around, far[:, None])
    # From the other side a curtain's own station sees as far: the two meet.
    between = np.maximum(filled - 1.5 * config.cell_m, np.where(open_to > 0.0, open_to + config.cell_m, 0.0))
    return drawn - 1.5 * config.cell_m, between
