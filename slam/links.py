"""Where a wall goes on beyond what was seen of it: to its neighbours in the chain, and to the corner it ends in.

A sonar hears a wall from the foot of the perpendicular only, and corners, edges and poles from where they stand. So a
wall is known in pieces; what stands in line with it, not far from its end, is most often where it ends. Must not know:
the grid, weights, how things are drawn.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.association import POINT, Member
from slam.dmath import DEGREE, Floats
from slam.geometry import Bools, Pose, wrap
from slam.paint import Point


@dataclass(frozen=True)
class Gap:
    """A gap from `start` to `end` that a wall may fill, seen from the stations `here` and `there` of two sweeps.

    `sweep` is the older of the two.
    """

    start: Point
    end: Point
    here: Point
    there: Point
    sweep: int


@dataclass(frozen=True)
class Spot:
    """Something that is no wall, or not known to be one: it was heard by a sweep, in the direction `bearing`."""

    point: Point
    bearing: float
    sweep: int


@dataclass(frozen=True)
class EndConfig:
    """What ends a wall: so near its line, so far from its end, and heard at least so far from the wall's own normal."""

    beside_m: float = 0.08
    longest_m: float = 2.0
    aside_deg: float = 20.0


def chain_gaps(newest: Member, chain: list[Member], poses: tuple[Pose, ...], longest: float) -> list[Gap]:
    """The gaps between a member of a chain and its older neighbours on either side."""
    older = [member for member in chain if member.sweep < newest.sweep and member.nature != POINT]
    if not older or newest.nature == POINT:
        return []
    sine, cosine = dmath.sincos(newest.segment.alpha)
    ends = np.array([[member.segment.start, member.segment.end] for member in (newest, *older)])
    places = cosine * ends[:, :, 1] - sine * ends[:, :, 0]
    low, high = places.min(axis=1), places.max(axis=1)
    found = []
    for room in (low[0] - high[1:], low[1:] - high[0]):
        gap = np.where(room > 0.0, room, np.inf)
        nearest = int(np.argmin(gap))
        if gap[nearest] <= longest:
            found.append(_between(newest, older[nearest], poses))
    return found


def _between(newest: Member, older: Member, poses: tuple[Pose, ...]) -> Gap:
    here, there = poses[newest.sweep], poses[older.sweep]
    pairs = [
        (a, b) for a in (newest.segment.start, newest.segment.end) for b in (older.segment.start, older.segment.end)
    ]
    start, end = min(pairs, key=lambda pair: dmath.hypot(pair[0][0] - pair[1][0], pair[0][1] - pair[1][1]))
    return Gap(start, end, (here.x, here.y), (there.x, there.y), older.sweep)


def end_gaps(
    walls: list[Member], spots: list[Spot], newest: int, poses: tuple[Pose, ...], config: EndConfig
) -> list[Gap]:
    """The gaps from walls' ends to the nearest spot in line, if no other piece of the chain lies between.

    Only those of which one side was seen by sweep `newest`.
    """
    if not walls or not spots:
        return []
    alpha = np.array([wall.segment.alpha for wall in walls])[:, None]
    rho = np.array([wall.segment.rho for wall in walls])[:, None]
    sine, cosine = dmath.sincos(alpha)
    x, y = np.array([spot.point[0] for spot in spots]), np.array([spot.point[1] for spot in spots])
    aside = np.abs(wrap(np.array([spot.bearing for spot in spots]) - alpha)) >= config.aside_deg * DEGREE
    in_line = aside & (np.abs(cosine * x + sine * y - rho) <= config.beside_m)
    place = cosine * y - sine * x
    low, high, room = _rooms(walls, sine, cosine)
    found = []
    for side, beyond in ((0, low[:, None] - place), (1, place - high[:, None])):
        fits = in_line & (beyond > 0.0) & (beyond <= np.minimum(room[side], config.longest_m)[:, None])
        nearest = np.argmin(np.where(fits, beyond, np.inf), axis=1)
        for k in np.flatnonzero(fits.any(axis=1)).tolist():
            wall, spot = walls[k], spots[int(nearest[k])]
            if newest in (wall.sweep, spot.sweep):
                found.append(_to_spot(wall, side, spot, poses))
    return found


def _rooms(walls: list[Member], sine: Floats, cosine: Floats) -> tuple[Floats, Floats, tuple[Floats, Floats]]:
    """Each wall's extent (w,) along itself, and how far it is on either side to the next piece of its chain."""
    ends = np.array([[wall.segment.start, wall.segment.end] for wall in walls])
    chain = np.array([wall.chain for wall in walls])
    places = [cosine * ends[None, :, e, 1] - sine * ends[None, :, e, 0] for e in (0, 1)]
    starts, stops = np.minimum(*places), np.maximum(*places)  # of wall b along wall a, at [a, b]
    own = np.arange(len(walls))
    low, high = starts[own, own], stops[own, own]
    others: Bools = (chain[:, None] == chain[None, :]) & (own[:, None] != own[None, :])
    below = np.where(others & (starts < low[:, None]), low[:, None] - stops, np.inf).min(axis=1)
    above = np.where(others & (stops > high[:, None]), starts - high[:, None], np.inf).min(axis=1)
    return low, high, (below, above)


def _to_spot(wall: Member, side: int, spot: Spot, poses: tuple[Pose, ...]) -> Gap:
    sine, cosine = dmath.sincos(wall.segment.alpha)
    ends = sorted((wall.segment.start, wall.segment.end), key=lambda p: cosine * p[1] - sine * p[0])
    here, there = poses[wall.sweep], poses[spot.sweep]
    return Gap(ends[side], spot.point, (here.x, here.y), (there.x, there.y), min(wall.sweep, spot.sweep))


def heard_through(gaps: Floats, paths: Floats, margin_m: float = 0.15) -> Bools:
    """Which of the gaps (g, 4) one of the ways of sound (p, 4), from a station to what answered, goes through.

    Not near their ends, and not near its own.
    """
    if len(gaps) == 0 or len(paths) == 0:
        return np.zeros(len(gaps), dtype=bool)
    gx, gy = gaps[:, 2:3] - gaps[:, :1], gaps[:, 3:] - gaps[:, 1:2]
    px, py = paths[:, 2] - paths[:, 0], paths[:, 3] - paths[:, 1]
    x, y = paths[:, 0] - gaps[:, :1], paths[:, 1] - gaps[:, 1:2]
    across = gx * py - gy * px
    length, way = np.maximum(dmath.hypot(gx, gy), 1e-9), np.maximum(dmath.hypot(px, py), 1e-9)
    steep = np.abs(across) > 0.34 * length * way  # sound that comes along the wall says nothing
    safe = np.where(steep, across, 1.0)
    place, part = (x * py - y * px) / safe * length, (x * gy - y * gx) / safe * way
    inside = (place > margin_m) & (place < length - margin_m) & (part > 0.0) & (part < way - margin_m)
    return np.asarray((steep & inside).any(axis=1))
