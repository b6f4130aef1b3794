"""Components, inflation, paths and small linear systems against the slowest way to do each."""

import heapq

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from slam.boards import as_bytes, board, cells, stride_of, within
from slam.components import label
from slam.geometry import Bools
from slam.linear import solve_spd
from slam.planning import DIAGONAL, START, STRAIGHT, Ground, find_path, least

Cell = tuple[int, int]
MASKS = arrays(np.bool_, st.tuples(st.integers(1, 9), st.integers(1, 9)))
NEAR = [(dr, dc) for dr in (-1, 0, 1) for dc in (-1, 0, 1) if dr or dc]


def ground_of(mask: Bools) -> Ground:
    stride = stride_of(mask.shape[1], 1)
    return Ground(board(mask, stride), stride, mask.shape, 3, -2, 0.05)


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


@given(MASKS)
def test_a_board_holds_what_the_mask_does(mask: Bools) -> None:
    stride = stride_of(mask.shape[1], 1)
    places = cells(board(mask, stride))
    assert [divmod(int(place), stride) for place in places] == [(r, c) for r, c in np.argwhere(mask).tolist()]
    assert np.array_equal(np.flatnonzero(np.frombuffer(as_bytes(board(mask, stride), stride, len(mask)), "u1")), places)


@given(MASKS, st.integers(0, 4))
def test_inflation_is_every_cell_within_the_radius(mask: Bools, radius: int) -> None:
    there = np.argwhere(mask)
    expected = [
        [any((r - a) ** 2 + (c - b) ** 2 <= radius**2 for a, b in there) for c in range(mask.shape[1])]
        for r in range(mask.shape[0])
    ]
    stride = stride_of(mask.shape[1], radius + 1)
    grown = within(board(mask, stride), stride, radius) & board(np.ones_like(mask), stride)
    assert grown == board(np.array(expected, dtype=bool), stride)


def a_star(passable: Bools, start: Cell, goal: Cell) -> list[Cell] | None:
    """Over all cells; of equals what is nearest to the goal goes on, then what comes first by rows."""
    cost, came, done = {start: 0}, {start: start}, set()
    queue = [(least(start, goal), 0, start)]
    while queue:
        _, _, here = heapq.heappop(queue)
        if here == goal:
            way = [here]
            while came[way[-1]] != way[-1]:
                way.append(came[way[-1]])
            return way[::-1]
        if here in done:
            continue
        done.add(here)
        for dr, dc in NEAR:
            there = (here[0] + dr, here[1] + dc)
            if not (0 <= there[0] < passable.shape[0] and 0 <= there[1] < passable.shape[1]):
                continue
            far = max(abs(there[0] - start[0]), abs(there[1] - start[1])) > START
            if not passable[there] and (passable[here] or far):
                continue
            new = cost[here] + (DIAGONAL if dr and dc else STRAIGHT)
            if there not in cost or new < cost[there]:
                cost[there], came[there] = new, here
                heapq.heappush(queue, (new + least(there, goal), least(there, goal), there))
    return None


LARGER = arrays(
    np.bool_, st.tuples(st.integers(1, 16), st.integers(1, 16)), elements=st.sampled_from([True, True, False])
)


@settings(max_examples=150, deadline=None)
@given(LARGER, st.data())
def test_the_path_is_the_one_that_a_star_takes_over_all_cells(mask: Bools, data: st.DataObject) -> None:
    places = st.tuples(st.integers(0, mask.shape[0] - 1), st.integers(0, mask.shape[1] - 1))
    start, goal = data.draw(places), data.draw(places)
    mask[goal] = True
    ground = ground_of(mask)
    path, expected = find_path(ground, start, goal), a_star(mask, start, goal)
    assert (None if path is None else [ground.cell(*point) for point in path.points.tolist()]) == expected
    if expected is not None:
        assert ground.reachable(start, [goal]) == [True]
    if path is not None and mask[start]:
        assert round(path.length_m / 0.05 * STRAIGHT) == costs_from(mask, start)[goal]


@given(arrays(np.float64, (4, 4), elements=st.floats(-3, 3)), arrays(np.float64, 4, elements=st.floats(-3, 3)))
def test_a_positive_definite_system_is_solved(root: np.ndarray, right: np.ndarray) -> None:
    matrix = root @ root.T + np.eye(4)
    assert np.allclose(matrix @ solve_spd(matrix, right), right, atol=1e-8)
