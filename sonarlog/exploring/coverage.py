"""How much of a place was mapped, and how short a drive through it could be: what an exploration is measured by.

Both need the true surfaces; nothing here steers. Must not know: recordings, runs, printing.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from slam.geometry import ORIGIN, Bools, Pose
from slam.grid import Grid
from sonarlog.log import Floats
from sonarlog.sim.world import FREE, World

CELL_M = 0.05
MARGIN_M = 0.05
"""The robot's centre keeps its radius and so much more off every surface."""

SIGHT_M = 2.0
"""An ideal scan shows all that is so near and not hidden."""

LATTICE = 8
"""Cells from one place of the ideal tour to the next."""

RAYS = 240
ENOUGH = 0.98
"""The ideal tour shows so much of the place."""


@dataclass(frozen=True)
class Reach:
    """Of a true map: `body` (h, w), the cells that the robot's body can get to, and `centre`, those its centre can.

    Cell (row, column) covers x from (left + column) · CELL_M and y from (bottom + row) · CELL_M in the truth's frame.
    """

    body: Bools
    centre: Bools
    free: Bools
    left: int
    bottom: int

    def points(self, cells: Bools) -> Floats:
        """Their middles (n, 2), metres."""
        rows, columns = np.nonzero(cells)
        return (np.column_stack([columns + self.left, rows + self.bottom]).astype(np.float64) + 0.5) * CELL_M


def reach_of(world: World, radius_m: float) -> Reach:
    """Where a robot of that radius can get to from the start."""
    raster = world.raster(CELL_M)
    free = raster.cells == FREE
    far = ndimage.distance_transform_edt(free) * CELL_M
    labels, _ = ndimage.label(far > radius_m + MARGIN_M, structure=np.ones((3, 3)))
    home = labels[-raster.bottom, -raster.left]
    centre = labels == home if home else np.zeros_like(free)
    near = ndimage.distance_transform_edt(~centre) * CELL_M if centre.any() else np.full(free.shape, np.inf)
    return Reach(free & (near <= radius_m), centre, free, raster.left, raster.bottom)


def mapped_share(grid: Grid, frame: Pose, reach: Reach) -> float:
    """Which part of what the robot can get to is known in the map, to a cell; `frame` is the map's in the truth.

    To a cell: before each wall the map leaves a line of cells open, as no sonar is that exact.
    """
    points = frame.step_to(ORIGIN).points(reach.points(reach.body))
    cells, left, bottom = grid.dense()
    column, row = (np.floor(points / grid.cell_m).astype(np.int64) - (left, bottom)).T
    inside = (row >= 0) & (column >= 0) & (row < cells.shape[0]) & (column < cells.shape[1])
    known = ndimage.binary_dilation(grid.free(cells) | grid.occupied(cells), structure=np.ones((3, 3), dtype=np.bool_))
    return float(np.count_nonzero(known[row[inside], column[inside]]) / max(1, len(points)))


def short_tour_m(reach: Reach) -> float:
    """Metres of a short open tour from the start that shows nearly all of the place to a robot that knows it.

    Places by greedy cover, their order by insertion and 2-opt: near to the shortest, and never shorter than it.
    """
    centres = np.argwhere(reach.centre)
    start = np.array([-reach.bottom, -reach.left])
    lattice = centres[((centres - start) % LATTICE == 0).all(axis=1)]
    order = np.lexsort((np.abs(lattice - start).sum(axis=1),))
    chosen = _cover([_seen(reach, place) for place in lattice[order]], reach.body)
    places = np.concatenate([start[None, :], lattice[order][chosen]])
    return _tour(_ways(reach.centre, places))


def _seen(reach: Reach, place: NDArray[np.int64]) -> NDArray[np.int64]:
    """The cells of `body` that a scan there shows, by number."""
    angles = np.arange(RAYS) * 2 * np.pi / RAYS
    steps = np.arange(int(SIGHT_M / CELL_M) + 1)
    row = np.rint(place[0] + np.sin(angles)[:, None] * steps).astype(np.int64).clip(0, reach.free.shape[0] - 1)
    column = np.rint(place[1] + np.cos(angles)[:, None] * steps).astype(np.int64).clip(0, reach.free.shape[1] - 1)
    clear = np.logical_and.accumulate(reach.free[row, column], axis=1)
    cells = np.unique(row[clear] * reach.free.shape[1] + column[clear])
    return np.asarray(cells[reach.body.reshape(-1)[cells]])


def _cover(seen: list[NDArray[np.int64]], body: Bools) -> list[int]:
    """Places that together show enough, the one that shows most that is new first."""
    left = body.reshape(-1).copy()
    enough = (1 - ENOUGH) * np.count_nonzero(left)
    chosen: list[int] = []
    while np.count_nonzero(left) > enough:
        new = [int(np.count_nonzero(left[cells])) for cells in seen]
        best = int(np.argmax(new))
        if new[best] == 0:
            break
        chosen.append(best)
        left[seen[best]] = False
    return chosen


def _ways(centre: Bools, places: NDArray[np.int64]) -> Floats:
    """Metres (n, n) from place to place through cells where the robot's centre can be."""
    number = np.full(centre.shape, -1)
    number[centre] = np.arange(np.count_nonzero(centre))
    edges = []
    for dr, dc, length in ((0, 1, 1.0), (1, 0, 1.0), (1, 1, np.sqrt(2)), (1, -1, np.sqrt(2))):
        here = number[: centre.shape[0] - dr, max(0, -dc) : centre.shape[1] - max(0, dc)]
        there = number[dr:, max(0, dc) : centre.shape[1] - max(0, -dc)]
        both = (here >= 0) & (there >= 0)
        edges.append(np.column_stack([here[both], there[both], np.full(np.count_nonzero(both), length * CELL_M)]))
    table = np.concatenate(edges)
    size = int(np.count_nonzero(centre))
    graph = csr_array((table[:, 2], (table[:, 0].astype(np.int64), table[:, 1].astype(np.int64))), shape=(size, size))
    nodes = number[places[:, 0], places[:, 1]]
    return np.asarray(dijkstra(graph, directed=False, indices=nodes)[:, nodes])


def _tour(ways: Floats) -> float:
    """Length of a short open path through all places from the first: nearest first, then 2-opt until nothing gains."""
    order = [0]
    left = set(range(1, len(ways)))
    while left:
        order.append(min(left, key=lambda place: (ways[order[-1], place], place)))
        left.remove(order[-1])
    better = True
    while better:
        better = False
        for i in range(1, len(order) - 1):
            for j in range(i + 1, len(order)):
                after = order[j + 1] if j + 1 < len(order) else None
                before_m = ways[order[i - 1], order[i]] + (ways[order[j], after] if after is not None else 0.0)
                now_m = ways[order[i - 1], order[j]] + (ways[order[i], after] if after is not None else 0.0)
                if now_m < before_m - 1e-9:
                    order[i : j + 1] = order[i : j + 1][::-1]
                    better = True
    return float(sum(ways[a, b] for a, b in pairwise(order)))
