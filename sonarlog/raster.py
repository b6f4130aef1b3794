"""True surfaces as cells: what is solid, and what of the rest can be reached.

Must not know: maps under judgement, files.
"""

from dataclasses import dataclass

import numpy as np

from slam.geometry import Bools
from sonarlog.log import Floats, Ints, Surfaces


@dataclass(frozen=True)
class Raster:
    """Cells of `cell_m`, row = y; the first is at column `left`, row `bottom` of the plane's cells.

    `walls` (h, w) are the cells that a segment passes through, `poles` those whose middle is inside a pole.
    """

    cell_m: float
    left: int
    bottom: int
    walls: Bools
    poles: Bools

    def cells(self, points: Floats) -> tuple[Ints, Ints]:
        """Row and column under each point (n, 2) m."""
        at = np.floor(points / self.cell_m).astype(np.int64)
        return at[:, 1] - self.bottom, at[:, 0] - self.left

    def reached(self, stations: Floats) -> Bools:
        """The cells that can be reached from the stations (n, 2) by their sides, through no wall and out of poles."""
        from scipy import ndimage  # takes as long to load as numpy

        begin = np.zeros_like(self.walls)
        begin[self.cells(stations)] = True
        reached = ndimage.binary_propagation(begin & ~self.walls, mask=~self.walls)
        return np.asarray(reached & ~self.poles)


def rasterised(surfaces: Surfaces, cell_m: float, around: Floats) -> Raster:
    """The surfaces as cells, in a rectangle that holds them all and the points (n, 2) around."""
    boxes = [np.array([[x - r, y - r], [x + r, y + r]]) for x, y, r in surfaces.poles.tolist()]
    points = np.concatenate([around, surfaces.segments.reshape(-1, 2), *boxes])
    left, bottom = (np.floor(points.min(axis=0) / cell_m).astype(np.int64) - 2).tolist()
    width, height = (np.floor(points.max(axis=0) / cell_m).astype(np.int64) + 3 - (left, bottom)).tolist()
    empty = Raster(cell_m, left, bottom, np.zeros((height, width), dtype=bool), np.zeros((height, width), dtype=bool))
    for x0, y0, x1, y1 in surfaces.segments.tolist():
        steps = int(4.0 * np.hypot(x1 - x0, y1 - y0) / cell_m) + 1
        part = np.arange(steps + 1) / steps
        row, column = empty.cells(np.column_stack([x0 + part * (x1 - x0), y0 + part * (y1 - y0)]))
        empty.walls[row, column] = True
    for x, y, radius in surfaces.poles.tolist():
        (row, top), (column, right) = empty.cells(np.array([[x - radius, y - radius], [x + radius, y + radius]]))
        j, i = np.mgrid[row : top + 1, column : right + 1]
        off = np.hypot((i + left + 0.5) * cell_m - x, (j + bottom + 0.5) * cell_m - y)
        empty.poles[row : top + 1, column : right + 1] |= off <= radius
    return empty
