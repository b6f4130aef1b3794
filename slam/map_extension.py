"""Block H, map extension: the sweep's features and readings as evidence on the occupancy grid [III.H].

A wall marks its segment and frees the fan in front of it. Between two neighbouring members of a chain the wall goes
on, unless what was seen there speaks against it. Readings of class (ii) sharpen their RCD; those of class (iii) weigh
little and free only what lies well before them; readings without an echo say nothing, for most specular walls give
none.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, WALL, Chains, Member
from slam.dmath import DEGREE
from slam.geometry import Pose, Segment
from slam.grid import Grid, Patch
from slam.paint import Canvas, Point
from slam.post_calibration import Posed
from slam.reliability import ALONE, NEAR_RCD, Reliability
from slam.self_calibration import Calibrated


@dataclass(frozen=True)
class MapConfig:
    """Cell size and the weights of the evidence, in log-odds × 10."""

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


def extend_map(
    grid: Grid,
    calibrated: Calibrated,
    reliability: Reliability,
    posed: Posed,
    chains: Chains,
    poses: tuple[Pose, ...],
    config: MapConfig,
) -> tuple[Grid, Patch]:
    """The grid with this sweep's evidence, and that evidence. `poses` are the sweeps' so far, this one's last."""
    here = (posed.pose.x, posed.pose.y)
    # A sweep without any echo says nothing at all, not even where the robot stood.
    if not bool(calibrated.beams.echo.any()):
        return grid, Patch(0, 0, np.zeros((1, 1), dtype=np.int16))
    members = _links(chains, poses, config)
    canvas = Canvas(_extent(calibrated, posed, members), config.cell_m, 0.5)
    _free_body(canvas, poses, config)
    _add_alone(canvas, calibrated, reliability, posed, config)
    solid = _solid(posed, chains, config)
    for k, segment in enumerate(posed.rcds):
        near = (reliability.rcd_of == k) & (reliability.reading_class == NEAR_RCD)
        sharpened = config.near * int(np.count_nonzero(near))
        is_wall = segment in solid
        base = config.wall if is_wall else config.narrow
        start, end = clipped(segment, here, solid) if is_wall else _foot(segment, config.cell_m)
        canvas.clear([here, _before(here, start, canvas), _before(here, end, canvas)], config.fan)
        canvas.mark(start, end, base + min(sharpened, base // 2))
    for corner in posed.corners:
        canvas.mark(corner, corner, config.narrow)
    for member, newest in members:
        _add_link(canvas, grid, member, newest, poses, config)
    patch = canvas.patch()
    return grid.extended(patch), patch


def _solid(posed: Posed, chains: Chains, config: MapConfig) -> tuple[Segment, ...]:
    """The sweep's walls that are drawn at full length: not points, and not what is far and not told from a point."""
    if not posed.walls:
        return ()
    natures = [member.nature for member in chains.members[-len(posed.walls) :]]
    here = (posed.pose.x, posed.pose.y)

    def far(wall: Segment) -> bool:
        sine, cosine = dmath.sincos(wall.alpha)
        return wall.rho - (cosine * here[0] + sine * here[1]) > config.open_m

    return tuple(
        wall
        for wall, nature in zip(posed.walls, natures, strict=True)
        if nature == WALL or (nature == OPEN and not far(wall))
    )


def _links(chains: Chains, poses: tuple[Pose, ...], config: MapConfig) -> list[tuple[Member, Member]]:
    """Pairs (older, newest) of neighbouring members of one chain with a gap between them that a wall may fill."""
    now = len(poses) - 1
    pairs = []
    for newest in (member for member in chains.members if member.sweep == now):
        sine, cosine = dmath.sincos(newest.segment.alpha)

        def along(point: Point, sine: float = sine, cosine: float = cosine) -> float:
            return cosine * point[1] - sine * point[0]

        low, high = sorted((along(newest.segment.start), along(newest.segment.end)))
        before: tuple[float, Member] | None = None
        after: tuple[float, Member] | None = None
        for older in chains.of(newest.chain):
            if older.sweep == now or POINT in (older.nature, newest.nature):
                continue
            start, end = sorted((along(older.segment.start), along(older.segment.end)))
            if end < low and (before is None or low - end < before[0]):
                before = (low - end, older)
            if start > high and (after is None or start - high < after[0]):
                after = (start - high, older)
        pairs += [(side[1], newest) for side in (before, after) if side is not None and side[0] <= config.link_gap_m]
    return pairs


def _extent(
    calibrated: Calibrated, posed: Posed, members: list[tuple[Member, Member]]
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Every point (n, 2) that may be painted."""
    points = [np.array([[posed.pose.x, posed.pose.y]]), posed.echoes[calibrated.beams.echo]]
    points += [np.array([s.start, s.end]) for s in posed.rcds]
    points += [np.array([m.segment.start, m.segment.end]) for m, _ in members]
    return np.concatenate(points)


def _free_body(canvas: Canvas, poses: tuple[Pose, ...], config: MapConfig) -> None:
    """The robot stands here."""
    here, radius = poses[-1], config.body_radius_m
    octagon = []
    for k in range(8):
        sine, cosine = dmath.sincos((45.0 * k + 22.5) * DEGREE)
        octagon.append((here.x + radius * cosine, here.y + radius * sine))
    canvas.clear(octagon, config.body)


def _before(here: Point, point: Point, canvas: Canvas) -> Point:
    """The point one and a half cells nearer to the robot."""
    distance = dmath.hypot(point[0] - here[0], point[1] - here[1])
    part = max(0.0, 1.0 - 1.5 * canvas.cell_m / distance) if distance > 0.0 else 0.0
    return (here[0] + part * (point[0] - here[0]), here[1] + part * (point[1] - here[1]))


def clipped(wall: Segment, here: Point, others: tuple[Segment, ...]) -> tuple[Point, Point]:
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


def _foot(segment: Segment, cell_m: float) -> tuple[Point, Point]:
    """A cell's width around the middle of what a narrow thing would be as a wall."""
    sine, cosine = dmath.sincos(segment.alpha)
    x, y = segment.middle
    return (x + 0.5 * cell_m * sine, y - 0.5 * cell_m * cosine), (x - 0.5 * cell_m * sine, y + 0.5 * cell_m * cosine)


def _add_alone(
    canvas: Canvas, calibrated: Calibrated, reliability: Reliability, posed: Posed, config: MapConfig
) -> None:
    """Class (iii) readings: a weak arc at their range, and the core of the beam well before it."""
    beams = calibrated.beams
    for k in np.flatnonzero(reliability.reading_class == ALONE).tolist():
        origin = (float(posed.origins[k, 0]), float(posed.origins[k, 1]))
        echo = (float(posed.echoes[k, 0]), float(posed.echoes[k, 1]))
        if any(crosses(origin, echo, wall, config.beyond_m) for wall in posed.walls):
            continue  # it came back by way of that wall
        reach = float(beams.distance[k])
        axis = float(beams.axis[k]) + posed.pose.theta
        sides = []
        for offset in (-config.beam_core_deg, config.beam_core_deg):
            sine, cosine = dmath.sincos(axis + offset * DEGREE)
            sides.append((cosine, sine))
        core = max(0.0, reach - config.alone_margin_m)
        canvas.clear([origin, *((origin[0] + core * c, origin[1] + core * s) for c, s in sides)], config.alone_free)
        ends = [(origin[0] + reach * c, origin[1] + reach * s) for c, s in sides]
        canvas.hint(ends[0], ends[1], config.alone)


def crosses(start: Point, end: Point, wall: Segment, beyond: float) -> bool:
    """Whether the way from start to end passes the wall, or up to `beyond` m past its ends, over 10 cm before its own.

    A sweep sees a short piece of a wall, and the wall goes on.
    """
    sine, cosine = dmath.sincos(wall.alpha)
    before = cosine * start[0] + sine * start[1] - wall.rho
    after = cosine * end[0] + sine * end[1] - wall.rho
    if before >= 0.0 or after <= 0.10:
        return False
    part = before / (before - after)
    x, y = start[0] + part * (end[0] - start[0]), start[1] + part * (end[1] - start[1])
    place = cosine * y - sine * x
    ends = [cosine * q - sine * p for p, q in (wall.start, wall.end)]
    return min(ends) - beyond <= place <= max(ends) + beyond


def _add_link(
    canvas: Canvas, grid: Grid, older: Member, newest: Member, poses: tuple[Pose, ...], config: MapConfig
) -> None:
    """The wall goes on between two members, unless a quarter of the cells there were seen to be free."""
    pairs = [
        (a, b) for a in (older.segment.start, older.segment.end) for b in (newest.segment.start, newest.segment.end)
    ]
    start, end = min(pairs, key=lambda pair: dmath.hypot(pair[0][0] - pair[1][0], pair[0][1] - pair[1][1]))
    rows, columns = canvas.cells_along(start, end)
    known = grid.window(canvas.left, canvas.bottom, canvas.width, canvas.height)[rows, columns]
    if 4 * int(np.count_nonzero(known <= -config.fan)) > len(known):
        return
    there, here = poses[older.sweep], poses[newest.sweep]
    a, b = (there.x, there.y), (here.x, here.y)
    canvas.clear([a, b, _before(b, end, canvas), _before(a, start, canvas)], config.between)
    canvas.mark(start, end, config.link)
