"""Cells of two maps by what became of them: unknown, free, occupied; as the maps lie, and laid on one another.

Must not know: runs, walls, how the maps were aligned.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.geometry import ORIGIN, Pose
from slam.grid import Grid
from sonarlog.diff.alignment import inverse

UNKNOWN, FREE, OCCUPIED = 0, 1, 2
STATES = ("unknown", "free", "occupied")
States = NDArray[np.int8]


@dataclass(frozen=True)
class CellChanges:
    """Cells by state in A and in B: `table[a][b]` in the order unknown, free, occupied; unknown in both is not counted.

    `changed` is the share of the cells known to either run whose state differs.
    """

    table: tuple[tuple[int, int, int], ...]
    changed: float

    @property
    def cells(self) -> int:
        """How many cells changed."""
        return sum(count for i, row in enumerate(self.table) for j, count in enumerate(row) if i != j)

    def mirrored(self) -> "CellChanges":
        """From B to A."""
        return CellChanges(tuple((row[0], row[1], row[2]) for row in zip(*self.table, strict=True)), self.changed)


@dataclass(frozen=True)
class Window:
    """The states (h, w) of A's cells and of B's in one rectangle, row = y, from cell (`left`, `bottom`) of A's map."""

    left: int
    bottom: int
    cell_m: float
    a: States
    b: States


def cell_changes(a: Grid, b: Grid, pose: Pose = ORIGIN) -> CellChanges:
    """What became of each cell from A to B, where `pose` lays B's map on A's; the cells have one size."""
    window = together(a, b, pose)
    pairs = 3 * window.a.astype(np.int64) + window.b
    counts = np.bincount(pairs.reshape(-1), minlength=9).reshape(3, 3)
    counts[0, 0] = 0
    known = int(counts.sum())
    rows = [(int(row[0]), int(row[1]), int(row[2])) for row in counts]
    return CellChanges(tuple(rows), float(known - np.trace(counts)) / known if known else 0.0)


def together(a: Grid, b: Grid, pose: Pose = ORIGIN) -> Window:
    """Both maps' states in the rectangle of A's cells that holds both, each cell of A with the cell of B on it."""
    boxes = [box for box in (_box(a, ORIGIN), _box(b, pose)) if box is not None]
    left, bottom = (min((box[k] for box in boxes), default=0) for k in (0, 1))
    right, top = (max((box[k] for box in boxes), default=0) for k in (2, 3))
    mine = states(a, left, bottom, right - left, top - bottom)
    if pose == ORIGIN:
        return Window(left, bottom, a.cell_m, mine, states(b, left, bottom, right - left, top - bottom))
    return Window(left, bottom, a.cell_m, mine, _resampled(b, pose, left, bottom, mine.shape))


def states(grid: Grid, left: int, bottom: int, width: int, height: int) -> States:
    """The states (height, width) of a rectangle of cells."""
    cells = grid.window(left, bottom, width, height)
    return np.where(grid.occupied(cells), OCCUPIED, np.where(grid.free(cells), FREE, UNKNOWN)).astype(np.int8)


def _box(grid: Grid, pose: Pose) -> tuple[int, int, int, int] | None:
    """Left, bottom, right, top in cells of the grid's tiles, as the pose lays them; None for an empty map."""
    left, bottom, width, height = grid.bounds()
    if not width:
        return None
    if pose == ORIGIN:
        return left, bottom, left + width, bottom + height
    corners = np.array([(x, y) for x in (left, left + width) for y in (bottom, bottom + height)], dtype=np.float64)
    moved = pose.points(corners * grid.cell_m) / grid.cell_m
    (x0, y0), (x1, y1) = np.floor(moved.min(axis=0)).tolist(), np.ceil(moved.max(axis=0)).tolist()
    return int(x0), int(y0), int(x1), int(y1)


def _resampled(grid: Grid, pose: Pose, left: int, bottom: int, shape: tuple[int, ...]) -> States:
    """The states of the grid's cells under the centres of a rectangle of cells of the frame that `pose` is given in."""
    rows, columns = np.indices(shape)
    centres = np.column_stack([(columns.reshape(-1) + left + 0.5), (rows.reshape(-1) + bottom + 0.5)]) * grid.cell_m
    # The grain keeps what lies on the border of two cells from falling to either side by rounding alone.
    at = np.floor(np.round(inverse(pose).points(centres) / grid.cell_m, 6)).astype(np.int64)
    x0, y0, width, height = grid.bounds()
    inside = (at[:, 0] >= x0) & (at[:, 0] < x0 + width) & (at[:, 1] >= y0) & (at[:, 1] < y0 + height)
    found = np.zeros(len(at), dtype=np.int8)
    found[inside] = states(grid, x0, y0, width, height)[at[inside, 1] - y0, at[inside, 0] - x0]
    return found.reshape(shape)
