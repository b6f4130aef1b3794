"""Where a wall goes on between what was seen of it: between neighbouring members of its chain.

Must not know: the grid, weights, how things are drawn.
"""

from dataclasses import dataclass

from slam import dmath
from slam.association import POINT, Member
from slam.geometry import Pose
from slam.paint import Point


@dataclass(frozen=True)
class Gap:
    """A gap from `start` to `end` that a wall may fill, seen from the stations `here` and `there` of two sweeps."""

    start: Point
    end: Point
    here: Point
    there: Point
    sweep: int  # the older of the two


def gaps(newest: Member, chain: list[Member], poses: tuple[Pose, ...], longest: float) -> list[Gap]:
    """The gaps between a member of a chain and its older neighbours on either side."""
    sine, cosine = dmath.sincos(newest.segment.alpha)

    def extent(member: Member) -> tuple[float, float]:
        places = [cosine * y - sine * x for x, y in (member.segment.start, member.segment.end)]
        return min(places), max(places)

    low, high = extent(newest)
    before: tuple[float, Member] | None = None
    after: tuple[float, Member] | None = None
    for older in chain:
        if older.sweep >= newest.sweep or POINT in (older.nature, newest.nature):
            continue
        start, end = extent(older)
        if end < low and (before is None or low - end < before[0]):
            before = (low - end, older)
        if start > high and (after is None or start - high < after[0]):
            after = (start - high, older)
    sides = [side[1] for side in (before, after) if side is not None and side[0] <= longest]
    return [_between(newest, older, poses) for older in sides]


def _between(newest: Member, older: Member, poses: tuple[Pose, ...]) -> Gap:
    here, there = poses[newest.sweep], poses[older.sweep]
    pairs = [
        (a, b) for a in (newest.segment.start, newest.segment.end) for b in (older.segment.start, older.segment.end)
    ]
    start, end = min(pairs, key=lambda pair: dmath.hypot(pair[0][0] - pair[1][0], pair[0][1] - pair[1][1]))
    return Gap(start, end, (here.x, here.y), (there.x, there.y), older.sweep)
