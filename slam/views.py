"""Views: what a scan from a place would show, going by what has been looked at already and is still unknown.

A look from near tells more of a cell than one from afar, and what many looks did not show the next one hardly will.
Where walls are seen squarely the robot will know better where it is.
Must not know: ways, regions, what is chosen.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from slam import dmath
from slam.boards import within
from slam.dmath import PI, Floats
from slam.geometry import Bools
from slam.regions import Ranks
from slam.sweep import Ints

RAYS, STEPS, STEP_M = 32, 15, 0.10
BLOCK = 4
"""Cells a side of the blocks that looks are counted for."""

NEAR_M, FAR_M = 0.6, 1.0
"""A look from so near tells as much as three, one from so far as two, one from further as one; as to what it cannot
tell, two from so near count, one from so far, and none from further: there, much that is open gives no echo."""

ASIDE = 3
"""So many rays beside the foot of a perpendicular, 34°, a wall is farther by a fifth."""

BESIDE_M, PART = 0.28, 3
"""So near to what is occupied there is no way on for the robot: what is seen past it is worth a part."""

ON_STEPS = 5
"""So many steps farther what is unknown is taken to go on where the robot itself could: a door leads somewhere."""

SCALE = 1024
LEFT = tuple(int(SCALE * part) for part in np.cumprod([1.0] + [0.8] * 24).tolist())
"""How much of a cell's unknown is left after so many looks, of SCALE."""


@dataclass(frozen=True)
class Views:
    """Places (n,) as rows and columns, the m² that a scan there would show, and how many ways it sees walls squarely.

    `away`: metres to the nearest scan.
    `square`: 0, no wall's foot is in sight: nothing there says where the robot is; 1, those of parallel ones; 2, of
    others too.
    """

    rows: Ints
    columns: Ints
    gains: Floats
    square: Ints
    away: Floats


def lattice(ranks: Ranks, reached: Bools, apart_m: float) -> tuple[Ints, Ints]:
    """Rows and columns of places nearly so far apart.

    On lines of the grid, not of the board, which begins elsewhere as the grid grows.
    """
    step = max(1, int(0.9 * apart_m / ranks.cell_m))
    rows = np.arange(-ranks.bottom % step, ranks.shape[0], step)
    columns = np.arange(-ranks.left % step, ranks.shape[1], step)
    r, c = np.nonzero(reached[rows[:, None], columns])
    return rows[r], columns[c]


def views_of(
    ranks: Ranks, places: tuple[Ints, Ints], frontier: tuple[Ints, Ints], stations: Floats, apart_m: float
) -> Views:
    """Those of the places (rows, columns) a scan from which might show what is behind the frontier (rows, columns).

    `stations` (k, 2) in metres are where the robot has scanned; the places keep `apart_m` off these.
    """
    rows, columns = places
    dr, dc = rows[:, None] - frontier[0], columns[:, None] - frontier[1]
    reach = int(STEPS * STEP_M / ranks.cell_m * 0.8)
    near = (dr * dr + dc * dc <= reach * reach).any(axis=1)
    rows, columns = rows[near], columns[near]
    y: Floats = (rows.astype(np.float64) + (ranks.bottom + 0.5)) * ranks.cell_m
    x: Floats = (columns.astype(np.float64) + (ranks.left + 0.5)) * ranks.cell_m
    scanned = _about(stations, x, y)
    dy, dx = y[:, None] - scanned[:, 1], x[:, None] - scanned[:, 0]
    square = (dx * dx + dy * dy).min(axis=1, initial=4.0 * STEPS * STEPS * STEP_M * STEP_M)
    away = square >= apart_m * apart_m
    rows, columns = rows[away], columns[away]
    return _seen(rows, columns, np.sqrt(square[away]), ranks, scanned)


def _about(stations: Floats, x: Floats, y: Floats) -> Floats:
    """The stations that may have looked at what is seen from there."""
    if not len(x):
        return stations[:0]
    far = 2.0 * STEPS * STEP_M
    sx, sy = stations[:, 0], stations[:, 1]
    near = (sx > x.min() - far) & (sx < x.max() + far) & (sy > y.min() - far) & (sy < y.max() + far)
    return np.asarray(stations[near])


def _seen(rows: Ints, columns: Ints, away: Floats, ranks: Ranks, stations: Floats) -> Views:
    """What each place would show, nothing occupied between."""
    if not len(rows):
        return Views(rows, columns, np.zeros(0), rows, away)
    dr, dc, area = _rays(ranks.cell_m)
    reach = int(STEPS * STEP_M / ranks.cell_m) + 1
    bottom, left = int(rows.min()) - reach, int(columns.min()) - reach
    shape = int(rows.max()) + reach + 1 - bottom, int(columns.max()) + reach + 1 - left
    unknown = _window(ranks, ranks.unknown, bottom, left, shape, beyond=True)
    solid = _window(ranks, ranks.occupied, bottom, left, shape, beyond=False)
    worth = np.where(unknown, _left(ranks, stations, bottom, left, shape), 0)
    beside = within(ranks.occupied, ranks.stride, int(BESIDE_M / ranks.cell_m + 0.5)) & ranks.everywhere
    tight = _window(ranks, beside, bottom, left, shape, beyond=False)
    cells = ((rows - bottom)[:, None, None] + dr) * shape[1] + ((columns - left)[:, None, None] + dc)
    clear = ~np.logical_or.accumulate(solid.reshape(-1)[cells], axis=2)
    through = np.where(np.logical_or.accumulate(tight.reshape(-1)[cells], axis=2), 1, PART)
    hidden = worth.reshape(-1)[cells]
    shown = (hidden * area * clear * through).reshape(len(rows), RAYS * STEPS)
    on = np.where(clear[:, :, -1] & (through[:, :, -1] == PART), hidden[:, :, -1] * PART, 0)
    # The steps beyond have areas like 16, 17 … of those before.
    shown = np.concatenate([shown, on * (ON_STEPS * (2 * STEPS + ON_STEPS + 1) // 2)], axis=1)
    gains = np.asarray(np.cumsum(shown, axis=1)[:, -1] * (STEP_M * STEP_M * 2.0 * PI / RAYS / SCALE / 3.0 / PART))
    return Views(rows, columns, gains, _square(np.count_nonzero(clear, axis=2)), away)


def _window(ranks: Ranks, mask: int, bottom: int, left: int, shape: tuple[int, int], *, beyond: bool) -> Bools:
    """Cells (h, w) of a board from (bottom, left) on, which may lie beyond the grid."""
    window = np.full(shape, beyond)
    low, far = max(bottom, 0), max(left, 0)
    top, right = min(bottom + shape[0], ranks.shape[0]), min(left + shape[1], ranks.shape[1])
    window[low - bottom : top - bottom, far - left : right - left] = ranks.array(mask)[low:top, far:right]
    return window


def _left(ranks: Ranks, stations: Floats, bottom: int, left: int, shape: tuple[int, ...]) -> Ints:
    """How much of each cell's unknown is left, of SCALE, in a window (h, w) of the cells."""
    low, far = (bottom + ranks.bottom) // BLOCK, (left + ranks.left) // BLOCK
    height = (bottom + ranks.bottom + shape[0] - 1) // BLOCK - low + 1
    width = (left + ranks.left + shape[1] - 1) // BLOCK - far + 1
    y = ((np.arange(height) + (low + 0.5)) * BLOCK) * ranks.cell_m
    x = ((np.arange(width) + (far + 0.5)) * BLOCK) * ranks.cell_m
    dy, dx = y[:, None] - stations[:, 1], x[:, None] - stations[:, 0]
    square = (dy * dy)[:, None, :] + (dx * dx)[None, :, :]
    near, middle = (np.count_nonzero(square < m * m, axis=2) for m in (NEAR_M, FAR_M))
    left_over = np.array(LEFT, dtype=np.int64)[np.minimum(near + middle, len(LEFT) - 1)]
    cells = np.repeat(np.repeat(left_over, BLOCK, axis=0), BLOCK, axis=1)
    row, column = bottom + ranks.bottom - low * BLOCK, left + ranks.left - far * BLOCK
    return np.asarray(cells[row : row + shape[0], column : column + shape[1]])


def _square(clear: Ints) -> Ints:
    """From how many ways walls are seen squarely, by how many steps each ray (n, RAYS) goes until it meets one.

    The foot of a perpendicular is where rays are shortest; to both sides they are longer, if only a little at first.
    """
    feet = clear < STEPS
    for side in (-1, 1):
        for beside in range(1, ASIDE):
            feet &= clear <= np.roll(clear, side * beside, axis=1)
        feet &= clear < np.roll(clear, side * ASIDE, axis=1)
    ways = feet[:, : RAYS // 2] | feet[:, RAYS // 2 :]
    across = np.zeros_like(ways)
    for turn in range(RAYS // 8, 3 * RAYS // 8 + 1):  # by 45° to 135°
        across |= ways & np.roll(ways, turn, axis=1)
    return np.asarray(ways.any(axis=1).astype(np.int64) + across.any(axis=1))


@cache
def _rays(cell_m: float) -> tuple[Ints, Ints, Ints]:
    """Rows and columns (RAYS, STEPS) of the rays' cells about a cell, and three times their area's share (STEPS,)."""
    angles: Floats = (np.arange(RAYS).astype(np.float64) + 0.5) * (2.0 * PI / RAYS)
    sine, cosine = dmath.sincos(angles)
    reach = (np.arange(STEPS) + 1.0) * STEP_M
    rows, columns = (np.rint(part[:, None] * (reach / cell_m)).astype(np.int64) for part in (sine, cosine))
    told = np.where(reach < NEAR_M, 3, np.where(reach < FAR_M, 2, 1))
    return rows, columns, np.arange(1, STEPS + 1) * told
