"""One sweep drawn on the map: what it saw, from its pose as known now, with the natures and walls as known now.

Must not know: other sweeps' sights, how layers add up.
"""

from dataclasses import dataclass, field

import numpy as np

from slam import dmath
from slam.disc import BINS, Disc, bins_about, bins_of, depths, disc_around
from slam.dmath import DEGREE, Floats
from slam.evidence import Layer, cropped
from slam.geometry import Bools, Pose
from slam.grid import Cells, Grid
from slam.links import EndConfig, Gaps
from slam.paint import Canvas
from slam.pieces import Pieces
from slam.shapes import ShapeConfig, Shapes
from slam.sight import Sight


@dataclass(frozen=True)
class MapConfig:
    """Cell size, the weights of the evidence in log-odds × 10, and when a sweep is drawn again.

    `plain_cone = true` draws every reading's cone instead, to compare with.
    """

    cell_m: float = 0.05
    occupied_from: int = 15
    free_from: int = -6
    wall: int = 40
    narrow: int = 25  # whatever is no wall
    near: int = 2  # a class (ii) reading, to its RCD's own weight
    link: int = 40  # between neighbours of a chain
    end: int = 40  # between a wall and the corner it ends in
    alone: int = 1  # a class (iii) reading
    fan: int = 8  # before what was seen, or filled
    body: int = 20  # where the robot stood
    alone_free: int = 2  # well before a class (iii) reading
    alone_margin_m: float = 0.40
    alone_reach_m: float = 2.5  # farther out most of them came back by way of something
    link_gap_m: float = 2.0
    veto: int = 30  # a gap was seen to be free where so much evidence says so …
    veto_share: float = 0.25  # … in more than this part of its cells
    solid_from: int = 20  # as sure as this, a wall stops fans
    beyond_m: float = 5.0  # how far past the ends of what was seen a wall still stops a single beam
    body_radius_m: float = 0.16
    core_deg: float = 4.0  # half of a single beam's width that counts
    around_m: float = 6.0  # sweeps farther apart do not see the same things
    repaint_m: float = 0.04
    repaint_along_m: float = 0.10
    repaint_deg: float = 2.0
    plain_cone: bool = False
    shapes: ShapeConfig = field(default_factory=ShapeConfig)
    ends: EndConfig = field(default_factory=EndConfig)


def render(
    sight: Sight,
    pose: Pose,
    own: Pieces,
    shapes: Shapes,
    gaps: Gaps,
    curtains: Floats,
    grid: Grid,
    config: MapConfig,
) -> Layer:
    """The sweep's evidence: its shapes, its single beams, the gaps that it closes, and what is free up to curtains.

    `own` are its walls in the map frame; what the grid shows of walls stops fans, and so do the sweep's own.
    """
    beams = _unblocked(sight, pose, own, config)
    disc = disc_around(pose.x, pose.y, _points(shapes, beams, gaps, curtains), config.cell_m)
    height, width = disc.bins.shape
    canvas = Canvas(disc.left, disc.bottom, width, height, config.cell_m)
    known = grid.window(disc.left, disc.bottom, width, height)
    gaps = gaps.at(_unseen(canvas, known, gaps, config))
    base = np.where(shapes.wall >= 0, config.wall, config.narrow)
    weights = base + np.minimum(config.near * shapes.support, base // 2)
    canvas.mark(np.concatenate([shapes.ends, gaps.ends]), np.concatenate([weights, gaps.weight]))
    solid = np.maximum(known, canvas.occupied) >= config.solid_from
    fans, between, alone = _profiles(pose, shapes, gaps, curtains, beams, config)
    stops = _stops(disc, solid, config)
    # What lies before a gap or a curtain nobody saw: anything at all that was heard there stops it.
    shy = _stops(disc, np.maximum(known, canvas.occupied) > 0, config)
    fans = np.maximum(np.minimum(fans, stops), np.minimum(between, shy))
    _clear(canvas, disc, fans, np.minimum(alone, stops), config)
    if config.alone and len(beams):
        canvas.hint(np.concatenate([beams[:, 4:6], beams[:, 6:8]], axis=1), config.alone)
    return cropped(canvas.left, canvas.bottom, canvas.evidence())


def _unblocked(sight: Sight, pose: Pose, own: Pieces, config: MapConfig) -> Floats:
    """The single beams (k, 8) in the map frame, without those that came back by way of one of the sweep's walls:
    x and y of where each begins, of how far it is free at least, and of both ends of its core's arc.

    They pass a wall, or up to `beyond_m` past its ends, over 10 cm before their own: a sweep sees a short piece of a
    wall, and the wall goes on.
    """
    origin, reach = sight.beams[:, :2], sight.beams[:, 3]
    cosine, sine = sight.beams[:, 4], sight.beams[:, 5]
    s, c = dmath.sincos(config.core_deg * DEGREE)
    core = np.minimum(np.maximum(reach - config.alone_margin_m, 0.0), config.alone_reach_m)
    ways = ((reach, cosine, sine), (core, cosine, sine),
            (reach, cosine * c + sine * s, sine * c - cosine * s),
            (reach, cosine * c - sine * s, sine * c + cosine * s))  # fmt: skip
    local = [origin, *(origin + np.stack([far * x, far * y], axis=1) for far, x, y in ways)]
    placed = pose.points(np.concatenate(local)).reshape(5, -1, 2)
    origin, end = placed[0], placed[1]
    nx, ny = own.normal[:, :1], own.normal[:, 1:]
    before = nx * origin[:, 0] + ny * origin[:, 1] - own.line[:, 1:]
    after = nx * end[:, 0] + ny * end[:, 1] - own.line[:, 1:]
    through = (before < 0.0) & (after > 0.10)
    part = before / np.where(through, before - after, 1.0)
    way = end - origin
    place = nx * (origin[:, 1] + part * way[:, 1]) - ny * (origin[:, 0] + part * way[:, 0])
    one, other = (nx * own.ends[:, k + 1 : k + 2] - ny * own.ends[:, k : k + 1] for k in (0, 2))
    low, high = np.minimum(one, other) - config.beyond_m, np.maximum(one, other) + config.beyond_m
    kept = sight.echoed & ~(through & (low <= place) & (place <= high)).any(axis=0)
    return np.asarray(np.concatenate([placed[0], placed[2], placed[3], placed[4]], axis=1)[kept])


def _points(shapes: Shapes, beams: Floats, gaps: Gaps, curtains: Floats) -> Floats:
    """Points (n, 2) between which everything is painted."""
    return np.concatenate([shapes.ends, beams[:, 4:8], gaps.ends, curtains]).reshape(-1, 2)


def _stops(disc: Disc, solid: Bools, config: MapConfig) -> Floats:
    """How far it is to the nearest known wall in each direction (BINS,), less a cell and a half."""
    stops = np.full(BINS, np.inf)
    np.minimum.at(stops, disc.bins[solid], disc.ranges[solid])
    wide = np.minimum(np.minimum(stops, np.roll(stops, 1)), np.roll(stops, -1))
    return np.asarray(np.maximum(wide - 1.5 * config.cell_m, config.body_radius_m))


def _profiles(
    pose: Pose, shapes: Shapes, gaps: Gaps, curtains: Floats, beams: Floats, config: MapConfig
) -> tuple[Floats, Floats, Floats]:
    """How far it is free in each direction (BINS,): to a cell and a half before what was seen; before gaps, and as far
    as the curtains; well before what single beams met."""
    wall = shapes.wall >= 0
    drawn, filled = (depths(ends, pose.x, pose.y).max(axis=0, initial=0.0) for ends in (shapes.ends[wall], gaps.ends))
    core = beams[:, 2:4] - (pose.x, pose.y)
    both = np.concatenate([core, shapes.foot[~wall] - (pose.x, pose.y)])
    bearing, far = dmath.atan2(both[:, 1], both[:, 0]), np.sqrt(both[:, 0] * both[:, 0] + both[:, 1] * both[:, 1])
    alone = np.zeros(BINS)
    many = len(core)
    np.maximum.at(alone, bins_about(bearing[:many], config.core_deg * DEGREE), far[:many, None])
    np.maximum.at(drawn, bins_of(bearing[many:]), far[many:])
    # From the other side a curtain's own station sees as far: the two meet.
    open_to = depths(curtains, pose.x, pose.y).max(axis=0, initial=0.0) + config.cell_m
    between = np.maximum(filled - 1.5 * config.cell_m, np.where(open_to > config.cell_m, open_to, 0.0))
    return drawn - 1.5 * config.cell_m, between, alone


def _clear(canvas: Canvas, disc: Disc, fans: Floats, alone: Floats, config: MapConfig) -> None:
    """The robot stands here, and so far as the profiles (BINS,) reach nothing does."""
    canvas.free[disc.nearer(alone)] = -config.alone_free
    canvas.free[disc.nearer(fans)] = -config.fan
    canvas.free[disc.ranges < config.body_radius_m] = -config.body


def _unseen(canvas: Canvas, known: Cells, gaps: Gaps, config: MapConfig) -> Bools:
    """Which of the gaps a wall may fill: too many cells of the others were seen to be free."""
    cells, number = canvas.along(gaps.ends, 0.25)
    seen = np.bincount(number[known.reshape(-1)[cells] <= -config.veto], minlength=len(gaps.weight))
    return np.asarray(seen <= config.veto_share * np.bincount(number, minlength=len(gaps.weight)).astype(np.float64))
