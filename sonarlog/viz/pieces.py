"""What grows or changes a little at every sweep, cut into pieces so that only changed ones are sent again.

A long log then costs as much a sweep as a short one. Must not know: Rerun, the algorithm.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from slam.frontier_config import FrontierConfig
from slam.grid import TILE, Cells, Grid
from slam.regions import frontier_of, ranks_of
from sonarlog.log import Floats
from sonarlog.picture import ORANGE, shades
from sonarlog.viz.shapes import Dots, Raster, Shape

A_PIECE = 40
CHINK = FrontierConfig().chink_cells
NEAR_M = 0.001
"""What moved by less is where it was."""


class Pieces:
    """A list of rows that changes from time to time; the shapes of those pieces of it that did, by entity path."""

    def __init__(self, path: str, shape: Callable[[int, Floats], Shape], *, joined: bool = False) -> None:
        """`shape` makes one of rows from a number on; with `joined` a piece begins with the last row before it."""
        self._path, self._shape, self._joined = path, shape, joined
        self._sent: list[Floats] = []

    def changed(self, rows: Floats) -> dict[str, Shape]:
        """Shapes of the pieces of `rows` (n, k) that are not as they were; of pieces that are gone, empty ones."""
        shapes: dict[str, Shape] = {}
        count = max(-(-len(rows) // A_PIECE), len(self._sent))
        for k in range(count):
            begin = max(0, k * A_PIECE - self._joined)
            piece = rows[begin : (k + 1) * A_PIECE].copy()
            if k < len(self._sent) and _alike(self._sent[k], piece):
                continue
            self._sent[k : k + 1] = [piece]
            shapes[f"{self._path}/{k}"] = self._shape(begin, piece)
        return shapes


def _alike(mine: Floats, yours: Floats) -> bool:
    return mine.shape == yours.shape and bool((np.abs(mine - yours) < NEAR_M).all())


class Tiles:
    """A grid as it is extended: the tiles that changed, and the frontier cells in them."""

    def __init__(self, path: str, frontier: str | None = None) -> None:
        """Entity paths of the map and, if it is wanted, of the frontier."""
        self._path, self._frontier = path, frontier
        self._sent: dict[tuple[int, int], Cells] = {}
        self._edges: dict[tuple[int, int], Floats] = {}

    def changed(self, grid: Grid) -> dict[str, Shape]:
        """Shapes of what is not as it was."""
        nothing = np.zeros((TILE, TILE), dtype=np.int16)
        new = [at for at in sorted(self._sent.keys() | grid.tiles.keys()) if not self._has(at, grid)]
        self._sent = dict(grid.tiles)
        metres = TILE * grid.cell_m
        shapes: dict[str, Shape] = {}
        for i, j in new:
            cells = grid.tiles.get((i, j), nothing)
            shapes[f"{self._path}/{named(i, j)}"] = Raster(shades(grid, cells), i * metres, j * metres, grid.cell_m)
        if self._frontier is not None:
            beside = {(i + di, j + dj) for i, j in new for di in (-1, 0, 1) for dj in (-1, 0, 1)}
            for at in sorted(beside):
                edge = frontier_cells(grid, *at)
                before = self._edges.get(at)
                if len(edge) if before is None else not np.array_equal(edge, before):
                    self._edges[at] = edge
                    shapes[f"{self._frontier}/{named(*at)}"] = Dots(edge, ORANGE, 0.9)
        return shapes

    def _has(self, at: tuple[int, int], grid: Grid) -> bool:
        mine, yours = self._sent.get(at), grid.tiles.get(at)
        return mine is yours or (mine is not None and yours is not None and np.array_equal(mine, yours))


def named(i: int, j: int) -> str:
    """A tile's name in an entity path, `x-2_y3`."""
    return f"x{i}_y{j}"


def frontier_cells(grid: Grid, i: int, j: int) -> Floats:
    """Centres (n, 2) m of a tile's free cells next to unknown ones, as block I takes them: no mere chinks."""
    nothing = np.zeros((TILE, TILE), dtype=np.int16)
    around = {(k, m): grid.tiles.get((k, m), nothing) for k in (i - 1, i, i + 1) for m in (j - 1, j, j + 1)}
    ranks = ranks_of(Grid(grid.cell_m, grid.occupied_from, grid.free_from, around), CHINK, 0)
    if ranks is None:
        return np.zeros((0, 2))
    mine = ranks.array(frontier_of(ranks))[TILE : 2 * TILE, TILE : 2 * TILE]
    rows, columns = np.nonzero(mine)
    return np.asarray(np.column_stack([columns + i * TILE + 0.5, rows + j * TILE + 0.5]) * grid.cell_m)


def merged(parts: Sequence[Mapping[str, Shape]]) -> dict[str, Shape]:
    """All of them."""
    return {path: shape for part in parts for path, shape in part.items()}
