"""Paths over the grid: A* on cells that keep the robot's radius away from anything occupied.

The costs come first, for all goals at once, in waves of equal cost from the start. A* then looks only at cells that lie
on a cheapest way, and finds what it would have found among all of them.
"""

import heapq
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from slam.boards import as_bytes
from slam.components import labelled_runs
from slam.dmath import Floats
from slam.sweep import Ints

START = 6
"""The start may lie this many cells inside cells that are not passable."""

STRAIGHT, DIAGONAL = 5, 7
"""Costs of a step: integers near 1 : √2, so that equal ways cost exactly the same."""

Cell = tuple[int, int]


@dataclass(frozen=True)
class Ground:
    """Where the robot's centre may be: `passable`, a board of rows of `stride` bits, row = y.

    `shape` is its height and width; its first cell lies at (left, bottom) of the grid.
    """

    passable: int
    stride: int
    shape: tuple[int, int]
    left: int
    bottom: int
    cell_m: float

    def cell(self, x: float, y: float) -> Cell:
        """Row and column of the cell under a point in metres, moved inside if it lies beyond."""
        height, width = self.shape
        row, column = int(y // self.cell_m) - self.bottom, int(x // self.cell_m) - self.left
        return min(max(row, 0), height - 1), min(max(column, 0), width - 1)

    def length_m(self, cost: int) -> float:
        """Metres of a way of that cost."""
        return cost / STRAIGHT * self.cell_m

    def near(self, start: Cell) -> int:
        """The cells around a start that it may stand among though they are not passable, as a board."""
        row, column = start
        left, right = max(column - START, 0), min(column + START + 1, self.shape[1])
        rows = range(max(row - START, 0), min(row + START + 1, self.shape[0]))
        line = (1 << right) - (1 << left)
        board = 0
        for k in rows:
            board |= line << k * self.stride
        return board

    def reachable(self, start: Cell, goals: list[Cell]) -> list[bool]:
        """Whether there may be a way to each passable goal: none lies beyond cells that are not passable."""
        begins, _, numbers = labelled_runs(self.passable | self.near(start), self.stride)
        places: Ints = np.array([row * self.stride + column for row, column in [start, *goals]])
        run = np.searchsorted(begins, places, side="right") - 1
        return [bool(number == numbers[run[0]]) for number in numbers[run[1:]]]


@dataclass(frozen=True)
class Path:
    """Cell centres (k, 2) in metres from start to goal, and the way's length."""

    points: Floats
    length_m: float


def find_path(ground: Ground, start: Cell, goal: Cell) -> Path | None:
    """The cheapest 8-connected way to a passable cell (row, column), or None.

    The start may stand on cells that are not passable; the way then leaves them and never comes back to such.
    """
    ways = Ways(ground, start, [goal])
    while goal not in ways.found and ways.go_on():
        pass
    return ways.path(goal) if goal in ways.found else None


class Ways:
    """The cheapest ways from a start to its goals: `found` holds what they cost, as far out as one has gone on."""

    def __init__(self, ground: Ground, start: Cell, goals: Iterable[Cell]) -> None:
        """All goals are passable."""
        self.found: dict[Cell, int] = {}
        self._ground = ground
        stride = ground.stride
        self._left = bytearray(as_bytes(ground.passable << stride, stride, ground.shape[0] + 2))  # not reached yet
        self._straight = (-stride, -1, 1, stride)
        self._diagonal = (-stride - 1, -stride + 1, stride - 1, stride + 1)
        self._start = self._place(start)
        near = as_bytes(ground.near(start) << stride, stride, ground.shape[0] + 2)
        self._inside: dict[int, None] = {}  # cells that are not passable, but may be crossed at first
        if not self._left[self._start]:
            self._inside = {k: None for k, there in enumerate(near) if there and not self._left[k]}
        self._inside_left = dict(self._inside)
        self._goals = {self._place(goal): goal for goal in goals}
        self._cost: dict[int, int] = {}
        self._waves: list[list[int]] = []  # cells by what they cost
        self._reach([self._start])

    @property
    def reached(self) -> int:
        """All cells are known that cost so much or less."""
        return len(self._waves) - 1

    def go_on(self) -> bool:
        """Take in the cells that cost one more; False when there are no more."""
        waves, cost, left = self._waves, len(self._waves), self._left
        straight = waves[-STRAIGHT] if cost >= STRAIGHT else []
        diagonal = waves[-DIAGONAL] if cost >= DIAGONAL else []
        a, b, c, d = self._straight
        wave = [n for k in straight for n in (k + a, k + b, k + c, k + d) if left[n]]
        a, b, c, d = self._diagonal
        wave += [n for k in diagonal for n in (k + a, k + b, k + c, k + d) if left[n]]
        for cells, offsets in ((straight, self._straight), (diagonal, self._diagonal)) if self._inside_left else ():
            inside = [k for k in cells if k in self._inside]
            wave += [n for k in inside for offset in offsets if (n := k + offset) in self._inside_left]
        self._reach(wave)
        return any(waves[-DIAGONAL:])

    def _reach(self, wave: list[int]) -> None:
        """The next wave, in which a cell may stand several times."""
        first = dict.fromkeys(wave, len(self._waves))
        self._waves.append(list(first))
        self._cost |= first
        for place in first:
            self._left[place] = 0
        for place in [place for place in self._inside_left if place in first]:
            del self._inside_left[place]
        if not self._goals.keys().isdisjoint(first):
            self.found |= {goal: len(self._waves) - 1 for place, goal in self._goals.items() if place in first}

    def path(self, goal: Cell) -> Path:
        """The way to a goal that was found: of equally good ways the one that A* takes.

        A* goes on with what seems least dear in all, of equals with what is nearest to the goal. Cells that are on no
        cheapest way make no difference to what it does with those that are.
        """
        on = self._on_cheapest(self._place(goal))
        last, first = self._place(goal), self._start
        came = {first: first}
        queue = [(0, 0, first)]
        while queue[0][2] != last:
            _, _, here = heapq.heappop(queue)
            for price, there in self._steps(here, 1):
                if there in on and there not in came and self._cost[there] == self._cost[here] + price:
                    came[there] = here
                    ahead = least(self._cell(there), goal)
                    heapq.heappush(queue, (self._cost[there] + ahead, ahead, there))
        chain = [last]
        while chain[-1] != first:
            chain.append(came[chain[-1]])
        points = np.array([self._cell(place)[::-1] for place in reversed(chain)])
        points += np.array([self._ground.left, self._ground.bottom])
        return Path((points.astype(np.float64) + 0.5) * self._ground.cell_m, self._ground.length_m(self.found[goal]))

    def _on_cheapest(self, goal: int) -> dict[int, None]:
        """The cells that lie on a cheapest way to a goal."""
        on, queue = {goal: None}, [goal]
        for here in queue:
            cost = self._cost[here]
            before = [n for price, n in self._steps(here, -1) if n not in on and self._cost.get(n) == cost - price]
            on |= dict.fromkeys(before)
            queue += before
        return on

    def _steps(self, here: int, way: int) -> list[tuple[int, int]]:
        """Price and cell of every step from here (`way` 1) or to here (−1)."""
        steps = [(STRAIGHT, here + offset) for offset in self._straight]
        steps += [(DIAGONAL, here + offset) for offset in self._diagonal]
        if not self._inside or (here in self._inside) == (way > 0):
            return steps
        return [(price, n) for price, n in steps if (n in self._inside) == (way < 0)]

    def _place(self, cell: Cell) -> int:
        return (cell[0] + 1) * self._ground.stride + cell[1]

    def _cell(self, place: int) -> Cell:
        row, column = divmod(place, self._ground.stride)
        return row - 1, column


def least(a: Cell, b: Cell) -> int:
    """The cost of the way if nothing stood in it."""
    dr, dc = abs(a[0] - b[0]), abs(a[1] - b[1])
    return STRAIGHT * max(dr, dc) + (DIAGONAL - STRAIGHT) * min(dr, dc)
