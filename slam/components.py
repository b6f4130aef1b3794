"""Connected components of a mask, by runs of cells in its rows."""

import numpy as np

from slam.geometry import Bools
from slam.sweep import Ints


def label(mask: Bools) -> Ints:
    """8-connected components: 0 outside the mask (h, w), then 1, 2, … in the order of their first cells, row by row."""
    height, width = mask.shape
    edges = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, begins = np.nonzero(edges == 1)
    ends = np.nonzero(edges == -1)[1]  # one past the last cell; a row's ends come in the order of its begins
    parent = list(range(len(rows)))
    first = np.searchsorted(rows, np.arange(height + 1)).tolist()
    _join(first, begins.tolist(), ends.tolist(), parent)
    roots = [_root(parent, run) for run in range(len(parent))]
    number = {root: k + 1 for k, root in enumerate(dict.fromkeys(roots))}
    numbers = np.array([number[root] for root in roots], dtype=np.int64)
    labels = np.zeros(height * width, dtype=np.int64)
    labels[np.flatnonzero(mask.reshape(-1))] = np.repeat(numbers, ends - begins)
    return labels.reshape(height, width)


def _join(first: list[int], begins: list[int], ends: list[int], parent: list[int]) -> None:
    """Join each run with those of the row before that it touches, corners included; `first[r]` is row r's first run."""
    for row in range(1, len(first) - 1):
        above, here = first[row - 1], first[row]
        while above < first[row] and here < first[row + 1]:
            if begins[above] <= ends[here] and begins[here] <= ends[above]:
                a, b = _root(parent, above), _root(parent, here)
                parent[max(a, b)] = min(a, b)
            if ends[above] < ends[here]:
                above += 1
            else:
                here += 1


def _root(parent: list[int], run: int) -> int:
    while parent[run] != run:
        parent[run] = parent[parent[run]]
        run = parent[run]
    return run
