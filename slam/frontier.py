"""Block I, decision making: where to go next to see more [III.I; Yamauchi 1997].

Frontier cells are free cells next to unknown ones, their clusters are regions, and the goal is the region of best
gain for the cost of the way to it.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.boards import board, cells, stride_of, within
from slam.components import labelled_runs
from slam.dmath import Floats
from slam.geometry import Pose
from slam.grid import Grid
from slam.planning import STRAIGHT, Ground, Path, Ways, least
from slam.sweep import Ints

ROUND = 16
"""Waves of the search for ways between two looks at what may still win."""


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
    log_odds, left, bottom = grid.dense()
    nothing = np.zeros((0, 2))
    if log_odds.size == 0:
        return Decision(0, (), None, nothing)
    radius = int((config.robot_radius_m + config.margin_m) / grid.cell_m + 0.5)
    height, width = log_odds.shape
    stride = stride_of(width, radius + 1)
    free, occupied = board(grid.free(log_odds), stride), board(grid.occupied(log_odds), stride)
    frontier = free & ~inside(free | occupied, stride)
    ground = Ground(free & ~within(occupied, stride, radius), stride, (height, width), left, bottom, grid.cell_m)
    count, regions = _regions(frontier, ground, config)
    chosen, path = _best(regions, ground, pose, config)
    return Decision(count, tuple(regions), chosen, nothing if path is None else path.points)


def inside(mask: int, stride: int) -> int:
    """The cells whose four neighbours are in the mask; what lies beyond the border is not."""
    return (mask << 1) & (mask >> 1) & (mask << stride) & (mask >> stride)


def _best(regions: list[Region], ground: Ground, pose: Pose, config: FrontierConfig) -> tuple[int | None, Path | None]:
    """The region of the best gain and the way to it; of equal gains the one whose centre promises more."""
    start = ground.cell(pose.x, pose.y)
    cells = np.array([region.cells for region in regions], dtype=np.int64)
    order = np.lexsort((np.arange(len(regions)), -_promise(regions, cells, pose, config)))
    goals = [(rank, target) for rank, k in enumerate(order.tolist()) if (target := regions[k].target) is not None]
    reachable = ground.reachable(start, [target for _, target in goals])
    goals = [goal for goal, there in zip(goals, reachable, strict=True) if there]
    ways = Ways(ground, start, [target for _, target in goals])
    size = cells[order][[rank for rank, _ in goals]]
    straight = np.array([least(start, target) for _, target in goals], dtype=np.int64)
    best, more = (0.0, 0, (0, 0)), True
    while goals:
        found = [k for k, (_, target) in enumerate(goals) if target in ways.found]
        won = [(int(size[k]) / (ground.length_m(ways.found[goals[k][1]]) + config.settle_m), k) for k in found]
        best = max([best, *((gain, -goals[k][0], goals[k][1]) for gain, k in won)])
        # The way to what was not found is no shorter than the straight one, and longer than what was gone so far.
        length_m = np.maximum(straight, ways.reached) / STRAIGHT * ground.cell_m
        may = size / (length_m + config.settle_m) >= best[0]
        may[found] = False
        goals, size, straight = [goals[k] for k in np.flatnonzero(may).tolist()], size[may], straight[may]
        if not more:
            break
        for _ in range(ROUND if goals else 0):
            more = ways.go_on()
    return (int(order[-best[1]]), ways.path(best[2])) if best[0] > 0.0 else (None, None)


def _promise(regions: list[Region], cells: Ints, pose: Pose, config: FrontierConfig) -> Floats:
    """What each region would be worth if its nearest cell lay straight ahead."""
    centres = np.array([region.centre for region in regions]).reshape(-1, 2)
    straight = dmath.hypot(centres[:, 0] - pose.x, centres[:, 1] - pose.y)
    # The centre may lie up to the region's own size nearer than its cell to go to.
    return np.asarray(cells / (np.maximum(0.0, straight - 0.05 * cells) + config.settle_m))


def _regions(frontier: int, ground: Ground, config: FrontierConfig) -> tuple[int, list[Region]]:
    """How many frontier cells there are, and their 8-connected clusters that are large enough, largest first."""
    begins, ends, numbers = labelled_runs(frontier, ground.stride)
    lengths = ends - begins
    cluster = np.repeat(numbers, lengths)
    places = np.repeat(ends - np.cumsum(lengths), lengths) + np.arange(len(cluster))
    rows, columns = np.divmod(places, ground.stride)
    sizes = np.bincount(cluster)
    # Sums of integers: as floats they are exact.
    middle_row, middle_column = (np.bincount(cluster, weights=values) / sizes for values in (rows, columns))
    dr, dc = rows - middle_row[cluster], columns - middle_column[cluster]
    passable = np.zeros(len(places), dtype=bool)
    passable[np.searchsorted(places, cells(frontier & ground.passable))] = True
    order = np.lexsort((np.where(passable, dr * dr + dc * dc, np.inf), cluster))
    nearest = order[np.cumsum(sizes) - sizes]  # the first of each cluster
    target = list(zip(rows[nearest].tolist(), columns[nearest].tolist(), strict=True))
    x = ((middle_column + ground.left + 0.5) * ground.cell_m).tolist()
    y = ((middle_row + ground.bottom + 0.5) * ground.cell_m).tolist()
    there = passable[nearest].tolist()
    regions = [
        Region(size, (x[k], y[k]), target[k] if there[k] else None)
        for k, size in enumerate(sizes.tolist())
        if size >= config.min_cells
    ]
    return len(places), sorted(regions, key=lambda region: (-region.cells, region.centre))
