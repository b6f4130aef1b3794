"""One sweep drawn on the map: what it saw, from its pose as known now, with the natures and walls as known now.

Must not know: other sweeps' sights, how layers add up.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.association import OPEN, WALL, Member
from slam.disc import BINS, Disc, angles_of, bins_between, disc_around
from slam.dmath import DEGREE, Floats
from slam.evidence import NOTHING, Layer, cropped
from slam.geometry import Pose, Segment
from slam.grid import Grid
from slam.links import Gap
from slam.paint import Canvas, Point
from slam.sight import Sight, Thing


@dataclass(frozen=True)
class MapConfig:
    """Cell size and the weights of the evidence, in log-odds × 10; how far a sweep moves before it is drawn again."""

    cell_m: float = 0.05
    occupied_from: int = 15
    free_from: int = -6
    wall: int = 40
    narrow: int = 25
    link: int = 20
    near: int = 2  # a class (ii) reading, to its RCD's own weight
    alone: int = 2  # a class (iii) reading
    fan: int = 12
    between: int = 8  # between two stations and the wall that links them
    body: int = 20
    alone_free: int = 2
    alone_margin_m: float = 0.40
    link_gap_m: float = 1.2
    open_m: float = 2.0  # farther than this, what may be a point is drawn as one
    beyond_m: float = 5.0  # how far past the ends of what was seen a wall still stops a beam
    body_radius_m: float = 0.16
    beam_core_deg: float = 4.0
    repaint_m: float = 0.015
    repaint_deg: float = 0.3
    plain_cone: bool = False


def render(
    sight: Sight, pose: Pose, members: tuple[Member, ...], links: list[Gap], grid: Grid, config: MapConfig
) -> Layer:
    """The sweep's evidence; `members` are its walls in the map frame, `links` the gaps that they leave in chains."""
    if len(sight.beams) == 0 and not sight.things:
        return NOTHING  # a sweep without any echo says nothing at all, not even where the robot stood
    here = (pose.x, pose.y)
    solid = _solid(members, here, config)
    beams = _unblocked(sight, pose, members, config)
    outlines = [_outline(thing, pose, members, solid, config) for thing in sight.things]
    disc = disc_around(*here, _reach(here, outlines, beams, links), config.cell_m)
    height, width = disc.bins.shape
    canvas = Canvas(disc.left, disc.bottom, width, height, config.cell_m)
    _clear(canvas, disc, here, outlines, beams, config)
    for outline in outlines:
        sharpened = config.near * outline.support
        base = config.wall if outline.solid else config.narrow
        canvas.mark(outline.start, outline.end, base + min(sharpened, base // 2))
    _hint(canvas, beams, config)
    for gap in links:
        _fill(canvas, grid, gap, config)
    return cropped(canvas.left, canvas.bottom, canvas.evidence())


@dataclass(frozen=True)
class _Outline:
    start: Point
    end: Point
    solid: bool  # a wall, drawn at full length
    support: int


def _solid(members: tuple[Member, ...], here: Point, config: MapConfig) -> list[int]:
    """The walls that are drawn at full length: not points, and not what is far and not told from a point."""

    def far(wall: Segment) -> bool:
        sine, cosine = dmath.sincos(wall.alpha)
        return wall.rho - (cosine * here[0] + sine * here[1]) > config.open_m

    return [
        k
        for k, member in enumerate(members)
        if member.nature == WALL or (member.nature == OPEN and not far(member.segment))
    ]


def _outline(thing: Thing, pose: Pose, members: tuple[Member, ...], solid: list[int], config: MapConfig) -> _Outline:
    if thing.wall in solid:
        others = [members[k].segment for k in solid if k != thing.wall]
        start, end = clipped(members[thing.wall].segment, (pose.x, pose.y), others)
        return _Outline(start, end, True, thing.support)
    if thing.corner is not None:
        at = pose.points(np.array([thing.corner])).tolist()[0]
        return _Outline((at[0], at[1]), (at[0], at[1]), False, thing.support)
    surface = thing.surface.moved(pose)
    sine, cosine = dmath.sincos(surface.alpha)
    off = surface.rho - (cosine * pose.x + sine * pose.y)
    x, y = pose.x + off * cosine, pose.y + off * sine
    half = 0.5 * config.cell_m
    return _Outline((x + half * sine, y - half * cosine), (x - half * sine, y + half * cosine), False, thing.support)


def clipped(wall: Segment, here: Point, others: list[Segment]) -> tuple[Point, Point]:
    """The wall's ends, drawn in to where it meets the lines of others: what lies behind those was not seen.

    The part that holds the foot point stays, for that is what answered.
    """
    sine, cosine = dmath.sincos(wall.alpha)
    off = wall.rho - (cosine * here[0] + sine * here[1])
    foot = (here[0] + off * cosine, here[1] + off * sine)
    ends = [wall.start, wall.end]
    for other in others:
        other_sine, other_cosine = dmath.sincos(other.alpha)

        def behind(point: Point, s: float = other_sine, c: float = other_cosine, rho: float = other.rho) -> float:
            return c * point[0] + s * point[1] - rho

        inside = behind(foot)
        if inside >= 0.0:
            continue
        for k, end in enumerate(ends):
            past = behind(end)
            if past > 0.0:
                part = inside / (inside - past)
                ends[k] = (foot[0] + part * (end[0] - foot[0]), foot[1] + part * (end[1] - foot[1]))
    return ends[0], ends[1]


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


def _reach(here: Point, outlines: list[_Outline], beams: Floats, links: list[Gap]) -> float:
    """How far from the station anything is painted."""
    points = [point for outline in outlines for point in (outline.start, outline.end)]
    points += [point for gap in links for point in (gap.start, gap.end, gap.there)]
    far = [dmath.hypot(x - here[0], y - here[1]) for x, y in points]
    return max([0.5, *far, float(beams[:, 3].max()) + 0.2 if len(beams) else 0.0])


def _clear(canvas: Canvas, disc: Disc, here: Point, outlines: list[_Outline], beams: Floats, config: MapConfig) -> None:
    """The robot stands here, and before each thing, and well before what single beams met, nothing does."""
    fans, alone = np.zeros(BINS), np.zeros(BINS)
    for outline in outlines:
        bins, depth = _fan(outline, here, config)
        fans[bins] = np.maximum(fans[bins], depth)
    for x, y, axis, reach in beams.tolist():
        core = reach - config.alone_margin_m
        if core > 0.0:
            sine, cosine = dmath.sincos(axis)
            dx, dy = x + core * cosine - here[0], y + core * sine - here[1]
            bearing = dmath.atan2(dy, dx)
            bins = bins_between(bearing - config.beam_core_deg * DEGREE, bearing + config.beam_core_deg * DEGREE)
            alone[bins] = np.maximum(alone[bins], dmath.hypot(dx, dy))
    canvas.free[disc.nearer(alone)] = -config.alone_free
    canvas.free[disc.nearer(fans)] = -config.fan
    canvas.free[disc.ranges < config.body_radius_m] = -config.body


def _fan(
    outline: _Outline, here: Point, config: MapConfig
) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], Floats]:
    """The directions in which a thing is seen, and how far it is free there: to a cell and a half before it."""
    (x0, y0), (x1, y1) = ((x - here[0], y - here[1]) for x, y in (outline.start, outline.end))
    first, last = dmath.atan2(y0, x0), dmath.atan2(y1, x1)
    bins = bins_between(first, last)
    angles = angles_of(bins)
    sine, cosine = dmath.sincos(angles)
    dx, dy = x1 - x0, y1 - y0
    across = cosine * dy - sine * dx
    apart = np.abs(across) > 1e-9
    depth = np.where(apart, (x0 * dy - y0 * dx) / np.where(apart, across, 1.0), dmath.hypot(x0, y0))
    return bins, depth - 1.5 * config.cell_m


def _hint(canvas: Canvas, beams: Floats, config: MapConfig) -> None:
    """A weak arc at the range of each single beam."""
    for x, y, axis, reach in beams.tolist() if config.alone else ():
        ends = []
        for offset in (-config.beam_core_deg, config.beam_core_deg):
            sine, cosine = dmath.sincos(axis + offset * DEGREE)
            ends.append((x + reach * cosine, y + reach * sine))
        canvas.hint(ends[0], ends[1], config.alone)


def _fill(canvas: Canvas, grid: Grid, gap: Gap, config: MapConfig) -> None:
    """The wall goes on in the gap, unless a quarter of the cells there were seen to be free."""
    rows, columns = canvas.cells_along(gap.start, gap.end)
    known = grid.window(canvas.left, canvas.bottom, canvas.width, canvas.height)[rows, columns]
    if 4 * int(np.count_nonzero(known <= -config.fan)) > len(known):
        return
    before = [_before(gap.here, gap.start, config.cell_m), _before(gap.there, gap.end, config.cell_m)]
    canvas.clear([gap.there, gap.here, *before], config.between)
    canvas.mark(gap.start, gap.end, config.link)


def _before(here: Point, point: Point, cell_m: float) -> Point:
    """The point one and a half cells nearer to the robot."""
    distance = dmath.hypot(point[0] - here[0], point[1] - here[1])
    part = max(0.0, 1.0 - 1.5 * cell_m / distance) if distance > 0.0 else 0.0
    return (here[0] + part * (point[0] - here[0]), here[1] + part * (point[1] - here[1]))
