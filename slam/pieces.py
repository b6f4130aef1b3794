"""All pieces of walls as arrays: where each lies now, of which sweep and chain it is, what it is known to be.

Must not know: the grid, what was drawn.
"""

from dataclasses import dataclass
from itertools import compress
from operator import is_not
from typing import TypeVar

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, WALL, Member
from slam.dmath import Floats
from slam.geometry import Pose
from slam.sweep import Ints

Rows = TypeVar("Rows", Ints, Floats)

SURE = 4
"""What fewer sweeps took for a wall may still be none."""


@dataclass(frozen=True)
class Pieces:
    """m pieces in order of their sweeps, and of one sweep in the order of its features; metres and rad in the map.

    `chain`, `sweep`, `told` (m,): the nature that the piece itself tells, `nature` what its chain tells. `line` (m, 2):
    α and ρ, `normal` (m, 2) = (cos α, sin α), `ends` (m, 4).
    """

    chain: Ints
    sweep: Ints
    told: Ints
    nature: Ints
    line: Floats
    normal: Floats
    ends: Floats

    @classmethod
    def none(cls) -> "Pieces":
        """No piece."""
        whole, pair = np.zeros(0, dtype=np.int64), np.zeros((0, 2))
        return cls(whole, whole, whole, whole, pair, pair, np.zeros((0, 4)))

    def at(self, rows: Ints | slice) -> "Pieces":
        """Some of them."""
        return Pieces(
            chain=self.chain[rows],
            sweep=self.sweep[rows],
            told=self.told[rows],
            nature=self.nature[rows],
            line=self.line[rows],
            normal=self.normal[rows],
            ends=self.ends[rows],
        )

    def of_sweep(self, sweep: int) -> slice:
        """Where the pieces of a sweep are."""
        begin, end = np.searchsorted(self.sweep, [sweep, sweep + 1]).tolist()
        return slice(begin, end)

    def of_sweeps(self, sweeps: Ints) -> Ints:
        """The numbers of the pieces of some sweeps, given in order."""
        begin, end = np.searchsorted(self.sweep, sweeps), np.searchsorted(self.sweep, sweeps + 1)
        count = end - begin
        first = np.repeat(begin - np.cumsum(count) + count, count)
        return np.asarray(first + np.arange(len(first)))

    def renewed(self, had: tuple[Member, ...], members: tuple[Member, ...]) -> "Pieces":
        """As members are now, who were these when they were `had`: only what is another object is read.

        What one member of a chain tells of its nature holds for all: a point never joins a chain of walls. But a wall
        is known as one only when it was seen so often.
        """
        changed = not_the_same(had, members)
        news = [members[k] for k in changed]
        count = len(members)
        whole = np.array([(m.chain, m.sweep, m.nature) for m in news], dtype=np.int64).reshape(-1, 3)
        lines = np.array([(m.segment.alpha, m.segment.rho) for m in news]).reshape(-1, 2)
        sine, cosine = dmath.sincos(lines[:, 0])
        ends = np.array([(*m.segment.start, *m.segment.end) for m in news]).reshape(-1, 4)
        chain, told = _put(self.chain, changed, whole[:, 0], count), _put(self.told, changed, whole[:, 2], count)
        known = np.full(int(chain.max(initial=0)) + 1, OPEN)
        tells = np.flatnonzero(told != OPEN)
        known[chain[tells]] = told[tells]
        known[(known == WALL) & (np.bincount(chain, minlength=len(known)) < SURE)] = OPEN
        return Pieces(
            chain=chain,
            sweep=_put(self.sweep, changed, whole[:, 1], count),
            told=told,
            nature=np.where(told == POINT, told, known[chain]),
            line=_put(self.line, changed, lines, count),
            normal=_put(self.normal, changed, np.stack([cosine, sine], axis=1), count),
            ends=_put(self.ends, changed, ends, count),
        )


def not_the_same(had: tuple[object, ...], now: tuple[object, ...]) -> list[int]:
    """The numbers of those that are other objects than before, or new."""
    both = min(len(had), len(now))
    return [*compress(range(both), map(is_not, had, now)), *range(both, len(now))]


def places_of(before: Floats, had: tuple[Pose, ...], poses: tuple[Pose, ...]) -> Floats:
    """Poses as rows (n, 3), `before` being those that there were: only what is another object is read."""
    changed = not_the_same(had, poses)
    news = np.array([(p.x, p.y, p.theta) for p in (poses[k] for k in changed)])
    return _put(before, changed, news.reshape(-1, 3), len(poses))


def _put(old: Rows, where: list[int], new: Rows, count: int) -> Rows:
    rows = np.empty((count, *old.shape[1:]), dtype=old.dtype)
    kept = min(count, len(old))
    rows[:kept] = old[:kept]
    rows[where] = new
    return rows
