"""Frontier regions: where free cells meet the unknown, cut into pieces of a metre.

Must not know: ways, what was decided before.
"""

from dataclasses import dataclass

import numpy as np

from slam.boards import as_bytes, board, stride_of, within
from slam.components import labelled_runs
from slam.geometry import Bools
from slam.grid import Grid
from slam.sweep import Ints
from slam.window import Window


@dataclass(frozen=True)
class Ranks:
    """Cells of a grid as boards of `stride` bits a row: occupied, unknown, and open ones, to which chinks belong."""

    open: int
    occupied: int
    unknown: int
    stride: int
    shape: tuple[int, int]
    left: int
    bottom: int
    cell_m: float
    everywhere: int

    def array(self, mask: int) -> Bools:
        """A board as cells (h, stride); those of spare columns mean nothing."""
        data = np.frombuffer(as_bytes(mask, self.stride, self.shape[0]), dtype=np.bool_)
        return data.reshape(self.shape[0], self.stride)

    def board(self, cells: Bools) -> int:
        """Cells (h, stride) as a board."""
        return board(cells, self.stride)


@dataclass(frozen=True)
class Pieces:
    """Pieces of frontier, largest first: cells of each, and its middle cell (row, column)."""

    sizes: Ints
    rows: Ints
    columns: Ints


def ranks_of(grid: Grid, chink: int, spare: int, window: Window | None = None) -> Ranks | None:
    """The grid's cells, or those in the window; a chink is unknown, but nowhere wider than 2 · `chink` cells.

    None: there is no cell.
    """
    left, bottom, width, height = grid.bounds()
    if window is not None:
        right, top = min(left + width, window.right), min(bottom + height, window.top)
        left, bottom = max(left, window.left), max(bottom, window.bottom)
        width, height = right - left, top - bottom
    if width <= 0 or height <= 0:
        return None
    log_odds = grid.window(left, bottom, width, height)
    stride = stride_of(width, max(spare, chink) + 1)
    free, occupied = board(grid.free(log_odds), stride), board(grid.occupied(log_odds), stride)
    everywhere = board(np.ones((height, width), dtype=np.bool_), stride)
    core = everywhere & ~within(free | occupied, stride, chink)
    unknown = within(core, stride, chink) & everywhere
    is_open = everywhere & ~unknown & ~occupied
    return Ranks(is_open, occupied, unknown, stride, (height, width), left, bottom, grid.cell_m, everywhere)


def frontier_of(ranks: Ranks) -> int:
    """Open cells beside unknown ones, as a board."""
    unknown, stride = ranks.unknown, ranks.stride
    return ranks.open & ((unknown << 1) | (unknown >> 1) | (unknown << stride) | (unknown >> stride))


def pieces_of(frontier: int, ranks: Ranks, smallest: int, piece: int) -> Pieces:
    """The 8-connected clusters of the frontier, cut along lines `piece` cells apart; those of so many cells or more."""
    begins, ends, numbers = labelled_runs(frontier, ranks.stride)
    lengths = ends - begins
    run = np.repeat(ends - np.cumsum(lengths), lengths)
    places = run + np.arange(len(run))
    rows, columns = np.divmod(places, ranks.stride)
    # Lines of the grid, not of the board, which begins elsewhere as the grid grows.
    tiles = (rows + ranks.bottom) // piece * (1 << 20) + (columns + ranks.left) // piece
    order = np.lexsort((tiles, np.repeat(numbers, lengths)))
    rows, columns, tiles, labels = rows[order], columns[order], tiles[order], np.repeat(numbers, lengths)[order]
    new = np.concatenate([np.ones(min(1, len(rows)), dtype=bool), (np.diff(tiles) != 0) | (np.diff(labels) != 0)])
    cluster = np.cumsum(new) - 1
    sizes = np.bincount(cluster)
    # Sums of integers: as floats they are exact.
    middle_row, middle_column = (np.bincount(cluster, weights=values) / sizes for values in (rows, columns))
    dr, dc = rows - middle_row[cluster], columns - middle_column[cluster]
    nearest = np.lexsort((dr * dr + dc * dc, cluster))[np.cumsum(sizes) - sizes]
    large = np.flatnonzero(sizes >= smallest)
    large = large[np.lexsort((large, -sizes[large]))]
    rows, columns = rows[nearest[large]], columns[nearest[large]]
    return Pieces(sizes[large], rows, columns)
