"""What became of each pixel of a map, in colours and patterns that are told apart without colour too.

Must not know: runs, how maps are laid on one another.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.uint8]
States = NDArray[np.integer]
UNKNOWN, FREE, OCCUPIED = 0, 1, 2
KEPT, GREY, WHITE = (74, 76, 80), (205, 205, 205), (255, 255, 255)
A, B = (179, 71, 0), (0, 92, 148)
A_LIGHT, B_LIGHT = (251, 227, 207), (212, 232, 247)
TILE = 8


class Change(NamedTuple):
    """Cells whose state is 3·A + B in `states`: what they are called, their ground and what is drawn on it."""

    name: str
    states: tuple[int, ...]
    ground: tuple[int, int, int]
    mark: tuple[int, int, int]
    pattern: str


CHANGES = (
    Change("free only in B", (1,), B_LIGHT, B, "dots"),
    Change("free only in A", (3,), A_LIGHT, A, "dashes"),
    Change("occupied only in B", (2, 5), B, B_LIGHT, "up"),
    Change("occupied only in A", (6, 7), A, A_LIGHT, "down"),
)


def change_pixels(states: States) -> Pixels:
    """Colours (h, w, 3) of states 3·A + B (h, w), the first row on top."""
    grounds = {0: GREY, 4: WHITE, 8: KEPT}
    pixels = np.full((*states.shape, 3), GREY, dtype=np.uint8)
    for state, ground in grounds.items():
        pixels[states == state] = ground
    places = np.indices(states.shape) % TILE
    for change in CHANGES:
        mine = np.isin(states, change.states)
        pixels[mine] = change.ground
        pixels[mine & _marked(change.pattern, places[0], places[1])] = change.mark
    return pixels


def swatch(change: Change, width: int, height: int) -> Pixels:
    """A sample of the change (height, width, 3), for a legend."""
    return change_pixels(np.full((height, width), change.states[0]))


def _marked(pattern: str, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which places of a tile carry the mark."""
    if pattern == "dots":
        return np.asarray((rows % 4 < 2) & (columns % 4 < 2) & ((rows // 4 + columns // 4) % 2 == 0))
    if pattern == "dashes":
        return np.asarray((rows % 4 == 0) & (columns < 6))
    turned = columns + rows if pattern == "up" else columns - rows
    return np.asarray(turned % TILE < 2)
