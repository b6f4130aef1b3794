"""Gauss–Newton on the graph: landmarks are eliminated, what is left in the poses is solved by hand.

A Cauchy kernel gives what does not fit less weight at every iteration.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.dmath import DEGREE, Floats
from slam.geometry import GRAIN, Bools, quantise, wrap
from slam.graph.config import GraphConfig
from slam.graph.normal import Layout, Part, normal_equations
from slam.graph.odometry import Steps, motion_residuals
from slam.graph.problem import RING, Graph, Sightings, sighting_residuals
from slam.linear import elimination, solve_blocks, solve_joined
from slam.sweep import Ints

DENSE = 80
"""Up to so many poses the normal equations are solved as if nothing in them was zero."""
SETTLED = 6e-4
"""Metres and radians: a step that small is the last: the next sweep goes on from there."""
MOTION_KERNEL = 3.0


def part_from(graph: Graph, first: int) -> Part:
    """The poses from `first` on; the very first never moves. A landmark seen once says nothing and is left out."""
    first = max(first, 1)
    moving = np.zeros(len(graph.nature), dtype=bool)
    moving[graph.landmark[graph.sweep >= first]] = True
    moving &= (graph.counts() >= 2) & (graph.alive != 0)
    landmarks = np.flatnonzero(moving)
    rows = graph.rows_of(landmarks)
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
    problem = _Problem.of(graph, part, config)
    at = _Unknowns(graph.poses, graph.line, graph.point, graph.errors)
    for _ in range(config.iterations):
        at, step = _iterate(at, problem)
        if step < SETTLED:
            break
    return replace(
        graph,
        poses=np.column_stack([quantise(at.poses[:, :2], GRAIN), quantise(wrap(at.poses[:, 2]), GRAIN)]),
        line=quantise(at.line, GRAIN),
        point=quantise(at.point, GRAIN),
        errors=quantise(at.errors, GRAIN * GRAIN),
    )


def total_error(graph: Graph, part: Part, config: GraphConfig) -> float:
    """Of this part: the kernel's cost of every sighting and of every step."""
    seen, _, _ = sighting_residuals(graph, part.rows, config.distance_sigma_m)
    steps = step_costs(graph, part.sweeps, config)
    return dmath.total(kernel_cost(seen, config.kernel).ravel()) + dmath.total(steps)


def step_costs(graph: Graph, sweeps: Ints, config: GraphConfig) -> Floats:
    """The kernel's cost of each of the steps to these sweeps (s,)."""
    return kernel_cost(_whole(motion_residuals(graph, sweeps, config)[0]), MOTION_KERNEL)


def prior_error(graph: Graph, config: GraphConfig) -> float:
    """What the errors of the wheels, as they are thought to be, cost by themselves."""
    believed, information = _prior(graph, config).T
    off = graph.errors - believed
    return dmath.total(information * (off * off))


def weights(residuals: Floats, kernel: float) -> Floats:
    """Cauchy's, by the residuals in standard deviations."""
    return np.asarray(1.0 / (1.0 + residuals * residuals / (kernel * kernel)))


def kernel_cost(residuals: Floats, kernel: float) -> Floats:
    """Cauchy's, by the residuals in standard deviations."""
    return np.asarray(kernel * kernel * dmath.log(1.0 + residuals * residuals / (kernel * kernel)))


def _whole(steps: Floats) -> Floats:
    """Of residuals (s, 3) the length (s,): a step is wild as a whole; one that was not driven says nothing of turns."""
    return np.sqrt(np.cumsum(steps * steps, axis=1)[:, -1])


@dataclass(frozen=True)
class _Unknowns:
    """Where everything is thought to be, as in `Graph`."""

    poses: Floats
    line: Floats
    point: Floats
    errors: Floats


@dataclass(frozen=True)
class _Problem:
    """What stays the same from one iteration to the next.

    `still` (r,): seen from a pose that does not move. `prior` (4, 2): what is believed of the errors, and 1/σ².
    `order`: that of elimination, where the poses are many.
    """

    part: Part
    layout: Layout
    sightings: Sightings
    still: Bools
    steps: Steps
    points: Ints
    lines: Ints
    prior: Floats
    kernel: float
    order: list[tuple[int, list[int]]] | None

    @classmethod
    def of(cls, graph: Graph, part: Part, config: GraphConfig) -> "_Problem":
        is_point = graph.as_point[part.landmarks] != 0
        return cls(
            part,
            Layout.of(part),
            Sightings.of(graph, part.rows, config.distance_sigma_m),
            part.slot < 0,
            Steps.of(graph, part.sweeps, config),
            np.flatnonzero(is_point),
            np.flatnonzero(~is_point),
            _prior(graph, config),
            config.kernel,
            elimination(_edges(part)) if len(part.sweeps) > DENSE else None,
        )


def _prior(graph: Graph, config: GraphConfig) -> Floats:
    """What is believed of the wheels before anything is seen; of their rotation, what each sweep by itself says."""
    rotation, sigma = graph.rotation_prior.tolist()
    drift, ring = config.drift_sigma_deg * DEGREE, config.ring_sigma_deg * DEGREE
    sigmas = np.array([sigma, config.scale_sigma, drift, ring])
    return np.stack([np.array([rotation, 0.0, 0.0, 0.0]), 1.0 / (sigmas * sigmas)], axis=1)


def _iterate(at: _Unknowns, problem: _Problem) -> tuple[_Unknowns, float]:
    """One step of Gauss and Newton, and the largest move of a pose or an error in it."""
    part, believed, information = problem.part, problem.prior[:, 0], problem.prior[:, 1]
    prior = np.stack([information, information * (believed - at.errors)], axis=1)
    sightings, steps = _sighting_rows(at, problem), _step_rows(at, problem)
    matrix, landmarks = normal_equations(problem.layout, sightings, steps, prior)
    count = len(part.sweeps)
    step = solve_joined(matrix) if problem.order is None else solve_blocks(matrix, 3, problem.order)
    poses, line, point = at.poses.copy(), at.line.copy(), at.point.copy()
    poses[part.first :] += step[: 3 * count].reshape(-1, 3)
    change = landmarks.steps(step)
    point[part.landmarks[problem.points], :2] += change[problem.points]
    line[part.landmarks[problem.lines]] += change[problem.lines]
    return _Unknowns(poses, line, point, at.errors + step[3 * count :]), float(np.abs(step).max())


def _sighting_rows(at: _Unknowns, problem: _Problem) -> Floats:
    """Weighed by the kernel (r, 2, 7): by pose (3), RING, residual, landmark (2)."""
    sightings = problem.sightings
    residual, by_pose, by_landmark = sightings.residuals(at.poses, at.line, at.point, float(at.errors[RING]))
    rows = np.zeros((len(residual), 2, 7))
    rows[:, :, :3], rows[:, :, 4], rows[:, :, 5:] = by_pose, residual, by_landmark
    rows[:, 0, 3] = -sightings.scale[:, 0]
    rows[problem.still, :, :3] = 0.0
    rows *= np.sqrt(weights(residual, problem.kernel))[:, :, None]
    return rows


def _step_rows(at: _Unknowns, problem: _Problem) -> Floats:
    """Weighed by the kernel (s, 3, 11): by former pose, latter pose, errors, and what is to be explained."""
    rows = problem.steps.residuals(at.poses, at.errors)
    rows *= np.sqrt(weights(_whole(rows[:, :, 10]), MOTION_KERNEL))[:, None, None]
    rows[:, :, 10] *= -1.0
    rows[:1, :, :3] = 0.0  # the pose before the first that moves stays
    return rows


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
