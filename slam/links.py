"""Where a wall goes on beyond what was seen of it: to its neighbours in the chain, and to the corner it ends in.

A sonar hears a wall from the foot of the perpendicular only, and corners, edges and poles from where they stand. So a
wall is known in pieces; what stands in line with it, not far from its end, is most often where it ends. Must not know:
the grid, weights, how things are drawn.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.dmath import DEGREE, Floats
from slam.geometry import Bools
from slam.pieces import Pieces
from slam.sweep import Ints

STEEP = 0.34
"""Sine of 20°: sound that comes along a wall says nothing."""


@dataclass(frozen=True)
class Gaps:
    """g gaps that a wall may fill: `ends` (g, 4), each seen by another sweep or both by one.

    `weight` (g,) is what a wall in the gap is worth.
    """

    ends: Floats
    weight: Ints

    def at(self, rows: Bools | list[int]) -> "Gaps":
        """Some of them."""
        return Gaps(self.ends[rows], self.weight[rows])

    def joined(self, others: "Gaps") -> "Gaps":
        """These, then others."""
        return Gaps(np.concatenate([self.ends, others.ends]), np.concatenate([self.weight, others.weight]))


@dataclass(frozen=True)
class Spots:
    """s things that are no walls, or not known to be: at `point` (s, 2), heard towards `normal` (s, 2) by `sweep`."""

    point: Floats
    normal: Floats
    sweep: Ints

    def at(self, rows: Bools | Ints) -> "Spots":
        """Some of them."""
        return Spots(self.point[rows], self.normal[rows], self.sweep[rows])


@dataclass(frozen=True)
class EndConfig:
    """What ends a wall: so near its line, so far from its end, and heard at least so far from the wall's own normal."""

    beside_m: float = 0.08
    aside_deg: float = 20.0
    longest_m: float = 3.0
    ratio: float = 3.0  # … and not farther than so many times what is known of the wall, …
    short_m: float = 1.2  # … unless that is near
    ended_m: float = 0.15  # what stands so little before the wall's end has ended it


def extents(of: Pieces, along: Pieces) -> tuple[Floats, Floats]:
    """From where to where pieces (b,) reach along the lines of others (a,), each (a, b) m."""
    cosine, sine = along.normal[:, :1], along.normal[:, 1:]
    one, other = (cosine * of.ends[:, k + 1] - sine * of.ends[:, k] for k in (0, 2))
    return np.minimum(one, other), np.maximum(one, other)


def chain_gaps(own: Pieces, older: Pieces, longest: float, weight: int) -> Gaps:
    """The gaps between a sweep's walls and, of their chains, the nearest of older sweeps on either side."""
    low, high = extents(older, own)
    at = np.arange(len(own.chain))
    own_low, own_high = (each[at, at][:, None] for each in extents(own, own))
    same = own.chain[:, None] == older.chain
    pairs = []
    for room in (own_low - high, low - own_high):
        gap = np.where(same & (room > 0.0) & (room <= longest), room, np.inf)
        if gap.size:
            nearest = gap.argmin(axis=1)
            pairs += [(k, int(nearest[k])) for k in np.flatnonzero(np.isfinite(gap[at, nearest])).tolist()]
    rows = [_between(own.ends[a].tolist(), older.ends[b].tolist()) for a, b in pairs]
    return Gaps(np.array(rows).reshape(-1, 4), np.full(len(rows), weight))


def curtains(own: Pieces, older: Pieces, stations: Floats, here: tuple[float, float], longest: float) -> Floats:
    """Up to where it is free (c, 4) between here and the stations (b, 2) that saw the neighbouring pieces of a wall:

    from such a station to the nearer end of its piece. Pieces may overlap by as much as a step.
    """
    low, high = extents(older, own)
    at = np.arange(len(own.chain))
    own_low, own_high = (each[at, at][:, None] for each in extents(own, own))
    dx, dy = stations[:, 0] - here[0], stations[:, 1] - here[1]
    may = (own.chain[:, None] == older.chain) & (dx * dx + dy * dy <= longest * longest)
    rows = []
    for room in (own_low - high, low - own_high):
        off = np.where(may & (np.abs(room) <= longest), np.abs(room), np.inf)
        if off.size:
            nearest = off.argmin(axis=1)
            for k in np.flatnonzero(np.isfinite(off[at, nearest])).tolist():
                b = int(nearest[k])
                x, y = _between(older.ends[b].tolist(), own.ends[k].tolist())[:2]
                rows.append((float(stations[b, 0]), float(stations[b, 1]), x, y))
    return np.array(rows).reshape(-1, 4)


def _between(one: list[float], other: list[float]) -> tuple[float, float, float, float]:
    """The two ends nearest to each other."""
    pairs = [(one[i], one[i + 1], other[j], other[j + 1]) for i in (0, 2) for j in (0, 2)]
    return min(pairs, key=lambda p: (p[0] - p[2]) * (p[0] - p[2]) + (p[1] - p[3]) * (p[1] - p[3]))


def end_gaps(walls: Pieces, spots: Spots, sweep: int, config: EndConfig, weight: int) -> Gaps:
    """The gaps from walls' ends to the nearest spot in line, if no other piece of the chain lies between.

    Only those of which the later side was seen by that sweep.
    """
    mine = spots.sweep == sweep
    # A wall of another sweep matters only if one of this sweep's spots may be its end.
    rows = np.flatnonzero((walls.sweep == sweep) | _in_line(walls, spots.at(mine), config).any(axis=1))
    some = walls.at(rows)
    found = _in_line(some, spots, config)
    place = some.normal[:, :1] * spots.point[:, 1] - some.normal[:, 1:] * spots.point[:, 0]
    low, high, room, length = _rooms(some, walls, rows)
    reach = np.minimum(np.maximum(config.ratio * length, config.short_m), config.longest_m)
    sides = []
    for k, beyond in ((0, low - place), (1, place - high)):
        fits = found & (beyond > -config.ended_m) & (beyond <= np.minimum(room[k], reach))
        gap = np.where(fits, beyond, np.inf)
        nearest = gap.argmin(axis=1) if gap.size else np.zeros(len(rows), dtype=np.int64)
        least = gap.min(axis=1, initial=np.inf)
        good = np.isfinite(least) & (least > 0.0)
        good[good] &= np.maximum(some.sweep[good], spots.sweep[nearest[good]]) == sweep
        sides.append((np.flatnonzero(good), nearest[good], np.full(int(np.count_nonzero(good)), k)))
    wall, spot, side = (np.concatenate([each[k] for each in sides]) for k in range(3))
    ends = some.ends[wall]
    places_of = [some.normal[wall, 0] * ends[:, k + 1] - some.normal[wall, 1] * ends[:, k] for k in (0, 2)]
    first = (places_of[0] <= places_of[1]) == (side == 0)
    start = np.where(first[:, None], ends[:, :2], ends[:, 2:])
    return Gaps(np.concatenate([start, spots.point[spot]], axis=1), np.full(len(wall), weight))


def ended_by(gaps: Floats, seen_from: Floats, spots: Floats, config: EndConfig, margin_m: float = 0.1) -> Bools:
    """In which of the gaps (g, 4) one of the spots (s, 4) stands, so that a wall would have ended there.

    A wall has two faces: what was heard from behind it, not from where it was seen (g, 2), may stand on the other.
    """
    dx, dy = gaps[:, 2:3] - gaps[:, :1], gaps[:, 3:] - gaps[:, 1:2]
    place = np.where(_behind(gaps, seen_from, spots), np.inf, ended_at(gaps, spots, config, margin_m))
    return np.asarray((place < np.sqrt(dx * dx + dy * dy) - margin_m).any(axis=1))


def ended_at(gaps: Floats, spots: Floats, config: EndConfig, margin_m: float) -> Floats:
    """How far along each gap (g, 4) each spot (s, 4) would have ended a wall: (g, s) m, infinite where it would not.

    Nothing ends it so near its beginning as the margin; if that is negative, what stands so little before it does.
    """
    dx, dy = gaps[:, 2:3] - gaps[:, :1], gaps[:, 3:] - gaps[:, 1:2]
    length = np.maximum(np.sqrt(dx * dx + dy * dy), 1e-9)
    along_x, along_y = dx / length, dy / length
    x, y = spots[:, 0] - gaps[:, :1], spots[:, 1] - gaps[:, 1:2]
    place, beside = along_x * x + along_y * y, np.abs(along_x * y - along_y * x)
    aside = np.abs(along_x * spots[:, 2] + along_y * spots[:, 3]) >= dmath.sin(config.aside_deg * DEGREE)
    ends = aside & (beside <= config.beside_m) & (place > margin_m) & (place < length)
    return np.where(ends, place, np.inf)


def _behind(gaps: Floats, seen_from: Floats, spots: Floats) -> Bools:
    """Which spots (s, 4) were heard from behind the lines of gaps (g, 4), not from where these were seen: (g, s)."""
    gx, gy = gaps[:, 2:3] - gaps[:, :1], gaps[:, 3:] - gaps[:, 1:2]
    side = gx * (seen_from[:, 1:] - gaps[:, 1:2]) - gy * (seen_from[:, :1] - gaps[:, :1])
    return np.asarray(side * (gx * spots[:, 3] - gy * spots[:, 2]) > 0.0)


def _in_line(walls: Pieces, spots: Spots, config: EndConfig) -> Bools:
    """Which spots (s,) lie near the line of each wall (w,) and were heard from aside: (w, s)."""
    nx, ny = walls.normal[:, :1], walls.normal[:, 1:]
    beside = np.abs(nx * spots.point[:, 0] + ny * spots.point[:, 1] - walls.line[:, 1:]) <= config.beside_m
    aside = nx * spots.normal[:, 0] + ny * spots.normal[:, 1] <= dmath.sincos(config.aside_deg * DEGREE)[1]
    return np.asarray(beside & aside)


def _rooms(some: Pieces, walls: Pieces, rows: Ints) -> tuple[Floats, Floats, tuple[Floats, Floats], Floats]:
    """Extent of some of the walls along themselves, and how far it is on either side to the next piece of its chain."""
    starts, stops = extents(walls, some)
    at = np.arange(len(rows))
    low, high = starts[at, rows][:, None], stops[at, rows][:, None]
    others = some.chain[:, None] == walls.chain
    far = np.where(others, stops, -np.inf).max(axis=1, initial=-np.inf)
    length = far - np.where(others, starts, np.inf).min(axis=1, initial=np.inf)
    others[at, rows] = False
    below = np.where(others & (starts < low), low - stops, np.inf).min(axis=1, initial=np.inf)
    above = np.where(others & (stops > high), starts - high, np.inf).min(axis=1, initial=np.inf)
    return low, high, (below[:, None], above[:, None]), length[:, None]


def heard_through(gaps: Floats, paths: Floats, margin_m: float = 0.15) -> Bools:
    """Which of the gaps (g, 4) one of the ways of sound (p, 4), from a station to what answered, goes through.

    Not near their ends, and not near its own.
    """
    if not (len(gaps) and len(paths)):
        return np.zeros(len(gaps), dtype=bool)
    dx, dy = gaps[:, 2:3] - gaps[:, :1], gaps[:, 3:] - gaps[:, 1:2]
    place = heard_through_at(gaps, paths, margin_m, margin_m)
    return np.asarray((place < np.sqrt(dx * dx + dy * dy) - margin_m).any(axis=1))


def heard_through_at(gaps: Floats, paths: Floats, margin_m: float, short_m: float = 0.15) -> Floats:
    """How far along each gap (g, 4) each way of sound (p, 4) goes through it: (g, p) m, infinite where it does not.

    Not so near the gap's beginning as the margin, nor so near the way's end: what answered may be the wall itself.
    """
    gx, gy = gaps[:, 2:3] - gaps[:, :1], gaps[:, 3:] - gaps[:, 1:2]
    px, py = paths[:, 2] - paths[:, 0], paths[:, 3] - paths[:, 1]
    x, y = paths[:, 0] - gaps[:, :1], paths[:, 1] - gaps[:, 1:2]
    across = gx * py - gy * px
    length, way = (np.maximum(np.sqrt(a * a + b * b), 1e-9) for a, b in ((gx, gy), (px, py)))
    steep = np.abs(across) > STEEP * length * way
    safe = np.where(steep, across, 1.0)
    place, part = (x * py - y * px) / safe * length, (x * gy - y * gx) / safe * way
    through = steep & (place > margin_m) & (place < length) & (part > 0.0) & (part < way - short_m)
    return np.where(through, place, np.inf)
