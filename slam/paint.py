"""Painting convex areas and segments onto cells: the canvas of one sweep's map extension."""

import numpy as np

from slam import dmath
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

    def mark(self, start: Point, end: Point, weight: int) -> None:
        """Occupied evidence along a segment; the strongest weight of a cell counts."""
        rows, columns = self.cells_along(start, end)
        self.occupied[rows, columns] = np.maximum(self.occupied[rows, columns], weight)

    def hint(self, starts: tuple[Floats, Floats], ends: tuple[Floats, Floats], weight: int) -> None:
        """A little occupied evidence along segments given by x and y (n,) of their ends; hints add up."""
        (x0, y0), (x1, y1) = starts, ends
        longest = float(dmath.hypot(x1 - x0, y1 - y0).max())
        steps = int(longest / (0.5 * self.cell_m)) + 1
        part = np.arange(steps + 1).astype(np.float64)[:, None] / float(steps)
        rows, columns = self._cells(x0 + part * (x1 - x0), y0 + part * (y1 - y0))
        number = np.arange(len(x0)) * (self.width * self.height)  # a segment counts once in a cell
        cells = np.unique(number + rows * self.width + columns) % (self.width * self.height)
        self.hints += (
            (weight * np.bincount(cells, minlength=self.hints.size)).reshape(self.hints.shape).astype(np.int16)
        )

    def cells_along(self, start: Point, end: Point) -> tuple[Ints, Ints]:
        """Rows and columns (k,) of the canvas's cells under a segment."""
        length = dmath.hypot(end[0] - start[0], end[1] - start[1])
        steps = int(length / (0.25 * self.cell_m)) + 1
        part = np.arange(steps + 1).astype(np.float64) / float(steps)
        return self._cells(start[0] + part * (end[0] - start[0]), start[1] + part * (end[1] - start[1]))

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
