"""What is drawn of the things a sweep saw: a wall as long as it was seen, anything else as a dot where it was heard.

One sweep cannot tell a corner from a wall. What stands in line with a known wall and answers from another direction is
taken for a corner: a robot has some width, and does not come so near to a wall as to hear another one at right angles
there. Must not know: the grid, weights.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, WALL, Member
from slam.dmath import DEGREE, Floats
from slam.geometry import Bools, Pose, Segment
from slam.paint import Point
from slam.sight import Sight, Thing


@dataclass(frozen=True)
class ShapeConfig:
    """When something that may be a wall or a corner is drawn as a wall: near enough, and not in line with a wall."""

    open_m: float = 4.0
    in_line_m: float = 0.12
    in_line_deg: float = 20.0
    in_line_reach_m: float = 1.0


@dataclass(frozen=True)
class Shape:
    """A thing at `foot`, heard in the direction `bearing` (map frame), drawn from `start` to `end`.

    `wall`: its number among the sweep's walls if it is drawn as one, else −1. `told`: it is known to be one.
    """

    foot: Point
    bearing: float
    start: Point
    end: Point
    wall: int
    told: bool
    support: int


def shapes_of(
    sight: Sight, pose: Pose, members: tuple[Member, ...], around: Floats, config: ShapeConfig
) -> tuple[Shape, ...]:
    """A shape for each thing of the sweep; `members` are its walls, `around` (w, 4) those of other sweeps near by."""
    here = (pose.x, pose.y)
    own = [(*m.segment.start, *m.segment.end) for m in members if m.nature != POINT]
    known = np.concatenate([around, np.array(own).reshape(-1, 4)])
    feet = [foot_of(member.segment, here) for member in members]
    doubtful = in_line(feet, [member.segment.alpha for member in members], known, config)
    solid = [
        k
        for k, member in enumerate(members)
        if member.nature == WALL
        or (
            member.nature == OPEN
            and not doubtful[k]
            and dmath.hypot(feet[k][0] - here[0], feet[k][1] - here[1]) <= config.open_m
        )
    ]
    return tuple(_shape(thing, pose, members, solid, around) for thing in sight.things)


def _shape(thing: Thing, pose: Pose, members: tuple[Member, ...], solid: list[int], around: Floats) -> Shape:
    here = (pose.x, pose.y)
    if thing.wall in solid:
        own = members[thing.wall]
        start, end = clipped(own.segment, here, [members[k].segment for k in solid if k != thing.wall])
        start, end = cut(foot_of(own.segment, here), start, end, around)
        told = own.nature == WALL
        return Shape(foot_of(own.segment, here), own.segment.alpha, start, end, thing.wall, told, thing.support)
    surface = thing.surface.moved(pose)
    foot = foot_of(surface, here)
    if thing.corner is not None:
        x, y = pose.points(np.array([thing.corner])).tolist()[0]
        foot = (x, y)
    return Shape(foot, surface.alpha, foot, foot, -1, False, thing.support)


def foot_of(wall: Segment, here: Point) -> Point:
    """The point of the wall's line nearest to a station."""
    sine, cosine = dmath.sincos(wall.alpha)
    off = wall.rho - (cosine * here[0] + sine * here[1])
    return (here[0] + off * cosine, here[1] + off * sine)


def in_line(feet: list[Point], bearings: list[float], walls: Floats, config: ShapeConfig) -> list[bool]:
    """Which of the feet lie in line with one of the walls (w, 4), not far past its ends, and face away from it."""
    if not feet or len(walls) == 0:
        return [False] * len(feet)
    points = np.array(feet)
    along_x, along_y, length = _directions(walls)
    dx, dy = points[:, :1] - walls[:, 0], points[:, 1:] - walls[:, 1]
    off, place = np.abs(along_x * dy - along_y * dx), along_x * dx + along_y * dy
    sine, cosine = dmath.sincos(np.array(bearings))
    limit = dmath.sin(config.in_line_deg * DEGREE)
    aside = np.abs(cosine[:, None] * along_x + sine[:, None] * along_y) > limit
    reach = config.in_line_reach_m
    found = aside & (off <= config.in_line_m) & (place >= -reach) & (place <= length + reach)
    answers: Bools = np.asarray(found.any(axis=1))
    return [bool(each) for each in answers]


def _directions(walls: Floats) -> tuple[Floats, Floats, Floats]:
    """Unit vectors along walls (w, 4), and their lengths."""
    dx, dy = walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]
    length = np.maximum(dmath.hypot(dx, dy), 1e-6)
    return dx / length, dy / length, length


def cut(foot: Point, start: Point, end: Point, walls: Floats, margin_m: float = 0.1) -> tuple[Point, Point]:
    """A wall's ends, drawn in to where walls (w, 4) of other sweeps cross it; the part that holds the foot stays."""
    if len(walls) == 0:
        return start, end
    along_x, along_y, length = _directions(walls)
    ends = []
    for x, y in (start, end):
        dx, dy = x - foot[0], y - foot[1]
        across = along_x * dy - along_y * dx
        safe = np.where(np.abs(across) > 1e-9, across, 1.0)
        to_x, to_y = walls[:, 0] - foot[0], walls[:, 1] - foot[1]
        part = (along_x * to_y - along_y * to_x) / safe
        place = (dx * to_y - dy * to_x) / safe
        size = dmath.hypot(dx, dy)
        steep = np.abs(across) > 0.34 * size  # crossings under 20° are the same wall
        met = steep & (part * size > margin_m) & (part < 1.0) & (place >= -margin_m) & (place <= length + margin_m)
        nearest = float(np.where(met, part, 1.0).min())
        ends.append((foot[0] + nearest * dx, foot[1] + nearest * dy))
    return ends[0], ends[1]


def clipped(wall: Segment, here: Point, others: list[Segment]) -> tuple[Point, Point]:
    """The wall's ends, drawn in to where it meets the lines of others: what lies behind those was not seen.

    The part that holds the foot point stays, for that is what answered.
    """
    foot = foot_of(wall, here)
    ends = [wall.start, wall.end]
    for other in others:
        sine, cosine = dmath.sincos(other.alpha)
        inside = cosine * foot[0] + sine * foot[1] - other.rho
        if inside >= 0.0:
            continue
        for k, end in enumerate(ends):
            past = cosine * end[0] + sine * end[1] - other.rho
            if past > 0.0:
                part = inside / (inside - past)
                ends[k] = (foot[0] + part * (end[0] - foot[0]), foot[1] + part * (end[1] - foot[1]))
    return ends[0], ends[1]
