"""Paths over the grid: A* on cells that keep the robot's radius away from anything occupied."""

import heapq
from dataclasses import dataclass

import numpy as np

from slam.components import label
from slam.dmath import Floats
from slam.geometry import Bools

START = 6
"""The start may lie this many cells inside cells that are not passable."""

STRAIGHT, DIAGONAL = 5, 7
"""Costs of a step: integers near 1 : √2, so that equal ways cost exactly the same."""


@dataclass(frozen=True)
class Ground:
    """Where the robot's centre may be: `passable` (h, w), row = y, its first cell at (left, bottom) of the grid."""

    passable: Bools
    left: int
    bottom: int
    cell_m: float

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell under a point in metres, moved inside if it lies beyond."""
        height, width = self.passable.shape
        row, column = int(y // self.cell_m) - self.bottom, int(x // self.cell_m) - self.left
        return min(max(row, 0), height - 1), min(max(column, 0), width - 1)

    def reachable(self, start: tuple[int, int]) -> Bools:
        """The passable cells with a way from the start (row, column), which itself need not be passable."""
        row, column = start
        near = np.zeros_like(self.passable)
        near[max(row - START, 0) : row + START + 1, max(column - START, 0) : column + START + 1] = True
        labels = label(self.passable | near)
        return np.asarray(self.passable & (labels == labels[row, column]))


@dataclass(frozen=True)
class Path:
    """Cell centres (k, 2) in metres from start to goal, and the way's length."""

    points: Floats
    length_m: float


def inflate(occupied: Bools, radius: int) -> Bools:
    """All cells within `radius` cells of an occupied one."""
    height, width = occupied.shape
    counts = np.pad(np.cumsum(np.pad(occupied, ((0, 0), (radius + 1, radius))), axis=1), ((radius, radius), (0, 0)))
    result = np.zeros_like(occupied)
    for dy in range(-radius, radius + 1):
        reach = max(dx for dx in range(radius + 1) if dx * dx + dy * dy <= radius * radius)
        rows = counts[radius + dy : radius + dy + height]
        ahead = rows[:, radius + 1 + reach : radius + 1 + reach + width]
        result |= ahead > rows[:, radius - reach : radius - reach + width]
    return result


def find_path(ground: Ground, start: tuple[int, int], goal: tuple[int, int]) -> Path | None:
    """The cheapest 8-connected way between two cells (row, column), or None.

    The start may stand on cells that are not passable; the way then leaves them and never comes back to such.
    """
    height, width = ground.passable.shape
    passable = ground.passable.reshape(-1).tolist()
    first, last = start[0] * width + start[1], goal[0] * width + goal[1]
    steps = [
        (dr, dc, dr * width + dc, DIAGONAL if dr and dc else STRAIGHT)
        for dr in (-1, 0, 1) for dc in (-1, 0, 1) if dr or dc
    ]  # fmt: skip
    cost, came = {first: 0}, {first: first}
    # Of equally good ways the one nearest to the goal goes on: in the open that saves most of the search.
    queue = [(_least(start, goal), 0, first)]
    done: set[int] = set()
    while queue:
        _, _, here = heapq.heappop(queue)
        if here == last:
            return _path(ground, came, here, cost[here], width)
        if here in done:
            continue
        done.add(here)
        row, column = divmod(here, width)
        for dr, dc, offset, price in steps:
            if not (0 <= row + dr < height and 0 <= column + dc < width):
                continue
            there = here + offset
            if not passable[there] and (
                passable[here] or max(abs(row + dr - start[0]), abs(column + dc - start[1])) > START
            ):
                continue
            new = cost[here] + price
            if there not in cost or new < cost[there]:
                cost[there], came[there] = new, here
                ahead = _least((row + dr, column + dc), goal)
                heapq.heappush(queue, (new + ahead, ahead, there))
    return None


def _least(a: tuple[int, int], b: tuple[int, int]) -> int:
    """The cost of the way if nothing stood in it."""
    dr, dc = abs(a[0] - b[0]), abs(a[1] - b[1])
    return STRAIGHT * max(dr, dc) + (DIAGONAL - STRAIGHT) * min(dr, dc)


def _path(ground: Ground, came: dict[int, int], last: int, cost: int, width: int) -> Path:
    cells = [last]
    while came[cells[-1]] != cells[-1]:
        cells.append(came[cells[-1]])
    rows, columns = np.divmod(np.array(cells[::-1]), width)
    points = np.stack([columns + ground.left, rows + ground.bottom], axis=1).astype(np.float64)
    return Path((points + 0.5) * ground.cell_m, cost / STRAIGHT * ground.cell_m)
