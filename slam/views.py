"""Views: what a scan from a place would show, going by what has been looked at already and is still unknown.

A look from near tells more of a cell than one from afar, and what many looks did not show the next one hardly will.
Must not know: ways, regions, what is chosen.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from slam import dmath
from slam.dmath import PI, Floats
from slam.geometry import Bools
from slam.regions import Ranks
from slam.sweep import Ints

RAYS, STEPS, STEP_M = 32, 15, 0.10
BLOCK = 4
"""Cells a side of the blocks that looks are counted for."""

NEAR_M, FAR_M = 0.6, 1.0
"""A look from so near tells as much as three, one from so far as two, one from further as one."""

SCALE = 1024
LEFT = tuple(int(SCALE * part) for part in np.cumprod([1.0] + [0.8] * 24).tolist())
"""How much of a cell's unknown is left after so many looks, of SCALE."""


@dataclass(frozen=True)
class Views:
    """Places (n,) as rows and columns, and the m² that a scan there would show."""

    rows: Ints
    columns: Ints
    gains: Floats


def views_of(ranks: Ranks, reached: Bools, frontier: tuple[Ints, Ints], stations: Floats, apart_m: float) -> Views:
    """Places that are `reached`, a scan from which might show what is behind the frontier (rows, columns).

    `stations` (k, 2) in metres are where the robot has scanned; the places keep `apart_m` off these, and stand nearly
    as far from one another.
    """
    rows, columns = _lattice(ranks, reached, max(1, int(0.9 * apart_m / ranks.cell_m)))
    y, x = (rows + ranks.bottom + 0.5) * ranks.cell_m, (columns + ranks.left + 0.5) * ranks.cell_m
    dy, dx = y[:, None] - stations[:, 1], x[:, None] - stations[:, 0]
    away = (dx * dx + dy * dy >= apart_m * apart_m).all(axis=1)
    rows, columns = rows[away], columns[away]
    dr, dc = rows[:, None] - frontier[0], columns[:, None] - frontier[1]
    reach = int(STEPS * STEP_M / ranks.cell_m * 0.8)
    near = (dr * dr + dc * dc <= reach * reach).any(axis=1)
    rows, columns = rows[near], columns[near]
    return Views(rows, columns, _gains(rows, columns, ranks, stations))


def _lattice(ranks: Ranks, reached: Bools, step: int) -> tuple[Ints, Ints]:
    """Rows and columns; on lines of the grid, not of the board, which begins elsewhere as the grid grows."""
    rows = np.arange(-ranks.bottom % step, ranks.shape[0], step)
    columns = np.arange(-ranks.left % step, ranks.shape[1], step)
    there = reached[rows[:, None], columns]
    r, c = np.nonzero(there)
    return rows[r], columns[c]


def _left(ranks: Ranks, stations: Floats, edge: int) -> Ints:
    """How much of each cell's unknown is left, of SCALE; nothing of cells that are known.

    (h + 2 · edge, w + 2 · edge): so many blocks' cells beyond the grid, too, for what was looked at there is unknown.
    """
    height, width = (-(-side // BLOCK) + 2 * edge // BLOCK for side in ranks.shape)
    y = ((np.arange(height) + 0.5) * BLOCK + (ranks.bottom - edge)) * ranks.cell_m
    x = ((np.arange(width) + 0.5) * BLOCK + (ranks.left - edge)) * ranks.cell_m
    dy, dx = y[:, None] - stations[:, 1], x[:, None] - stations[:, 0]
    square = (dy * dy)[:, None, :] + (dx * dx)[None, :, :]
    near, middle, far = (np.count_nonzero(square < m * m, axis=2) for m in (NEAR_M, FAR_M, STEPS * STEP_M))
    looks = near + middle + far
    left = np.array(LEFT, dtype=np.int64)[np.minimum(looks, len(LEFT) - 1)]
    unknown = _edged(ranks.unknown, ranks, edge, beyond=True)
    cells = np.repeat(np.repeat(left, BLOCK, axis=0), BLOCK, axis=1)[: unknown.shape[0], : unknown.shape[1]]
    return np.asarray(np.where(unknown, cells, 0))


def _gains(rows: Ints, columns: Ints, ranks: Ranks, stations: Floats) -> Floats:
    """m² of unknown that each place would show, nothing occupied between."""
    dr, dc, area = _rays(ranks.cell_m)
    edge = -(-int(np.abs(dr).max()) // BLOCK) * BLOCK  # so far the rays go
    r, c = rows[:, None, None] + (dr + edge), columns[:, None, None] + (dc + edge)
    clear = ~np.logical_or.accumulate(_edged(ranks.occupied, ranks, edge, beyond=False)[r, c], axis=2)
    worth = _left(ranks, stations, edge)[r, c] * area * clear
    total = np.cumsum(worth.reshape(len(rows), RAYS * STEPS), axis=1)[:, -1] if len(rows) else np.zeros(0)
    return np.asarray(total * (STEP_M * STEP_M * 2.0 * PI / RAYS / SCALE / 3.0))


def _edged(mask: int, ranks: Ranks, edge: int, *, beyond: bool) -> Bools:
    """A board as cells, with an edge about it."""
    height, width = ranks.shape
    cells = np.full((height + 2 * edge, width + 2 * edge), beyond)
    cells[edge : edge + height, edge : edge + width] = ranks.array(mask)[:, :width]
    return cells


@cache
def _rays(cell_m: float) -> tuple[Ints, Ints, Ints]:
    """Rows and columns (RAYS, STEPS) of the rays' cells about a cell, and three times their area's share (STEPS,)."""
    angles: Floats = (np.arange(RAYS).astype(np.float64) + 0.5) * (2.0 * PI / RAYS)
    sine, cosine = dmath.sincos(angles)
    reach = (np.arange(STEPS) + 1.0) * STEP_M
    rows, columns = (np.rint(part[:, None] * (reach / cell_m)).astype(np.int64) for part in (sine, cosine))
    told = np.where(reach < NEAR_M, 3, np.where(reach < FAR_M, 2, 1))
    return rows, columns, np.arange(1, STEPS + 1) * told
