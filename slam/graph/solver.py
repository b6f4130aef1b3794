"""Gauss–Newton on the graph: landmarks are eliminated, what is left in the poses is solved by hand.

Each landmark is seen from few poses and two numbers long, so that its elimination (the Schur complement) is cheap; a
Cauchy kernel gives what does not fit less weight at every iteration.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.dmath import DEGREE, Floats
from slam.geometry import GRAIN, quantise, wrap
from slam.graph.config import GraphConfig
from slam.graph.odometry import motion_residuals
from slam.graph.problem import Graph, sighting_residuals
from slam.linear import solve_blocks, solve_spd
from slam.sweep import Ints

ERRORS = 4
DENSE = 80
"""Up to so many poses the normal equations are solved as if nothing in them was zero."""
SETTLED = 3e-4
"""Metres and radians: a step that small is the last: the next sweep goes on from there."""
MOTION_KERNEL = 3.0


@dataclass(frozen=True)
class Part:
    """What moves: poses from number `first` on, and the landmarks seen from them with all their sightings.

    `rows` (r,) the sightings in order of landmark, `place` (r,) each one's landmark, `slot` (r,) its pose or −1;
    `landmarks` (l,), `begin` (l + 1,) where each one's rows begin; `sweeps` the poses (p,).
    """

    first: int
    sweeps: Ints
    landmarks: Ints
    rows: Ints
    place: Ints
    slot: Ints
    begin: Ints


def part_from(graph: Graph, first: int) -> Part:
    """The poses from `first` on; the very first never moves. A landmark seen once says nothing and is left out."""
    first = max(first, 1)
    moving = np.zeros(len(graph.nature), dtype=bool)
    moving[graph.landmark[graph.sweep >= first]] = True
    moving &= (graph.counts() >= 2) & (graph.alive != 0)
    landmarks = np.flatnonzero(moving)
    rows = graph.rows_of(moving)
    rows = rows[np.argsort(graph.landmark[rows], kind="stable")]
    place = np.searchsorted(landmarks, graph.landmark[rows])
    return Part(
        first,
        np.arange(first, len(graph.poses)),
        landmarks,
        rows,
        place,
        np.maximum(graph.sweep[rows] - first, -1),
        np.searchsorted(place, np.arange(len(landmarks) + 1)),
    )


def solve(graph: Graph, part: Part, config: GraphConfig) -> Graph:
    """The graph with this part of it where the total error is least, starting from where it is."""
    for _ in range(config.iterations):
        graph, step = _iterate(graph, part, config)
        if step < SETTLED:
            break
    return replace(
        graph,
        poses=np.column_stack([quantise(graph.poses[:, :2], GRAIN), quantise(wrap(graph.poses[:, 2]), GRAIN)]),
        line=quantise(graph.line, GRAIN),
        point=quantise(graph.point, GRAIN),
        errors=quantise(graph.errors, GRAIN * GRAIN),
    )


def total_error(graph: Graph, part: Part, config: GraphConfig) -> float:
    """Of this part: the kernel's cost of every sighting and of every step."""
    seen, _, _ = sighting_residuals(graph, part.rows, config.distance_sigma_m)
    steps = motion_residuals(graph, part.sweeps, config)[0]
    return dmath.total(kernel_cost(seen, config.kernel).ravel()) + dmath.total(
        kernel_cost(steps, MOTION_KERNEL).ravel()
    )


def weights(residuals: Floats, kernel: float) -> Floats:
    """Cauchy's, by the residuals in standard deviations."""
    return np.asarray(1.0 / (1.0 + residuals * residuals / (kernel * kernel)))


def kernel_cost(residuals: Floats, kernel: float) -> Floats:
    """Cauchy's, by the residuals in standard deviations."""
    return np.asarray(kernel * kernel * dmath.log(1.0 + residuals * residuals / (kernel * kernel)))


@dataclass(frozen=True)
class _Seen:
    """The sightings' share in the normal equations: (l, 2, 2) and (l, 2) of landmarks, (r, 2, …) of each row."""

    by_pose: Floats
    residual: Floats
    by_ring: Floats
    cross: Floats  # (r, 2, 3): landmark × pose
    cross_ring: Floats  # (l, 2): landmark × RING
    inverse: Floats  # (l, 2, 2)
    right: Floats  # (l, 2)


def _iterate(graph: Graph, part: Part, config: GraphConfig) -> tuple[Graph, float]:
    poses, count = len(part.sweeps), 3 * len(part.sweeps) + ERRORS
    matrix, right = np.zeros((count, count)), np.zeros(count)
    seen = _sightings(graph, part, config)
    _add_poses(matrix, right, seen, part)
    _add_motions(matrix, right, graph, part, config)
    _add_prior(matrix, right, graph, config)
    _eliminate_landmarks(matrix, right, seen, part)
    step = solve_spd(matrix, right) if poses <= DENSE else solve_blocks(matrix, right, 3, _edges(part))
    moved = graph.poses.copy()
    moved[part.first :] += step[: 3 * poses].reshape(-1, 3)
    line, point = graph.line.copy(), graph.point.copy()
    change = _landmark_steps(step, seen, part)
    points = graph.as_point[part.landmarks] != 0
    point[part.landmarks[points]] += change[points]
    line[part.landmarks[~points]] += change[~points]
    errors = graph.errors + step[3 * poses :]
    return replace(graph, poses=moved, line=line, point=point, errors=errors), float(np.abs(step).max())


def _sightings(graph: Graph, part: Part, config: GraphConfig) -> _Seen:
    residual, by_pose, by_landmark = sighting_residuals(graph, part.rows, config.distance_sigma_m)
    root = np.sqrt(weights(residual, config.kernel))
    residual, by_pose, by_landmark = residual * root, by_pose * root[:, :, None], by_landmark * root[:, :, None]
    by_ring = -root[:, 0] / graph.sigma[part.rows]
    by_pose = np.where((part.slot >= 0)[:, None, None], by_pose, 0.0)
    size = len(part.landmarks)

    def summed(values: Floats) -> Floats:
        return np.asarray(np.bincount(part.place, weights=values, minlength=size), dtype=np.float64)

    def pairs(a: int, b: int) -> Floats:
        return summed(by_landmark[:, 0, a] * by_landmark[:, 0, b] + by_landmark[:, 1, a] * by_landmark[:, 1, b])

    # A line seen from one place only is tied by one bearing and one distance; this keeps the elimination defined.
    first, mixed, second = pairs(0, 0) + 1e-6, pairs(0, 1), pairs(1, 1) + 1e-6
    determinant = first * second - mixed * mixed
    inverse = np.stack([second, -mixed, -mixed, first], axis=1).reshape(-1, 2, 2) / determinant[:, None, None]
    cross = by_landmark[:, 0, :, None] * by_pose[:, 0, None, :] + by_landmark[:, 1, :, None] * by_pose[:, 1, None, :]
    return _Seen(
        by_pose=by_pose,
        residual=residual,
        by_ring=by_ring,
        cross=cross,
        cross_ring=np.stack([summed(by_landmark[:, 0, a] * by_ring) for a in (0, 1)], axis=1),
        inverse=inverse,
        right=np.stack(
            [summed(by_landmark[:, 0, a] * residual[:, 0] + by_landmark[:, 1, a] * residual[:, 1]) for a in (0, 1)],
            axis=1,
        ),
    )


def _add_poses(matrix: Floats, right: Floats, seen: _Seen, part: Part) -> None:
    """The sightings' own share in the poses and in RING."""
    rows = np.flatnonzero(part.slot >= 0)
    by_ring = np.stack([seen.by_ring, np.zeros(len(seen.by_ring))], axis=1)
    jacobian = np.concatenate([seen.by_pose, by_ring[:, :, None]], axis=2)
    ring = len(right) - 1
    at = np.concatenate([3 * part.slot[:, None] + np.arange(3), np.full((len(part.slot), 1), ring)], axis=1)
    _add(matrix, right, jacobian[rows], seen.residual[rows], at[rows])
    still = part.slot < 0
    matrix[ring, ring] += dmath.total(np.where(still, seen.by_ring * seen.by_ring, 0.0))
    right[ring] += dmath.total(np.where(still, seen.by_ring * seen.residual[:, 0], 0.0))


def _add_motions(matrix: Floats, right: Floats, graph: Graph, part: Part, config: GraphConfig) -> None:
    residual, by_former, by_latter, by_errors = motion_residuals(graph, part.sweeps, config)
    root = np.sqrt(weights(residual, MOTION_KERNEL))
    jacobian = np.concatenate([by_former, by_latter, by_errors], axis=2) * root[:, :, None]
    # The pose before the first that moves stays.
    jacobian[:1, :, :3] = 0.0
    latter = 3 * np.arange(len(part.sweeps))[:, None] + np.arange(3)
    errors = np.repeat(np.arange(len(right) - ERRORS, len(right))[None, :], len(latter), axis=0)
    at = np.concatenate([np.maximum(latter - 3, 0), latter, errors], axis=1)
    _add(matrix, right, jacobian, -residual * root, at)


def _add(matrix: Floats, right: Floats, jacobian: Floats, residual: Floats, at: Ints) -> None:
    """JᵀJ and Jᵀr of rows with Jacobians (n, q, c) and residuals (n, q), whose columns are the unknowns `at` (n, c)."""
    squares = np.zeros((*at.shape, at.shape[1]))
    toward = np.zeros(at.shape)
    for q in range(jacobian.shape[1]):
        squares += jacobian[:, q, :, None] * jacobian[:, q, None, :]
        toward += jacobian[:, q] * residual[:, q, None]
    np.add.at(matrix, (at[:, :, None], at[:, None, :]), squares)
    np.add.at(right, at, toward)


def _dot(a: Floats, b: Floats) -> Floats:
    """Row by row, of (n, 3) and (n, 3)."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2])


def _add_prior(matrix: Floats, right: Floats, graph: Graph, config: GraphConfig) -> None:
    """What is believed of the wheels before anything is seen; of their rotation, what each sweep by itself says."""
    believed = np.array([graph.rotation_prior[0], 0.0, 0.0, 0.0])
    drift, ring = config.drift_sigma_deg * DEGREE, config.ring_sigma_deg * DEGREE
    sigma = np.array([graph.rotation_prior[1], config.scale_sigma, drift, ring])
    weight = 1.0 / (sigma * sigma)
    at = np.arange(len(right) - ERRORS, len(right))
    matrix[at, at] += weight
    right[at] += weight * (believed - graph.errors)


def _eliminate_landmarks(matrix: Floats, right: Floats, seen: _Seen, part: Part) -> None:
    """Schur's complement: each landmark ties the poses that saw it to one another.

    Most are seen for a while and then no more: from the first pose that saw one to the last is a square of the matrix.
    """
    ring, begin = len(right) - 1, part.begin.tolist()
    inverse = seen.inverse
    toward, own = (
        np.stack([inverse[:, a, 0] * v[:, 0] + inverse[:, a, 1] * v[:, 1] for a in (0, 1)], axis=1)
        for v in (seen.right, seen.cross_ring)
    )
    matrix[ring, ring] -= dmath.total((seen.cross_ring * own).ravel())
    right[ring] -= dmath.total((seen.cross_ring * toward).ravel())
    for k in range(len(part.landmarks)):
        rows = np.arange(begin[k], begin[k + 1])
        rows = rows[part.slot[rows] >= 0]
        if not len(rows):
            continue
        at = part.slot[rows]
        low, high = 3 * int(at[0]), 3 * int(at[-1]) + 3
        both = np.zeros(((high - low) // 3, 2, 3))
        np.add.at(both, at - at[0], seen.cross[rows])  # merged chains may be seen twice in one sweep
        first, second = both[:, 0].ravel(), both[:, 1].ravel()
        square = matrix[low:high, low:high]
        for a, line in ((0, first), (1, second)):
            square -= line[:, None] * (inverse[k, a, 0] * first + inverse[k, a, 1] * second)[None, :]
        edge = first * own[k, 0] + second * own[k, 1]
        matrix[low:high, ring] -= edge
        matrix[ring, low:high] -= edge
        right[low:high] -= first * toward[k, 0] + second * toward[k, 1]


def _landmark_steps(step: Floats, seen: _Seen, part: Part) -> Floats:
    """How far each landmark moves (l, 2), once the poses' steps are known."""
    moved = np.concatenate([np.zeros((1, 3)), step[: 3 * len(part.sweeps)].reshape(-1, 3)])[part.slot + 1]
    left = []
    for a in (0, 1):
        told = np.bincount(part.place, weights=_dot(seen.cross[:, a], moved), minlength=len(part.landmarks))
        left.append(seen.right[:, a] - told - seen.cross_ring[:, a] * step[-1])
    inverse = seen.inverse
    return np.stack([inverse[:, a, 0] * left[0] + inverse[:, a, 1] * left[1] for a in (0, 1)], axis=1)


def _edges(part: Part) -> list[set[int]]:
    """Which poses are tied to which: the next one, and those that see the same landmark."""
    poses = len(part.sweeps)
    edges: list[set[int]] = [{k for k in (i - 1, i + 1) if 0 <= k < poses} for i in range(poses)]
    begin = part.begin.tolist()
    for k in range(len(part.landmarks)):
        seers = {slot for slot in part.slot[begin[k] : begin[k + 1]].tolist() if slot >= 0}
        for slot in sorted(seers):
            edges[slot] |= seers
    return edges
