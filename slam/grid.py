"""The occupancy grid: integer log-odds in square tiles, a value that is never changed, only extended.

Cell (i, j) covers [i, i+1) × [j, j+1) cells of x and y in the map frame. A new grid shares every tile that it did not
touch with the old one, so keeping all of a run's grids costs only what changed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from slam.geometry import Bools

TILE = 64
LIMIT = 127
"""Log-odds stay within ±LIMIT, so that a wall that goes away can be unlearned."""

Cells = NDArray[np.int16]


@dataclass(frozen=True)
class Patch:
    """Log-odds to add: `delta` (h, w) int16, row = y, its first cell at column `left`, row `bottom` of the grid."""

    left: int
    bottom: int
    delta: Cells


@dataclass(frozen=True)
class Grid:
    """Log-odds × 10 of being occupied; 0 is unknown. `tiles[(i, j)]` is (TILE, TILE) int16, row = y."""

    cell_m: float
    occupied_from: int
    free_from: int
    tiles: Mapping[tuple[int, int], Cells] = field(default_factory=dict)

    def extended(self, patch: Patch) -> "Grid":
        """With the patch added, saturating."""
        tiles = dict(self.tiles)
        height, width = patch.delta.shape
        for tj in range(patch.bottom // TILE, (patch.bottom + height - 1) // TILE + 1):
            for ti in range(patch.left // TILE, (patch.left + width - 1) // TILE + 1):
                x0, y0 = max(ti * TILE, patch.left), max(tj * TILE, patch.bottom)
                x1 = min((ti + 1) * TILE, patch.left + width)
                y1 = min((tj + 1) * TILE, patch.bottom + height)
                delta = patch.delta[y0 - patch.bottom : y1 - patch.bottom, x0 - patch.left : x1 - patch.left]
                if not delta.any():
                    continue
                tile = tiles[ti, tj].copy() if (ti, tj) in tiles else np.zeros((TILE, TILE), dtype=np.int16)
                window = tile[y0 - tj * TILE : y1 - tj * TILE, x0 - ti * TILE : x1 - ti * TILE]
                np.clip(window + delta, -LIMIT, LIMIT, out=window)
                tile.setflags(write=False)
                tiles[ti, tj] = tile
        return Grid(self.cell_m, self.occupied_from, self.free_from, tiles)

    def window(self, left: int, bottom: int, width: int, height: int) -> Cells:
        """The cells of a rectangle, (height, width)."""
        result = np.zeros((height, width), dtype=np.int16)
        places = ((ti, tj) for tj in range(bottom // TILE, (bottom + height - 1) // TILE + 1)
                  for ti in range(left // TILE, (left + width - 1) // TILE + 1) if (ti, tj) in self.tiles)  # fmt: skip
        for ti, tj in places:
            tile = self.tiles[ti, tj]
            x0, y0 = max(ti * TILE, left), max(tj * TILE, bottom)
            x1, y1 = min((ti + 1) * TILE, left + width), min((tj + 1) * TILE, bottom + height)
            if x0 < x1 and y0 < y1:
                part = tile[y0 - tj * TILE : y1 - tj * TILE, x0 - ti * TILE : x1 - ti * TILE]
                result[y0 - bottom : y1 - bottom, x0 - left : x1 - left] = part
        return result

    def bounds(self) -> tuple[int, int, int, int]:
        """The rectangle (left, bottom, width, height) in cells that holds every tile; empty: all 0."""
        if not self.tiles:
            return (0, 0, 0, 0)
        columns, rows = [i for i, _ in self.tiles], [j for _, j in self.tiles]
        left, bottom = min(columns) * TILE, min(rows) * TILE
        return (left, bottom, (max(columns) + 1) * TILE - left, (max(rows) + 1) * TILE - bottom)

    def dense(self) -> tuple[Cells, int, int]:
        """All cells as one array (row = y), and the column and row of its first cell."""
        left, bottom, width, height = self.bounds()
        return self.window(left, bottom, width, height), left, bottom

    def occupied(self, cells: Cells) -> Bools:
        """Which of these log-odds mean occupied."""
        return np.asarray(cells >= self.occupied_from)

    def free(self, cells: Cells) -> Bools:
        """Which of these log-odds mean free."""
        return np.asarray(cells <= self.free_from)
