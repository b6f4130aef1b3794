"""Roads between scans: far off the robot finds its way from scan to scan, and need not search the whole map.

Must not know: the map, what is to be seen anywhere.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from heapq import heapify, heappop, heappush
from itertools import pairwise

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.geometry import Bools
from slam.planning import Ground
from slam.sweep import Ints

ROAD_M = 1.5
"""Scans so near to one another may be joined by a straight road; to so many of them, the nearest ones."""
ROADS = 3

STEP_M = 0.10
"""From point to point of a way along roads."""


@dataclass(frozen=True)
class Roads:
    """Pairs (m, 2) of scans: the robot has driven from one to the other, or nothing stands straight between them."""

    pairs: Ints = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))

    def joined(self, scans: Floats, ground: Ground) -> "Roads":
        """With the last of all scans (n, 2) m joined to the one before and to those near by."""
        last = len(scans) - 1
        if last < 1:
            return self
        away = dmath.hypot(scans[:-2, 0] - scans[-1, 0], scans[:-2, 1] - scans[-1, 1])
        near = np.flatnonzero(away < ROAD_M)
        near = near[np.argsort(away[near], kind="stable")[:ROADS]]
        straight = near[_passable(scans[last], scans[near], ground)]
        others = np.append(straight, np.int64(last - 1))
        return Roads(np.concatenate([self.pairs, np.stack([others, np.full(len(others), last)], axis=1)]))

    def without(self, scans: Floats, places: Floats, near_m: float) -> "Roads":
        """Those of the roads that lead past none of the places (k, 2) m nearer than that."""
        begin, end = (scans[self.pairs[:, k], :, None] for k in (0, 1))
        along = end - begin
        x, y = along[:, 0], along[:, 1]
        length = np.maximum(x * x + y * y, STEP_M * STEP_M)
        dx, dy = places[:, 0] - begin[:, 0], places[:, 1] - begin[:, 1]
        share = np.minimum(np.maximum((dx * x + dy * y) / length, 0.0), 1.0)
        dx, dy = dx - share * x, dy - share * y
        clear = dx * dx + dy * dy >= near_m * near_m
        return Roads(self.pairs[clear.all(axis=1)])


class Journeys:
    """The shortest ways along roads to all scans (n, 2) m from the nearest ones, which are so many `metres` away.

    They are found as far out as one has gone on. `metres` (n,): how far each scan is, ∞ where no way is known.
    """

    def __init__(self, roads: Roads, scans: Floats, near: Mapping[int, float]) -> None:
        self.metres = np.full(len(scans), np.inf)
        self._beside = _Beside(roads, scans)
        self._scans = scans
        self._before = {scan: scan for scan in near}
        self._queue = [(metres, scan, scan) for scan, metres in near.items()]
        heapify(self._queue)

    def go_on(self, within_m: float = np.inf) -> bool:
        """Find the ways to all scans that are no farther than that; False when there are no more."""
        queue, before = self._queue, self._before
        while queue and queue[0][0] <= within_m:
            metres, scan, comes_from = heappop(queue)
            if before.setdefault(scan, comes_from) == comes_from and metres < self.metres[scan]:
                self.metres[scan] = metres
                for other, length in self._beside.of(scan):
                    if other not in before:
                        heappush(queue, (metres + length, other, scan))
        return bool(queue)

    def road(self, scan: int) -> tuple[int, Floats]:
        """The one of the nearest scans that the way to a scan leads over, and its points (k, 2) m after that."""
        chain = [scan]
        while self._before[chain[-1]] != chain[-1]:
            chain.append(self._before[chain[-1]])
        corners = self._scans[chain[::-1]]
        points = [np.zeros((0, 2))]
        for begin, end in pairwise(corners):
            steps = max(1, int(dmath.hypot(end[0] - begin[0], end[1] - begin[1]) / STEP_M + 0.5))
            points.append(begin + (np.arange(1, steps + 1) / steps)[:, None] * (end - begin))
        return chain[-1], np.concatenate(points)


class _Beside:
    """By scan, those that roads lead to from there, and how far they are."""

    def __init__(self, roads: Roads, scans: Floats) -> None:
        begin, end = np.concatenate([roads.pairs, roads.pairs[:, ::-1]]).T
        order = np.argsort(begin, kind="stable")
        begin, end = begin[order], end[order]
        self._lengths = dmath.hypot(scans[begin, 0] - scans[end, 0], scans[begin, 1] - scans[end, 1]).tolist()
        self._ends = end.tolist()
        self._first = np.searchsorted(begin, np.arange(len(scans) + 1)).tolist()

    def of(self, scan: int) -> Iterator[tuple[int, float]]:
        """The scans beside that one, and the metres to them."""
        own = slice(self._first[scan], self._first[scan + 1])
        return zip(self._ends[own], self._lengths[own], strict=True)


def _passable(begin: Floats, ends: Floats, ground: Ground) -> Bools:
    """To which of the ends (k, 2) m the straight way leads over passable cells."""
    share = np.arange(1, int(ROAD_M / STEP_M) + 1) * (STEP_M / ROAD_M)
    points = begin + share[None, :, None] * (ends - begin)[:, None, :]
    return np.asarray(ground.passable_at(points).all(axis=1))
