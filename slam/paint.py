"""Painting convex areas and segments onto cells: the canvas of one sweep's map extension."""

import numpy as np

from slam.dmath import Floats
from slam.geometry import Bools
from slam.grid import Cells
from slam.sweep import Ints

Point = tuple[float, float]


class Canvas:
    """A rectangle of cells around what will be painted: free and occupied evidence, and hints too weak to be either."""

    def __init__(self, left: int, bottom: int, width: int, height: int, cell_m: float) -> None:
        """So many cells from column `left` and row `bottom` of the grid on."""
        self.cell_m = cell_m
        self.left, self.bottom, self.width, self.height = left, bottom, width, height
        self.free: Cells = np.zeros((height, width), dtype=np.int16)
        self.occupied: Cells = np.zeros((height, width), dtype=np.int16)
        self.hints: Cells = np.zeros((height, width), dtype=np.int16)

    @classmethod
    def around(cls, points: Floats, cell_m: float, margin_m: float) -> "Canvas":
        """Large enough for all points (n, 2) in metres and a margin."""
        low = np.floor((points.min(axis=0) - margin_m) / cell_m).astype(np.int64)
        high = np.floor((points.max(axis=0) + margin_m) / cell_m).astype(np.int64) + 1
        return cls(int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1]), cell_m)

    def clear(self, corners: list[Point], weight: int, solid: Bools | None = None) -> None:
        """Free evidence in a convex polygon given in order; one that is not convex is left alone.

        So is one in which something `solid` (height, width) stands.
        """
        turns = [_turn(corners[i - 2], corners[i - 1], corners[i]) for i in range(len(corners))]
        if not (all(t >= 0.0 for t in turns) or all(t <= 0.0 for t in turns)):
            return
        sign = 1.0 if any(t > 0.0 for t in turns) else -1.0
        xs, ys = [x for x, _ in corners], [y for _, y in corners]
        i0, i1 = self._column(min(xs)), self._column(max(xs)) + 1
        j0, j1 = self._row(min(ys)), self._row(max(ys)) + 1
        x = ((np.arange(i0, i1) + self.left).astype(np.float64) + 0.5) * self.cell_m
        y = ((np.arange(j0, j1) + self.bottom).astype(np.float64) + 0.5) * self.cell_m
        inside = np.ones((len(y), len(x)), dtype=bool)
        for k, (bx, by) in enumerate(corners):
            ax, ay = corners[k - 1]
            inside &= sign * ((bx - ax) * (y[:, None] - ay) - (by - ay) * (x[None, :] - ax)) >= 0.0
        if solid is not None and bool((inside & solid[j0:j1, i0:i1]).any()):
            return
        window = self.free[j0:j1, i0:i1]
        window[inside] = np.minimum(window[inside], -weight)

    def mark(self, ends: Floats, weights: Ints) -> None:
        """Occupied evidence along segments (n, 4); the strongest weight of a cell counts."""
        cells, number = self._along(ends, 0.25)
        np.maximum.at(self.occupied.reshape(-1), cells, weights[number].astype(np.int16))

    def hint(self, ends: Floats, weight: int) -> None:
        """A little occupied evidence along segments (n, 4); hints add up, each counting once in a cell."""
        cells, number = self._along(ends, 0.5)
        once = np.ones(len(cells), dtype=bool)
        once[1:] = (cells[1:] != cells[:-1]) | (number[1:] != number[:-1])  # a line does not come back to a cell
        np.add.at(self.hints.reshape(-1), cells[once], np.int16(weight))

    def cells_along(self, ends: Floats) -> Ints:
        """The canvas's cells (k,) under segments (n, 4), row after row, some more than once."""
        return self._along(ends, 0.25)[0]

    def _along(self, ends: Floats, step: float) -> tuple[Ints, Ints]:
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
        return np.where(self.occupied > 0, self.occupied, self.free + self.hints)

    def _column(self, x: float) -> int:
        return min(max(int(x // self.cell_m) - self.left, 0), self.width - 1)

    def _row(self, y: float) -> int:
        return min(max(int(y // self.cell_m) - self.bottom, 0), self.height - 1)


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
