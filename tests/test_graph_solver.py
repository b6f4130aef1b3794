"""Linear systems solved by hand against numpy's, and the graph's elimination of landmarks against solving for all."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.dmath import DEGREE, Floats
from slam.errors import SlamError
from slam.geometry import Pose, wrap
from slam.graph import solver
from slam.graph.config import GraphConfig
from slam.graph.normal import Part
from slam.graph.odometry import motion_residuals
from slam.graph.problem import RING, Graph, sighting_residuals
from slam.graph.solver import MOTION_KERNEL, part_from, solve, total_error, weights
from slam.linear import elimination, solve_blocks, solve_spd
from tests.graphs import Line, Spot, graph_of, shaken

seeds = st.integers(0, 2**32 - 1)
CONFIG = GraphConfig()


@given(seeds, st.integers(1, 30))
@settings(max_examples=40, deadline=None)
def test_dense_systems(seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(size, size))
    matrix, right = half @ half.T + 0.1 * np.eye(size), rng.normal(size=size)
    assert solve_spd(matrix, right) == pytest.approx(np.linalg.solve(matrix, right), rel=1e-7, abs=1e-9)


@given(seeds, st.integers(1, 12), st.integers(1, 3), st.integers(0, 4))
@settings(max_examples=60, deadline=None)
def test_sparse_systems_of_blocks_with_a_tail_that_touches_all(seed: int, blocks: int, size: int, tail: int) -> None:
    rng = np.random.default_rng(seed)
    edges: list[set[int]] = [set() for _ in range(blocks)]
    count = size * blocks + tail
    matrix = np.zeros((count, count))

    def tie(unknowns: list[int]) -> None:
        row = np.zeros(count)
        row[unknowns] = rng.normal(size=len(unknowns))
        nonlocal matrix
        matrix = matrix + np.outer(row, row)

    ends = list(range(size * blocks, count))
    for _ in range(3 * blocks):
        a, b = rng.integers(0, blocks, 2).tolist()
        edges[a].add(b)
        edges[b].add(a)
        tie([*range(size * a, size * a + size), *(range(size * b, size * b + size) if b != a else []), *ends])
    matrix += np.diag(rng.uniform(0.1, 1.0, count))
    right = rng.normal(size=count)
    expected = np.linalg.solve(matrix, right)
    assert solve_blocks(np.column_stack([matrix, right]), size, elimination(edges)) == pytest.approx(
        expected, rel=1e-7, abs=1e-9
    )


@pytest.mark.parametrize("matrix", [np.zeros((2, 2)), -np.eye(2), np.ones((2, 2)), np.full((2, 2), np.nan)])
def test_what_is_not_positive_definite_is_refused_by_name(matrix: Floats) -> None:
    with pytest.raises(SlamError, match="singular in unknown"):
        solve_spd(matrix, np.ones(2))
    with pytest.raises(SlamError, match="singular in unknown"):
        solve_blocks(np.column_stack([matrix, np.ones(2)]), 1, elimination([{1}, {0}]))


def test_what_touches_fewest_is_eliminated_first() -> None:
    """A star: its rays have one neighbour each, its hub comes when two are left."""
    assert [block for block, _ in elimination([{1, 2, 3}, {0}, {0}, {0}])] == [1, 2, 0, 3]


WORLD: list[Line | Spot] = [
    Line(np.pi / 2, 1.0),
    Line(-np.pi / 2, 1.0),
    Line(0.1, 6.0),
    Spot(2.0, -0.7),
    Spot(-1.0, 0.9),
]
TRACK = [Pose(0.5 * k, 0.02 * k, 0.05 * k) for k in range(7)]
SEEN = [(s, t) for s in range(7) for t in range(5) if (s * 3 + t) % 4]


def dense_step(graph: Graph, part: Part) -> Floats:
    """One step of Gauss and Newton for poses, errors and landmarks together: the normal equations written out."""
    poses, landmarks = len(part.sweeps), len(part.landmarks)
    count = 3 * poses + 4 + 2 * landmarks
    matrix, right = np.zeros((count, count)), np.zeros(count)

    def add(row: Floats, residual: float, weight: float) -> None:
        nonlocal matrix, right
        matrix = matrix + weight * np.outer(row, row)
        right = right + weight * row * residual

    residual, by_pose, by_landmark = sighting_residuals(graph, part.rows, CONFIG.distance_sigma_m)
    weight = weights(residual, CONFIG.kernel)
    for r in range(len(part.rows)):
        for q in (0, 1):
            row = np.zeros(count)
            if part.slot[r] >= 0:
                row[3 * part.slot[r] : 3 * part.slot[r] + 3] = by_pose[r, q]
            row[3 * poses + RING] = -1.0 / graph.sigma[part.rows[r]] if q == 0 else 0.0
            at = 3 * poses + 4 + 2 * part.place[r]
            row[at : at + 2] = by_landmark[r, q]
            add(row, residual[r, q], weight[r, q])
    left, by_former, by_latter, by_errors = motion_residuals(graph, part.sweeps, CONFIG)
    weight = np.repeat(weights(np.sqrt((left * left).sum(axis=1)), MOTION_KERNEL)[:, None], 3, axis=1)
    for s in range(poses):
        for q in range(3):
            row = np.zeros(count)
            if s:
                row[3 * s - 3 : 3 * s] = by_former[s, q]
            row[3 * s : 3 * s + 3] = by_latter[s, q]
            row[3 * poses : 3 * poses + 4] = by_errors[s, q]
            add(row, -left[s, q], weight[s, q])
    sigma = [
        graph.rotation_prior[1],
        CONFIG.scale_sigma,
        CONFIG.drift_sigma_deg * DEGREE,
        CONFIG.ring_sigma_deg * DEGREE,
    ]
    for k in range(4):
        row = np.zeros(count)
        row[3 * poses + k] = 1.0 / sigma[k]
        add(row, ([graph.rotation_prior[0], 0, 0, 0][k] - graph.errors[k]) / sigma[k], 1.0)
    matrix += np.diag([0.0] * (3 * poses + 4) + [1e-6] * (2 * landmarks))
    return np.asarray(np.linalg.solve(matrix, right))


def iterated(graph: Graph, part: Part) -> tuple[solver._Unknowns, float]:
    start = solver._Unknowns(graph.poses, graph.line, graph.point, graph.errors)
    return solver._iterate(start, solver._Problem.of(graph, part, CONFIG))


@pytest.mark.parametrize("first", [1, 3], ids=["all", "window"])
@pytest.mark.parametrize("dense", [80, 0], ids=["dense", "sparse"])
@pytest.mark.parametrize("seed", range(3))
def test_eliminating_landmarks_is_solving_for_them(
    first: int, dense: int, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(solver, "DENSE", dense)
    graph = shaken(graph_of(TRACK, WORLD, SEEN), seed)
    part = part_from(graph, first)
    assert len(part.landmarks) == len(WORLD)
    step = dense_step(graph, part)
    moved, largest = iterated(graph, part)
    poses, count = 3 * len(part.sweeps), len(part.landmarks)
    assert (moved.poses - graph.poses)[first:].ravel() == pytest.approx(step[:poses], abs=1e-8)
    assert (moved.poses == graph.poses)[:first].all()
    assert moved.errors - graph.errors == pytest.approx(step[poses : poses + 4], abs=1e-8)
    points = graph.as_point[part.landmarks] != 0
    change = np.where(points[:, None], (moved.point - graph.point)[:, :2], moved.line - graph.line)[part.landmarks]
    assert change.ravel() == pytest.approx(step[poses + 4 :], abs=1e-8)
    assert largest == pytest.approx(np.abs(step[: poses + 4]).max())
    assert len(change) == count


def test_a_landmark_seen_twice_from_one_pose_is_eliminated_like_any_other() -> None:
    """So it is where chains have merged."""
    graph = shaken(graph_of(TRACK, WORLD, sorted([*SEEN, (2, 0), (3, 3), (5, 1)])), 4)
    part = part_from(graph, 1)
    moved, _ = iterated(graph, part)
    step = dense_step(graph, part)
    assert (moved.poses - graph.poses)[1:].ravel() == pytest.approx(step[: 3 * len(part.sweeps)], abs=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_from_a_shaken_start_back_to_the_true_world(seed: int) -> None:
    true = graph_of(TRACK, WORLD, SEEN)
    start = shaken(true, seed, 0.02)
    found = solve(start, part_from(start, 1), replace(CONFIG, iterations=30))
    assert np.abs(found.poses - true.poses).max() < 1e-4
    assert np.abs(found.errors).max() < 1e-4
    assert np.abs(wrap(found.line[:3] - true.line[:3])).max() < 1e-3
    assert np.abs(found.point[3:] - true.point[3:]).max() < 1e-3


def test_solving_never_adds_to_the_total_error() -> None:
    start = shaken(graph_of(TRACK, WORLD, SEEN), 7)
    part = part_from(start, 1)
    assert total_error(solve(start, part, CONFIG), part, CONFIG) < total_error(start, part, CONFIG)


def test_one_wild_sighting_hardly_moves_the_pose() -> None:
    true = graph_of(TRACK, WORLD, SEEN)
    distance = true.distance.copy()
    distance[10] += 0.5
    wild = replace(true, distance=distance)
    found = solve(wild, part_from(wild, 1), CONFIG)
    assert np.abs(found.poses - true.poses).max() < 0.002
