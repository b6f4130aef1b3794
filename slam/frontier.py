"""Block I, decision making: where to go next to see more [III.I; Yamauchi 1997].

Frontier cells are free cells next to unknown ones, their clusters are regions, and the goal is the region of best
gain for the cost of the way to it.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.components import label
from slam.dmath import Floats
from slam.geometry import Bools, Pose
from slam.grid import Grid
from slam.planning import Ground, find_path, inflate
from slam.sweep import Ints


@dataclass(frozen=True)
class FrontierConfig:
    """Which regions count, how far from walls the robot keeps, and what the way costs."""

    min_cells: int = 6
    robot_radius_m: float = 0.18
    margin_m: float = 0.05
    settle_m: float = 1.0  # added to every way: a near goal is not infinitely good


@dataclass(frozen=True)
class Region:
    """A cluster of frontier cells: how many, their centre (x, y) m, and the passable cell (i, j) to go to, if any."""

    cells: int
    centre: tuple[float, float]
    target: tuple[int, int] | None


@dataclass(frozen=True)
class Decision:
    """The regions, largest first; the chosen one (None: nothing reachable is unknown) and the path (k, 2) m to it."""

    frontier_cells: int
    regions: tuple[Region, ...]
    chosen: int | None
    path: Floats


def next_goal(grid: Grid, pose: Pose, config: FrontierConfig) -> Decision:
    """Choose the frontier region with the most cells for the metres to it."""
    cells, left, bottom = grid.dense()
    nothing = np.zeros((0, 2))
    if cells.size == 0:
        return Decision(0, (), None, nothing)
    free = grid.free(cells)
    frontier = free & beside(~free & ~grid.occupied(cells))
    radius = int((config.robot_radius_m + config.margin_m) / grid.cell_m + 0.5)
    ground = Ground(free & ~inflate(grid.occupied(cells), radius), left, bottom, grid.cell_m)
    regions = _regions(frontier, ground, config)
    start = ground.cell(pose.x, pose.y)
    best: tuple[float, int, Floats] | None = None
    reachable = ground.reachable(start)
    for k in sorted(range(len(regions)), key=lambda k: (-_gain(regions[k], pose, config), k)):
        target = regions[k].target
        # Straight there is the least a way can cost, so what cannot win even so needs no search.
        if best is not None and _gain(regions[k], pose, config) <= best[0]:
            break
        found = find_path(ground, start, target) if target is not None and reachable[target] else None
        if found is not None:
            gain = regions[k].cells / (found.length_m + config.settle_m)
            if best is None or gain > best[0]:
                best = (gain, k, found.points)
    return Decision(
        int(np.count_nonzero(frontier)), tuple(regions), best[1] if best else None, best[2] if best else nothing
    )


def beside(mask: Bools) -> Bools:
    """The cells with a 4-neighbour in the mask; beyond the border counts as in it."""
    padded = np.pad(mask, 1, constant_values=True)
    return padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:]


def _gain(region: Region, pose: Pose, config: FrontierConfig) -> float:
    straight = dmath.hypot(region.centre[0] - pose.x, region.centre[1] - pose.y)
    # The centre may lie up to the region's own size nearer than its cell to go to.
    return region.cells / (max(0.0, straight - 0.05 * region.cells) + config.settle_m)


def _regions(frontier: Bools, ground: Ground, config: FrontierConfig) -> list[Region]:
    """8-connected clusters of frontier cells that are large enough, largest first."""
    rows, columns = np.nonzero(frontier)
    cluster = label(frontier)[rows, columns]
    sizes = np.bincount(cluster)
    order = np.argsort(cluster, kind="stable")
    borders = np.cumsum(sizes)
    regions = []
    for k in np.flatnonzero(sizes >= config.min_cells).tolist():
        members = order[borders[k] - sizes[k] : borders[k]]
        regions.append(_region(rows[members], columns[members], ground))
    return sorted(regions, key=lambda region: (-region.cells, region.centre))


def _region(rows: Ints, columns: Ints, ground: Ground) -> Region:
    middle_row, middle_column = int(rows.sum()) / len(rows), int(columns.sum()) / len(rows)
    passable = ground.passable[rows, columns]
    target = None
    if bool(passable.any()):
        off = (rows - middle_row) ** 2 + (columns - middle_column) ** 2
        nearest = int(np.argmin(np.where(passable, off, np.inf)))
        target = (int(rows[nearest]), int(columns[nearest]))
    centre = (
        (middle_column + ground.left + 0.5) * ground.cell_m,
        (middle_row + ground.bottom + 0.5) * ground.cell_m,
    )
    return Region(len(rows), centre, target)
