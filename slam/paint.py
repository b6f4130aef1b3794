"""Painting segments onto cells: the canvas of one sweep's map extension."""

import numpy as np

from slam.dmath import Floats
from slam.grid import Cells
from slam.sweep import Ints


class Canvas:
    """A rectangle of cells around what will be painted: free and occupied evidence."""

    def __init__(self, left: int, bottom: int, width: int, height: int, cell_m: float) -> None:
        """So many cells from column `left` and row `bottom` of the grid on."""
        self.cell_m = cell_m
        self.left, self.bottom, self.width, self.height = left, bottom, width, height
        self.free: Cells = np.zeros((height, width), dtype=np.int16)
        self.occupied: Cells = np.zeros((height, width), dtype=np.int16)

    def mark(self, ends: Floats, weights: Ints) -> None:
        """Occupied evidence along segments (n, 4); the strongest weight of a cell counts."""
        cells, number = self.along(ends, 0.25)
        np.maximum.at(self.occupied.reshape(-1), cells, weights[number].astype(np.int16))

    def along(self, ends: Floats, step: float) -> tuple[Ints, Ints]:
        """The cells (k,) under segments (n, 4), looked at every so many cells, and the segments' numbers."""
        dx, dy = ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1]
        steps = (np.sqrt(dx * dx + dy * dy) / (step * self.cell_m)).astype(np.int64) + 1
        number = np.repeat(np.arange(len(ends)), steps + 1)
        place = np.arange(len(number)) - np.repeat(np.cumsum(steps + 1) - (steps + 1), steps + 1)
        part = place.astype(np.float64) / steps[number].astype(np.float64)
        rows, columns = self._cells(ends[number, 0] + part * dx[number], ends[number, 1] + part * dy[number])
        return rows * self.width + columns, number

    def _cells(self, x: Floats, y: Floats) -> tuple[Ints, Ints]:
        """Rows and columns of the cells that hold the points; of points outside, of the nearest cells."""
        columns = np.floor(x / self.cell_m).astype(np.int64) - self.left
        rows = np.floor(y / self.cell_m).astype(np.int64) - self.bottom
        return np.minimum(np.maximum(rows, 0), self.height - 1), np.minimum(np.maximum(columns, 0), self.width - 1)

    def evidence(self) -> Cells:
        """What to add to the map (height, width): where something stands nothing is free."""
        return np.where(self.occupied > 0, self.occupied, self.free)
