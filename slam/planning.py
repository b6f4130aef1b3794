"""Ways over the grid: the cheapest ones from a start, where going near what is occupied or unknown costs more.

Costs are integers and are found for all goals at once, in waves of equal cost from the start.
"""

from dataclasses import dataclass

import numpy as np

from slam.boards import as_bytes
from slam.components import labelled_runs
from slam.dmath import Floats, Number
from slam.geometry import Bools
from slam.sweep import Ints

START = 3
"""The start may lie this many cells inside cells that are not passable."""

STRAIGHT, DIAGONAL = 5, 7
"""Costs of a step: integers near 1 : √2, so that equal ways cost exactly the same."""

TIGHT, CLOSE, LEAVING = 5, 5, 20
"""What a step costs more into a tight cell, into a close one, and into one that is not passable about the start."""

Cell = tuple[int, int]


@dataclass(frozen=True)
class Ground:
    """Where the robot's centre may be: `passable`, a board of rows of `stride` bits, row = y.

    It does not like to be in `tight` cells, still less in `close` ones, and is never in `solid` ones. `shape` is its
    height and width; its first cell lies at (left, bottom) of the grid.
    """

    passable: int
    stride: int
    shape: tuple[int, int]
    left: int
    bottom: int
    cell_m: float
    tight: int = 0
    close: int = 0
    solid: int = 0

    def cell(self, x: float, y: float) -> Cell:
        """Row and column of the cell under a point in metres, moved inside if it lies beyond."""
        height, width = self.shape
        row, column = int(y // self.cell_m) - self.bottom, int(x // self.cell_m) - self.left
        return min(max(row, 0), height - 1), min(max(column, 0), width - 1)

    def cells_at(self, points: Floats) -> tuple[Ints, Ints]:
        """Rows and columns of the cells under points (…, 2) m, which may lie beyond it."""
        rows = np.floor(points[..., 1] / self.cell_m).astype(np.int64) - self.bottom
        return rows, np.floor(points[..., 0] / self.cell_m).astype(np.int64) - self.left

    def holds(self, points: Floats) -> Bools:
        """Which points (…, 2) m lie on it."""
        rows, columns = self.cells_at(points)
        return (rows >= 0) & (rows < self.shape[0]) & (columns >= 0) & (columns < self.shape[1])

    def length_m(self, cost: Number) -> Number:
        """Metres of a way of that cost through cells that are not tight."""
        return cost / STRAIGHT * self.cell_m

    def about(self, start: Cell) -> int:
        """The cells that are not passable, but may be crossed to get away from a start that stands among them."""
        row, column = start
        if self.passable >> (row * self.stride + column) & 1:
            return 0
        left, right = max(column - START, 0), min(column + START + 1, self.shape[1])
        rows = range(max(row - START, 0), min(row + START + 1, self.shape[0]))
        line = (1 << right) - (1 << left)
        board = 0
        for k in rows:
            board |= line << k * self.stride
        return (board & ~self.passable & ~self.solid) | 1 << (row * self.stride + column)

    def passable_at(self, points: Floats) -> Bools:
        """Which points (…, 2) m lie on passable cells; beyond the ground none does."""
        board = np.frombuffer(as_bytes(self.passable, self.stride, self.shape[0]), dtype=np.bool_)
        (rows, columns), inside = self.cells_at(points), self.holds(points)
        return np.asarray(inside & board[np.where(inside, rows * self.stride + columns, 0)])

    def reached(self, starts: Ints, about: int = 0) -> Bools:
        """The passable cells (h · stride,) that there is a way to from any of the places, also over cells `about`."""
        begins, ends, numbers = labelled_runs(self.passable | about, self.stride)
        runs = np.searchsorted(begins, starts, side="right") - 1
        runs = runs[(runs >= 0) & (starts < ends[runs])]
        mine = np.zeros(len(begins), dtype=np.bool_)
        mine[numbers[runs]] = True
        borders = np.zeros(self.shape[0] * self.stride + 1, dtype=np.int8)
        same = mine[numbers]
        borders[begins[same]] = 1
        borders[ends[same]] = -1
        reached = np.cumsum(borders[:-1]) > 0
        return np.asarray(reached & np.frombuffer(as_bytes(self.passable, self.stride, self.shape[0]), dtype=np.bool_))


@dataclass(frozen=True)
class Path:
    """Cell centres (k, 2) in metres from start to goal, and the way's length."""

    points: Floats
    length_m: float


def find_path(ground: Ground, start: Cell, goal: Cell) -> Path | None:
    """The cheapest 8-connected way to a passable cell (row, column), or None."""
    ways = Ways(ground, start)
    while ways.cost(goal) < 0 and ways.go_on():
        pass
    return None if ways.cost(goal) < 0 else ways.path(goal)


class Ways:
    """The cheapest ways from a start, found as far out as one has gone on."""

    def __init__(self, ground: Ground, start: Cell) -> None:
        self.start = start
        self._ground = ground
        stride, rows = ground.stride, ground.shape[0] + 2
        self._straight = (-stride, -1, 1, stride)
        self._diagonal = (-stride - 1, -stride + 1, stride - 1, stride + 1)
        about = ground.about(start)
        self._left = bytearray(as_bytes((ground.passable | about) << stride, stride, rows))  # not reached yet
        tight, close, leaving = (
            np.frombuffer(as_bytes(board << stride, stride, rows), dtype=np.uint8)
            for board in (ground.tight, ground.close, about)
        )
        dear = np.where(leaving > 0, LEAVING, tight * TIGHT + close * CLOSE).astype(np.uint8)
        self._price = dear.tobytes()  # of a step into the cell, above its length
        self._cost: dict[int, int] = {}
        self._waves: list[list[int]] = []  # cells by what they cost
        self._later: dict[int, list[int]] = {}  # cells that were come upon, by what they will have cost
        self._left[self._place(start)] = 0
        self._reach([self._place(start)])

    @property
    def reached(self) -> int:
        """All cells are known that cost so much or less."""
        return len(self._waves) - 1

    def cost(self, cell: Cell) -> int:
        """What the way to a cell costs; −1: not known, or there is none."""
        return self._cost.get(self._place(cell), -1)

    def costs(self, rows: Ints, columns: Ints) -> list[int]:
        """Those of many cells."""
        known = self._cost
        return [known.get(place, -1) for place in ((rows + 1) * self._ground.stride + columns).tolist()]

    def go_on(self) -> bool:
        """Take in the cells that cost one more; False when there are no more."""
        waves, cost, left, price = self._waves, len(self._waves), self._left, self._price
        wave = self._later.pop(cost, [])
        for length, offsets in ((STRAIGHT, self._straight), (DIAGONAL, self._diagonal)):
            cells = waves[-length] if cost >= length else ()
            for offset in offsets:
                for n in [n for k in cells if left[n := k + offset]]:
                    left[n] = 0
                    if price[n]:
                        self._later.setdefault(cost + price[n], []).append(n)
                    else:
                        wave.append(n)
        self._reach(wave)
        return bool(self._later) or any(waves[-DIAGONAL:])

    def _reach(self, wave: list[int]) -> None:
        self._cost |= dict.fromkeys(wave, len(self._waves))
        self._waves.append(wave)

    def path(self, goal: Cell) -> Path:
        """The way to a goal that was found: of equally cheap ways the one that goes straight on from the goal back."""
        here, last = self._place(goal), 0
        chain = [here]
        while here != self._place(self.start):
            before = self._cost[here] - self._price[here]
            steps = [(last, self._length(last))] if last else []
            steps += [(o, STRAIGHT) for o in self._straight] + [(o, DIAGONAL) for o in self._diagonal]
            last = next(o for o, length in steps if self._cost.get(here + o) == before - length)
            here += last
            chain.append(here)
        rows, columns = np.divmod(np.array(chain[::-1]), self._ground.stride)
        cells = np.stack([columns + self._ground.left, rows - 1 + self._ground.bottom], axis=1)
        turns = int(np.count_nonzero((np.diff(cells, axis=0) != 0).all(axis=1)))
        length = self._ground.length_m(STRAIGHT * (len(chain) - 1 - turns) + DIAGONAL * turns)
        return Path((cells.astype(np.float64) + 0.5) * self._ground.cell_m, length)

    def _length(self, offset: int) -> int:
        return STRAIGHT if offset in self._straight else DIAGONAL

    def _place(self, cell: Cell) -> int:
        return (cell[0] + 1) * self._ground.stride + cell[1]
