"""Prospects: places from where a scan would show something, and those of them that were left behind on the way.

What is left behind is kept in the frame of the scan nearest to it, so that it goes with the map where loops close.
Must not know: the map, ways, what is chosen.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.geometry import Bools
from slam.sweep import Ints


@dataclass(frozen=True)
class Prospects:
    """Places (n, 2) m, each with the region (n, 2) m of so many frontier cells that it would show most of.

    The m² it would show, the ways it sees walls squarely (`views.Views`), and how far `away` the next scan is, metres.
    """

    places: Floats
    regions: Floats
    cells: Ints
    gains: Floats
    square: Ints
    away: Floats

    @staticmethod
    def none() -> "Prospects":
        """Nowhere."""
        points, numbers = np.zeros((0, 2)), np.zeros(0)
        whole = np.zeros(0, dtype=np.int64)
        return Prospects(points, points, whole, numbers, whole, numbers)

    def only(self, which: Bools | Ints) -> "Prospects":
        """Some of them."""
        return self._each(lambda values: values[which])

    def and_(self, others: "Prospects") -> "Prospects":
        """These, and then the others."""
        theirs = iter([getattr(others, each.name) for each in fields(others)])
        return self._each(lambda values: np.concatenate([values, next(theirs)]))

    def _each(self, change: Callable[[Floats], Floats]) -> "Prospects":
        changed: dict[str, Any] = {each.name: change(getattr(self, each.name)) for each in fields(self)}
        return Prospects(**changed)


@dataclass(frozen=True)
class Left:
    """Prospects (n,) that were left behind, each in the frame F of the scan of that number."""

    prospects: Prospects = field(default_factory=Prospects.none)
    scans: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def now(self, poses: Floats) -> Prospects:
        """Where they are in the map, by all scans' poses (k, 3) as known now."""
        return self._turned(poses, lambda points, at: _turned(points, at[:, 2]) + at[:, :2])

    def only(self, which: Bools) -> "Left":
        """Some of them."""
        return Left(self.prospects.only(which), self.scans[which])

    def and_(self, prospects: Prospects, poses: Floats) -> "Left":
        """With others, given in the map."""
        dx = prospects.places[:, :1] - poses[:, 0]
        dy = prospects.places[:, 1:] - poses[:, 1]
        found = Left(prospects, np.argmin(dx * dx + dy * dy, axis=1))
        mine = found._turned(poses, lambda points, at: _turned(points - at[:, :2], -at[:, 2]))
        return Left(self.prospects.and_(mine), np.concatenate([self.scans, found.scans]))

    def _turned(self, poses: Floats, change: Callable[[Floats, Floats], Floats]) -> Prospects:
        own, at = self.prospects, poses[self.scans]
        places, regions = change(own.places, at), change(own.regions, at)
        return Prospects(places, regions, own.cells, own.gains, own.square, own.away)


def _turned(points: Floats, angles: Floats) -> Floats:
    sine, cosine = dmath.sincos(angles)
    x, y = points[:, 0], points[:, 1]
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)
