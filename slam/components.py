"""Connected components of a mask, by runs of cells in its rows."""

import numpy as np

from slam.boards import board, cells, stride_of
from slam.geometry import Bools
from slam.sweep import Ints


def label(mask: Bools) -> Ints:
    """8-connected components: 0 outside the mask (h, w), then 1, 2, … in the order of their first cells, row by row."""
    height, width = mask.shape
    stride = stride_of(width, 1)
    begins, ends, numbers = labelled_runs(board(mask, stride), stride)
    labels = np.zeros(height * width, dtype=np.int64)
    labels[np.flatnonzero(mask.reshape(-1))] = np.repeat(numbers + 1, ends - begins)
    return labels.reshape(height, width)


def labelled_runs(board: int, stride: int) -> tuple[Ints, Ints, Ints]:
    """The board's runs of cells in a row: places (k,) of their first cells and past their last, and their components.

    8-connected; components are numbered from 0 in the order of their first cells.
    """
    borders = cells(board ^ (board << 1))  # rows end in spare columns: no run goes on into the next row
    begins, ends = borders[::2], borders[1::2]
    above, here = _touching(begins, ends, stride)
    parent = np.arange(len(begins))
    while True:
        first, second = parent[above], parent[here]
        if bool((first == second).all()):
            break
        lower = np.minimum(first, second)
        np.minimum.at(parent, first, lower)
        np.minimum.at(parent, second, lower)
        while not np.array_equal(shorter := parent[parent], parent):
            parent = shorter
    roots = parent == np.arange(len(parent))
    return begins, ends, (np.cumsum(roots) - 1)[parent]


def _touching(begins: Ints, ends: Ints, stride: int) -> tuple[Ints, Ints]:
    """Pairs (above, here) of runs in neighbouring rows that touch, corners included."""
    low = np.searchsorted(ends, begins - stride, side="left")
    high = np.searchsorted(begins, ends - stride, side="right")
    count = np.maximum(high - low, 0)
    here = np.repeat(np.arange(len(begins)), count)
    start = np.cumsum(count) - count
    return np.arange(len(here)) - start[here] + low[here], here
