"""One sweep drawn on the map: what it saw, from its pose as known now, with the natures and walls as known now.

Must not know: other sweeps' sights, how layers add up.
"""

from dataclasses import dataclass, field

import numpy as np

from slam import dmath
from slam.association import Member
from slam.disc import BINS, RAYS, Disc, bins_about, bins_between, disc_around
from slam.dmath import DEGREE, Floats
from slam.evidence import Layer, cropped
from slam.geometry import Bools, Pose
from slam.grid import Cells, Grid
from slam.links import EndConfig, Gap
from slam.paint import Canvas, Point
from slam.shapes import Shape, ShapeConfig
from slam.sight import Sight
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
    narrow: int = 25  # whatever is no wall
    near: int = 2  # a class (ii) reading, to its RCD's own weight
    link: int = 40  # between neighbours of a chain
    end: int = 40  # between a wall and the corner it ends in
    alone: int = 1  # a class (iii) reading
    fan: int = 8  # before what was seen
    between: int = 8  # before what a gap was filled with
    body: int = 20  # where the robot stood
    alone_free: int = 2  # well before a class (iii) reading
    alone_margin_m: float = 0.40
    link_gap_m: float = 1.2
    veto: int = 20  # a gap was seen to be free where so much evidence says so …
    veto_share: float = 0.25  # … in more than this part of its cells
    solid_from: int = 20  # as sure as this, a wall stops fans
    beyond_m: float = 5.0  # how far past the ends of what was seen a wall still stops a single beam
    body_radius_m: float = 0.16
    core_deg: float = 4.0  # half of a single beam's width that counts
    around_m: float = 6.0  # sweeps farther apart do not see the same things
    repaint_m: float = 0.015
    repaint_deg: float = 0.3
    plain_cone: bool = False
    shapes: ShapeConfig = field(default_factory=ShapeConfig)
    ends: EndConfig = field(default_factory=EndConfig)


def render(
    sight: Sight,
    pose: Pose,
    members: tuple[Member, ...],
    shapes: tuple[Shape, ...],
    links: list[Gap],
    ends: list[Gap],
    grid: Grid,
    config: MapConfig,
) -> Layer:
    """The sweep's evidence: its shapes, its single beams, and the gaps that it helps to close.

    `members` are its walls in the map frame; what the grid shows of walls stops fans, and so do
    the sweep's own.
    """
    here = (pose.x, pose.y)
    beams = _unblocked(sight, pose, members, config)
    disc = disc_around(*here, _reach(here, shapes, beams, [*links, *ends]), config.cell_m)
    height, width = disc.bins.shape
    canvas = Canvas(disc.left, disc.bottom, width, height, config.cell_m)
    for shape in shapes:
        base = config.wall if shape.wall >= 0 else config.narrow
        canvas.mark(shape.start, shape.end, base + min(config.near * shape.support, base // 2))
    known = grid.window(disc.left, disc.bottom, width, height)
    solid = np.maximum(known, canvas.occupied) >= config.solid_from
    _clear(canvas, disc, _profiles(here, shapes, beams, _stops(disc, solid, config), config), config)
    _hint(canvas, beams, config)
    for gap in links:
        _fill(canvas, known, solid, gap, config.link, config)
    for gap in ends:
        _fill(canvas, known, solid, gap, config.end, config)
    return cropped(canvas.left, canvas.bottom, canvas.evidence())


def _unblocked(sight: Sight, pose: Pose, members: tuple[Member, ...], config: MapConfig) -> Floats:
    """The single beams (k, 4) in the map frame, without those that came back by way of one of the sweep's walls.

    They pass a wall, or up to `beyond_m` past its ends, over 10 cm before their own: a sweep sees a short piece of a
    wall, and the wall goes on.
    """
    origins = pose.points(sight.beams[:, :2])
    axis, reach = sight.beams[:, 2] + pose.theta, sight.beams[:, 3]
    sine, cosine = dmath.sincos(axis)
    ends = origins + np.stack([reach * cosine, reach * sine], axis=1)
    kept = sight.echoed.copy()
    for wall in (member.segment for member in members):
        s, c = dmath.sincos(wall.alpha)
        before = c * origins[:, 0] + s * origins[:, 1] - wall.rho
        after = c * ends[:, 0] + s * ends[:, 1] - wall.rho
        through = (before < 0.0) & (after > 0.10)
        part = before / np.where(through, before - after, 1.0)
        x = origins[:, 0] + part * (ends[:, 0] - origins[:, 0])
        y = origins[:, 1] + part * (ends[:, 1] - origins[:, 1])
        place = c * y - s * x
        low, high = sorted(c * q - s * p for p, q in (wall.start, wall.end))
        kept &= ~(through & (low - config.beyond_m <= place) & (place <= high + config.beyond_m))
    return np.concatenate([origins, axis[:, None], reach[:, None]], axis=1)[kept]


def _reach(here: Point, shapes: tuple[Shape, ...], beams: Floats, gaps: list[Gap]) -> float:
    """How far from the station anything is painted."""
    points = [point for shape in shapes for point in (shape.start, shape.end)]
    points += [point for gap in gaps for point in (gap.start, gap.end, gap.there)]
    far = [dmath.hypot(x - here[0], y - here[1]) for x, y in points]
    return max([0.5, *far, float(beams[:, 3].max()) + 0.2 if len(beams) else 0.0])


def _stops(disc: Disc, solid: Bools, config: MapConfig) -> Floats:
    """How far it is to the nearest known wall in each direction (BINS,), less a cell and a half."""
    stops = np.full(BINS, np.inf)
    np.minimum.at(stops, disc.bins[solid], disc.ranges[solid])
    wide = np.minimum(np.minimum(stops, np.roll(stops, 1)), np.roll(stops, -1))
    return np.asarray(np.maximum(wide - 1.5 * config.cell_m, config.body_radius_m))


def _profiles(
    here: Point, shapes: tuple[Shape, ...], beams: Floats, stops: Floats, config: MapConfig
) -> tuple[Floats, Floats]:
    """How far it is free in each direction (BINS,): before the shapes, and well before what single beams met."""
    fans, alone = np.zeros(BINS), np.zeros(BINS)
    for shape in shapes:
        bins, depth = _fan(shape, here, config)
        fans[bins] = np.maximum(fans[bins], depth)
    core = beams[:, 3] - config.alone_margin_m
    sine, cosine = dmath.sincos(beams[:, 2])
    dx, dy = beams[:, 0] + core * cosine - here[0], beams[:, 1] + core * sine - here[1]
    np.maximum.at(
        alone,
        bins_about(dmath.atan2(dy, dx), config.core_deg * DEGREE),
        np.where(core > 0.0, dmath.hypot(dx, dy), 0.0)[:, None],
    )
    return np.minimum(fans, stops), np.minimum(alone, stops)


def _fan(shape: Shape, here: Point, config: MapConfig) -> tuple[Ints, Floats]:
    """The directions in which a shape is seen, and how far it is free there: to a cell and a half before it."""
    (x0, y0), (x1, y1) = ((x - here[0], y - here[1]) for x, y in (shape.start, shape.end))
    dx, dy = x1 - x0, y1 - y0
    if shape.wall < 0:
        bearing = dmath.atan2(y0, x0)
        return bins_between(bearing, bearing), np.full(1, dmath.hypot(x0, y0) - 1.5 * config.cell_m)
    bins = bins_between(dmath.atan2(y0, x0), dmath.atan2(y1, x1))
    sine, cosine = RAYS[0][bins], RAYS[1][bins]
    across = cosine * dy - sine * dx
    apart = np.abs(across) > 1e-9
    depth = np.where(apart, (x0 * dy - y0 * dx) / np.where(apart, across, 1.0), 0.0)
    return bins, depth - 1.5 * config.cell_m


def _clear(canvas: Canvas, disc: Disc, profiles: tuple[Floats, Floats], config: MapConfig) -> None:
    """The robot stands here, and so far as the profiles reach nothing does."""
    fans, alone = profiles
    canvas.free[disc.nearer(alone)] = -config.alone_free
    canvas.free[disc.nearer(fans)] = -config.fan
    canvas.free[disc.ranges < config.body_radius_m] = -config.body


def _hint(canvas: Canvas, beams: Floats, config: MapConfig) -> None:
    """A weak arc at the range of each single beam."""
    if not config.alone or len(beams) == 0:
        return
    ends = []
    for offset in (-config.core_deg, config.core_deg):
        sine, cosine = dmath.sincos(beams[:, 2] + offset * DEGREE)
        ends.append((beams[:, 0] + beams[:, 3] * cosine, beams[:, 1] + beams[:, 3] * sine))
    canvas.hint(ends[0], ends[1], config.alone)


def _fill(canvas: Canvas, known: Cells, solid: Bools, gap: Gap, weight: int, config: MapConfig) -> None:
    """The wall goes on in the gap, unless too many of the cells there were seen to be free."""
    rows, columns = canvas.cells_along(gap.start, gap.end)
    if int(np.count_nonzero(known[rows, columns] <= -config.veto)) > config.veto_share * len(rows):
        return
    before = [_before(gap.here, gap.start, config.cell_m), _before(gap.there, gap.end, config.cell_m)]
    canvas.clear([gap.there, gap.here, *before], config.between, solid)
    canvas.mark(gap.start, gap.end, weight)


def _before(here: Point, point: Point, cell_m: float) -> Point:
    """The point one and a half cells nearer to the robot."""
    distance = dmath.hypot(point[0] - here[0], point[1] - here[1])
    part = max(0.0, 1.0 - 1.5 * cell_m / distance) if distance > 0.0 else 0.0
    return (here[0] + part * (point[0] - here[0]), here[1] + part * (point[1] - here[1]))
