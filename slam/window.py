"""Windows of the map: the tiles about the robot that a scan may have changed, and those about these.

Must not know: what is looked for in them.
"""

from dataclasses import dataclass

from slam.geometry import Bools
from slam.grid import TILE
from slam.sweep import Ints

CHANGED_M = 3.2
"""No scan changes the map farther off."""

SIGHT_M = 1.7
"""So far about a place reaches what is asked of the map there."""


@dataclass(frozen=True)
class Window:
    """Whole tiles: cells from column `left` and row `bottom` to before column `right` and row `top`."""

    left: int
    bottom: int
    right: int
    top: int

    def grown(self, tiles: int) -> "Window":
        """With so many tiles more to every side."""
        more = tiles * TILE
        return Window(self.left - more, self.bottom - more, self.right + more, self.top + more)

    def without(self, other: "Window") -> "Window":
        """The smallest window that holds what it has and the other has not."""
        left, bottom, right, top = self.left, self.bottom, self.right, self.top
        if other.bottom <= bottom and other.top >= top:
            left, right = _rest(left, right, other.left, other.right)
        elif other.left <= left and other.right >= right:
            bottom, top = _rest(bottom, top, other.bottom, other.top)
        return Window(left, bottom, right, top)

    def holds(self, columns: Ints, rows: Ints) -> Bools:
        """Which cells lie in it."""
        return (columns >= self.left) & (columns < self.right) & (rows >= self.bottom) & (rows < self.top)


def changed_about(x: float, y: float, cell_m: float) -> Window:
    """What a scan at (x, y) metres may have changed."""
    column, row = (int(value // cell_m) // TILE * TILE for value in (x, y))
    return Window(column, row, column + TILE, row + TILE).grown(_tiles(CHANGED_M, cell_m))


def in_sight_of(window: Window, cell_m: float) -> Window:
    """With all that is asked of the map for places in the window."""
    return window.grown(_tiles(SIGHT_M, cell_m))


def _tiles(metres: float, cell_m: float) -> int:
    return -int(-metres // (TILE * cell_m))


def _rest(begin: int, end: int, low: int, high: int) -> tuple[int, int]:
    """Of a stretch what lies before or after another, or on both sides of it."""
    return (max(begin, high) if low <= begin else begin, min(end, low) if high >= end else end)
