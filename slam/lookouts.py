"""Lookouts: from where to look at each piece of frontier.

A scan shows most from a place with room about it: there the walls on all sides answer. Must not know: what is chosen.
"""

from dataclasses import dataclass

import numpy as np

from slam.boards import as_bytes, within
from slam.dmath import Floats
from slam.geometry import Bools
from slam.planning import Cell, Ground
from slam.regions import Pieces
from slam.sweep import Ints


@dataclass(frozen=True)
class Places:
    """Where looking was no use, or was done: points (k, 2) m, and how near to them it need not be done again."""

    points: Floats
    radius_m: float


def lookouts(pieces: Pieces, ground: Ground, start: Cell, view_m: float, done: Places) -> list[Cell | None]:
    """For each piece the reachable cell nearest to its middle, within `view_m` and not near a place that is done.

    If there is one, it is a cell that is not tight.
    """
    r, c, places, there = _within(pieces, ground, start, view_m)
    array = _array(ground, _discs(ground, done))
    there &= ~array[places]
    roomy = there & ~_array(ground, ground.tight)[places]
    first = np.where(roomy.any(axis=1), np.argmax(roomy, axis=1), np.argmax(there, axis=1))
    return _chosen(r, c, there, first)


def nearest(pieces: Pieces, ground: Ground, start: Cell, view_m: float, done: Places) -> list[Cell | None]:
    """For each piece the reachable cell nearest to its middle, within `view_m`; None if that is near a place done."""
    r, c, places, there = _within(pieces, ground, start, view_m)
    first = np.argmax(there, axis=1)
    near = _array(ground, _discs(ground, done))[places]
    return _chosen(r, c, there & ~near, first)


def _within(pieces: Pieces, ground: Ground, start: Cell, view_m: float) -> tuple[Ints, Ints, Ints, Bools]:
    dr, dc = _around(int(view_m / ground.cell_m))
    r, c = pieces.rows[:, None] + dr, pieces.columns[:, None] + dc
    inside = (r >= 0) & (r < ground.shape[0]) & (c >= 0) & (c < ground.shape[1])
    places = np.where(inside, r * ground.stride + c, 0)
    return r, c, places, ground.reachable(start, places.reshape(-1)).reshape(places.shape) & inside


def _chosen(r: Ints, c: Ints, there: Bools, first: Ints) -> list[Cell | None]:
    return [(int(r[k, i]), int(c[k, i])) if bool(there[k, i]) else None for k, i in enumerate(first.tolist())]


def _array(ground: Ground, board: int) -> Bools:
    return np.frombuffer(as_bytes(board, ground.stride, ground.shape[0]), dtype=np.bool_)


def _discs(ground: Ground, done: Places) -> int:
    board = 0
    for x, y in done.points.tolist():
        row, column = ground.cell(x, y)
        board |= 1 << (row * ground.stride + column)
    grown = within(board, ground.stride, int(done.radius_m / ground.cell_m))
    return grown & ((1 << ground.shape[0] * ground.stride) - 1)


def _around(radius: int) -> tuple[Ints, Ints]:
    """Steps (n,) to the cells within a radius, nearest first."""
    side = np.arange(-radius, radius + 1)
    dr, dc = np.repeat(side, len(side)), np.tile(side, len(side))
    square = dr * dr + dc * dc
    order = np.lexsort((dc, dr, square))
    order = order[square[order] <= radius * radius]
    return dr[order], dc[order]
