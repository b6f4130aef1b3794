"""Components, inflation, paths and small linear systems against the slowest way to do each."""

import heapq

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from slam.components import label
from slam.geometry import Bools
from slam.linear import solve_spd
from slam.planning import DIAGONAL, STRAIGHT, Ground, find_path, inflate

MASKS = arrays(np.bool_, st.tuples(st.integers(1, 9), st.integers(1, 9)))
NEAR = [(dr, dc) for dr in (-1, 0, 1) for dc in (-1, 0, 1) if dr or dc]


def costs_from(mask: Bools, start: tuple[int, int]) -> dict[tuple[int, int], int]:
    """Dijkstra over the cells of the mask."""
    cost, queue = {start: 0}, [(0, start)]
    while queue:
        so_far, (row, column) = heapq.heappop(queue)
        for dr, dc in NEAR:
            there = (row + dr, column + dc)
            inside = 0 <= there[0] < mask.shape[0] and 0 <= there[1] < mask.shape[1]
            new = so_far + (DIAGONAL if dr and dc else STRAIGHT)
            if inside and mask[there] and new < cost.get(there, 1 << 30):
                cost[there] = new
                heapq.heappush(queue, (new, there))
    return cost


@given(MASKS)
def test_components_are_what_can_be_reached(mask: Bools) -> None:
    labels = label(mask)
    assert np.array_equal(labels > 0, mask)
    cells = [(int(r), int(c)) for r, c in np.argwhere(mask)]
    for cell in cells:
        assert set(costs_from(mask, cell)) == {other for other in cells if labels[other] == labels[cell]}
    assert sorted({int(labels[cell]) for cell in cells}) == list(range(1, int(labels.max(initial=0)) + 1))


@given(MASKS, st.integers(0, 4))
def test_inflation_is_every_cell_within_the_radius(mask: Bools, radius: int) -> None:
    there = np.argwhere(mask)
    expected = [
        [any((r - a) ** 2 + (c - b) ** 2 <= radius**2 for a, b in there) for c in range(mask.shape[1])]
        for r in range(mask.shape[0])
    ]
    assert np.array_equal(inflate(mask, radius), np.array(expected, dtype=bool))


@settings(max_examples=60)
@given(MASKS, st.data())
def test_a_path_is_as_cheap_as_any(mask: Bools, data: st.DataObject) -> None:
    mask[0, 0] = True
    goal = data.draw(st.sampled_from([(int(r), int(c)) for r, c in np.argwhere(mask)]))
    ground = Ground(mask, 3, -2, 0.05)
    path, best = find_path(ground, (0, 0), goal), costs_from(mask, (0, 0))
    assert (path is not None) == (goal in best) == bool(label(mask)[goal] == label(mask)[0, 0])
    if path is not None:
        assert round(path.length_m / 0.05 * STRAIGHT) == best[goal]
        assert [ground.cell(*path.points[k].tolist()) for k in (0, -1)] == [(0, 0), goal]


@given(arrays(np.float64, (4, 4), elements=st.floats(-3, 3)), arrays(np.float64, 4, elements=st.floats(-3, 3)))
def test_a_positive_definite_system_is_solved(root: np.ndarray, right: np.ndarray) -> None:
    matrix = root @ root.T + np.eye(4)
    assert np.allclose(matrix @ solve_spd(matrix, right), right, atol=1e-8)
