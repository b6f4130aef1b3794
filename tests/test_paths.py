"""Components, inflation, paths and small linear systems against the slowest way to do each."""

import heapq
from dataclasses import replace
from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from slam.boards import as_bytes, board, cells, stride_of, within
from slam.components import label
from slam.geometry import Bools
from slam.linear import solve_spd
from slam.planning import CLOSE, DIAGONAL, LEAVING, START, STRAIGHT, TIGHT, Ground, find_path

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


def dijkstra(passable: Bools, tight: Bools, close: Bools, start: Cell) -> dict[Cell, int]:
    """What every cell costs that there is a way to; cells about a start that is not passable are dear."""
    about = np.zeros_like(passable)
    if not passable[start]:
        rows, columns = (slice(max(k - START, 0), k + START + 1) for k in start)
        about[rows, columns] = ~passable[rows, columns]
    price = np.where(about, LEAVING, tight * TIGHT + close * CLOSE)
    cost, queue = {start: 0}, [(0, start)]
    while queue:
        so_far, (row, column) = heapq.heappop(queue)
        for dr, dc in NEAR:
            there = (row + dr, column + dc)
            if not (0 <= there[0] < passable.shape[0] and 0 <= there[1] < passable.shape[1]):
                continue
            new = so_far + (DIAGONAL if dr and dc else STRAIGHT) + int(price[there])
            if (passable[there] or about[there]) and new < cost.get(there, 1 << 30):
                cost[there] = new
                heapq.heappush(queue, (new, there))
    return cost


LARGER = arrays(
    np.bool_, st.tuples(st.integers(1, 16), st.integers(1, 16)), elements=st.sampled_from([True, True, False])
)


@settings(max_examples=150, deadline=None)
@given(LARGER, st.data())
def test_a_path_is_one_of_the_cheapest(mask: Bools, data: st.DataObject) -> None:
    tight, close = (data.draw(arrays(np.bool_, mask.shape)) & mask for _ in range(2))
    places = st.tuples(st.integers(0, mask.shape[0] - 1), st.integers(0, mask.shape[1] - 1))
    start, goal = data.draw(places), data.draw(places)
    mask[goal] = True
    stride = stride_of(mask.shape[1], 1)
    ground = replace(ground_of(mask), tight=board(tight, stride), close=board(close, stride))
    costs, path = dijkstra(mask, tight, close, start), find_path(ground, start, goal)
    place = np.array([start[0] * stride + start[1]])
    reached = ground.reached(place, ground.about(start)).reshape(len(mask), stride)[:, : mask.shape[1]]
    assert np.array_equal(
        reached, mask & np.array([[(r, c) in costs for c in range(mask.shape[1])] for r in range(len(mask))])
    )
    assert (path is None) == (goal not in costs)
    if path is not None:
        way = [ground.cell(*point) for point in path.points.tolist()]
        assert (way[0], way[-1]) == (start, goal)
        steps = [costs_of_step(a, b) for a, b in pairwise(way)]
        assert all(costs[b] >= costs[a] + step for a, b, step in zip(way, way[1:], steps, strict=False))
        assert round(path.length_m / 0.05 * STRAIGHT) == sum(steps)
        assert [costs[cell] for cell in way] == sorted(costs[cell] for cell in way)


def costs_of_step(a: Cell, b: Cell) -> int:
    return DIAGONAL if abs(a[0] - b[0]) == abs(a[1] - b[1]) == 1 else STRAIGHT


@given(arrays(np.float64, (4, 4), elements=st.floats(-3, 3)), arrays(np.float64, 4, elements=st.floats(-3, 3)))
def test_a_positive_definite_system_is_solved(root: np.ndarray, right: np.ndarray) -> None:
    matrix = root @ root.T + np.eye(4)
    assert np.allclose(matrix @ solve_spd(matrix, right), right, atol=1e-8)
