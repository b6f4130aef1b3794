"""The sum of all evidence, cell by cell, and what of it shows in the grid.

A sum without limits does not care in which order its parts came, so the evidence of a sweep can be taken back and given
anew from another place; the grid shows it clipped. Must not know: what the evidence is of.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from slam.grid import LIMIT, TILE, Cells, Grid, Patch

Sums = NDArray[np.int32]


@dataclass(frozen=True)
class Layer:
    """The evidence of one sweep: log-odds × 10, `delta` (h, w) int8, row = y, from column `left`, row `bottom` on."""

    left: int
    bottom: int
    delta: NDArray[np.int8]


NOTHING = Layer(0, 0, np.zeros((0, 0), dtype=np.int8))


def cropped(left: int, bottom: int, delta: NDArray[np.signedinteger]) -> Layer:
    """The layer without its empty borders."""
    rows, columns = np.flatnonzero(delta.any(axis=1)), np.flatnonzero(delta.any(axis=0))
    if len(rows) == 0:
        return NOTHING
    j0, j1, i0, i1 = int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1
    kept = np.minimum(np.maximum(delta[j0:j1, i0:i1], -LIMIT), LIMIT).astype(np.int8)
    kept.setflags(write=False)
    return Layer(left + i0, bottom + j0, kept)


@dataclass(frozen=True)
class Evidence:
    """All layers added up, in tiles as the grid's: `tiles[(i, j)]` is (TILE, TILE) int32."""

    tiles: Mapping[tuple[int, int], Sums] = field(default_factory=dict)

    def changed(self, gone: list[Layer], new: list[Layer]) -> tuple["Evidence", list[tuple[int, int]]]:
        """Without some layers and with others, and which tiles those touch; all others are shared."""
        tiles, touched = dict(self.tiles), dict[tuple[int, int], Sums]()
        for sign, layers in ((-1, gone), (1, new)):
            for layer in layers:
                for place, inside, window in _split(layer):
                    if place not in touched:
                        touched[place] = tiles[place].copy() if place in tiles else np.zeros((TILE, TILE), np.int32)
                    if sign > 0:
                        touched[place][inside] += window
                    else:
                        touched[place][inside] -= window
        for tile in touched.values():
            tile.setflags(write=False)
        return Evidence(tiles | touched), list(touched)

    def shown(self, grid: Grid, changed: list[tuple[int, int]]) -> Grid:
        """The grid that showed all but those tiles as they are, showing these too."""
        tiles = dict(grid.tiles)
        for place in changed:
            tiles[place] = np.minimum(np.maximum(self.tiles[place], -LIMIT), LIMIT).astype(np.int16)
            tiles[place].setflags(write=False)
        return Grid(grid.cell_m, grid.occupied_from, grid.free_from, tiles)


def patch_between(before: Grid, after: Grid, changed: list[tuple[int, int]]) -> Patch:
    """What changed from one grid to the other, if nothing did outside those tiles."""
    changes = dict[tuple[int, int], Cells]()
    for place in changed:
        tile, was = after.tiles[place], before.tiles.get(place)
        change = tile if was is None else tile - was
        if change.any():
            changes[place] = change
    return _joined(changes) if changes else Patch(0, 0, np.zeros((1, 1), dtype=np.int16))


def _split(layer: Layer) -> Iterator[tuple[tuple[int, int], tuple[slice, slice], NDArray[np.int8]]]:
    """The layer tile by tile: the tile's place, where in the tile, and the part of the layer there."""
    height, width = layer.delta.shape
    for tj in range(layer.bottom // TILE, (layer.bottom + height - 1) // TILE + 1):
        for ti in range(layer.left // TILE, (layer.left + width - 1) // TILE + 1):
            x0, y0 = max(ti * TILE, layer.left), max(tj * TILE, layer.bottom)
            x1 = min((ti + 1) * TILE, layer.left + width)
            y1 = min((tj + 1) * TILE, layer.bottom + height)
            part = layer.delta[y0 - layer.bottom : y1 - layer.bottom, x0 - layer.left : x1 - layer.left]
            if part.any():
                inside = (slice(y0 - tj * TILE, y1 - tj * TILE), slice(x0 - ti * TILE, x1 - ti * TILE))
                yield (ti, tj), inside, part


def _joined(changes: Mapping[tuple[int, int], Cells]) -> Patch:
    """The tiles' changes as one patch without empty borders."""
    left, bottom = min(i for i, _ in changes), min(j for _, j in changes)
    width, height = max(i for i, _ in changes) - left + 1, max(j for _, j in changes) - bottom + 1
    whole = np.zeros((height * TILE, width * TILE), dtype=np.int16)
    for (i, j), change in changes.items():
        row, column = (j - bottom) * TILE, (i - left) * TILE
        whole[row : row + TILE, column : column + TILE] = change
    rows, columns = np.flatnonzero(whole.any(axis=1)), np.flatnonzero(whole.any(axis=0))
    j0, j1, i0, i1 = int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1
    return Patch(left * TILE + i0, bottom * TILE + j0, whole[j0:j1, i0:i1].copy())
