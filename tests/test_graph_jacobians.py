"""Every derivative of the least-squares problem against differences of what it is the derivative of."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.dmath import DEGREE, Floats
from slam.geometry import Pose, wrap
from slam.graph.config import GraphConfig
from slam.graph.odometry import motion_residuals, slip
from slam.graph.problem import ROTATION, Graph, looks, sighting_residuals
from slam.motion import Motion, WheelErrors
from tests.graphs import Line, Spot, graph_of

STEP = 1e-6
angles = st.floats(-3.1, 3.1)
coordinates = st.floats(-3.0, 3.0)
poses = st.builds(Pose, coordinates, coordinates, angles)


def difference(of: Callable[[Floats], Floats], at: Floats) -> Floats:
    """The derivative of `of` by each entry of `at` (k,), as the last axis."""
    columns = []
    for k in range(len(at)):
        step = np.zeros(len(at))
        step[k] = STEP
        columns.append((of(at + step) - of(at - step)) / (2.0 * STEP))
    return np.stack(columns, axis=-1)


def close(found: Floats, expected: Floats) -> None:
    scale = max(1.0, float(np.abs(expected).max()))
    assert np.abs(found - expected).max() <= 1e-6 * scale


@given(
    poses, st.booleans(), st.tuples(angles, coordinates), st.tuples(coordinates, coordinates), st.floats(-0.02, 0.02)
)
@settings(max_examples=60, deadline=None)
def test_how_a_landmark_looks(
    pose: Pose, is_point: bool, line: tuple[float, float], point: tuple[float, float], ring: float
) -> None:
    here = np.array([pose.x, pose.y, pose.theta])
    if is_point and math.hypot(point[0] - pose.x, point[1] - pose.y) < 0.1:
        return

    def of(at: Floats, thing: Floats) -> Floats:
        args = (np.array([thing]), np.array([thing]), np.array([[0.3, -0.2]]), ring)
        seen = looks(at[None, :], np.array([is_point]), *args)
        start = looks(here[None, :], np.array([is_point]), *args)
        return np.array([start.bearing[0] + wrap(float(seen.bearing[0] - start.bearing[0])), seen.distance[0]])

    thing = np.array((*point, 0.07) if is_point else line)
    args = (np.array([thing]), np.array([thing]), np.array([[0.3, -0.2]]), ring)
    seen = looks(here[None, :], np.array([is_point]), *args)
    close(seen.by_pose[0], difference(lambda at: of(at, thing), here))

    def by_thing(at: Floats) -> Floats:
        other = looks(
            here[None, :], np.array([is_point]), np.array([at]), np.array([at]), np.array([[0.3, -0.2]]), ring
        )
        return np.array([wrap(float(other.bearing[0] - seen.bearing[0])), other.distance[0]])

    close(seen.by_landmark[0], difference(by_thing, thing)[:, :2])


def test_a_line_and_a_point_look_as_one_works_out_by_hand() -> None:
    here = np.array([[2.0, 1.0, math.radians(30)]])
    wall = looks(
        here, np.array([False]), np.array([[math.pi / 2, 0.1]]), np.zeros((1, 2)), np.array([[5.0, 2.4]]), 0.01
    )
    assert (wall.bearing[0], wall.distance[0]) == pytest.approx((math.radians(60) - 0.01, 1.5))
    spot = looks(here, np.array([True]), np.zeros((1, 2)), np.array([[5.0, 5.0, 0.2]]), np.zeros((1, 2)), 0.0)
    assert (spot.bearing[0], spot.distance[0]) == pytest.approx((math.atan2(4, 3) - math.radians(30), 4.8))


WORLD: list[Line | Spot] = [Line(math.pi / 2, 1.0), Line(-1.0, 2.0), Spot(2.0, -0.7)]
TRACK = [Pose(0.0, 0.0, 0.0), Pose(0.8, 0.05, 0.1), Pose(1.5, -0.1, -0.3)]
SEEN = [(0, 0), (0, 2), (1, 0), (1, 1), (2, 1), (2, 2)]


def test_sightings_of_the_true_world_leave_nothing_over() -> None:
    residual, _, _ = sighting_residuals(graph_of(TRACK, WORLD, SEEN), np.arange(len(SEEN)), 0.005)
    assert np.abs(residual).max() < 1e-9


def with_noise(graph: Graph) -> Graph:
    wave = np.sin(np.arange(len(graph.bearing)))
    return replace(graph, bearing=graph.bearing + 0.01 * wave, distance=graph.distance - 0.02 * wave)


@pytest.mark.parametrize("row", range(len(SEEN)))
def test_sighting_residuals(row: int) -> None:
    """The Jacobians are those of what is expected: of minus the residual."""
    graph = with_noise(graph_of(TRACK, WORLD, SEEN))
    sweep, landmark = SEEN[row]
    _, by_pose, by_landmark = sighting_residuals(graph, np.array([row]), 0.005)

    def expected(changed: Graph) -> Floats:
        return np.asarray(-sighting_residuals(changed, np.array([row]), 0.005)[0][0])

    def at_pose(at: Floats) -> Floats:
        moved = graph.poses.copy()
        moved[sweep] = at
        return expected(replace(graph, poses=moved))

    name = "point" if graph.as_point[landmark] else "line"

    def at_landmark(at: Floats) -> Floats:
        moved = getattr(graph, name).copy()
        moved[landmark] = at
        return expected(replace(graph, **{name: moved}))

    def at_ring(at: Floats) -> Floats:
        return expected(replace(graph, errors=np.append(graph.errors[:3], at)))

    close(by_pose[0], difference(at_pose, graph.poses[sweep]))
    close(by_landmark[0], difference(at_landmark, getattr(graph, name)[landmark])[:, :2])
    close(np.array([[-1.0 / graph.sigma[row]], [0.0]]), difference(at_ring, graph.errors[3:]))


motions = st.tuples(coordinates, coordinates, *[st.floats(-7.0, 7.0)] * 3)
errors = st.tuples(st.floats(-0.03, 0.03), st.floats(-0.05, 0.05), st.floats(-0.02, 0.02), st.floats(-0.01, 0.01))


def stepped(motion: tuple[float, ...], former: Pose, latter: Pose, errors: tuple[float, ...]) -> Graph:
    graph = graph_of([former, latter], [], [])
    return replace(graph, motions=np.array([[0.0] * 5, motion]), errors=np.array(errors))


@given(motions, poses, errors, st.tuples(*[st.floats(-0.05, 0.05)] * 3))
@settings(max_examples=60, deadline=None)
def test_motion_residuals(
    motion: tuple[float, ...], former: Pose, wrong: tuple[float, ...], off: tuple[float, ...]
) -> None:
    step = Motion(*motion).corrected(WheelErrors(*wrong[:3]))
    at = former.compose(step)
    latter = Pose(at.x + off[0], at.y + off[1], at.theta + off[2])
    if math.hypot(step.x, step.y) < 0.05:
        return
    graph, config, sweeps = stepped(motion, former, latter, wrong), GraphConfig(), np.array([1])
    residual, by_former, by_latter, by_errors = motion_residuals(graph, sweeps, config)

    def at_pose(number: int) -> Callable[[Floats], Floats]:
        def moved(values: Floats) -> Floats:
            places = graph.poses.copy()
            places[number] = values
            return np.asarray(motion_residuals(replace(graph, poses=places), sweeps, config)[0][0])

        return moved

    close(by_former[0], difference(at_pose(0), graph.poses[0]))
    close(by_latter[0], difference(at_pose(1), graph.poses[1]))

    # How the weights themselves hang on the errors is left out by Gauss and Newton: with nothing left over it is 0.
    exact = np.array([[former.x, former.y, former.theta], [at.x, at.y, at.theta]])
    there = replace(graph, poses=exact)

    def at_errors(values: Floats) -> Floats:
        return np.asarray(motion_residuals(replace(there, errors=values), sweeps, config)[0][0])

    assert np.abs(motion_residuals(there, sweeps, config)[0]).max() < 1e-6
    close(motion_residuals(there, sweeps, config)[3][0], difference(at_errors, graph.errors))
    assert residual.shape == (1, 3)
    assert by_errors.shape == (1, 3, 4)


def test_what_the_motion_residuals_are_weighed_by() -> None:
    """A covariance worked from the model itself: turns before the drive bend it, all turns turn what comes after."""
    config = GraphConfig()
    motion = (1.0, 0.0, math.pi, 0.5, math.pi)
    graph = stepped(motion, Pose(0, 0, 0), Pose(1.0, 0.0, 2 * math.pi + 0.5), (0.0,) * 4)
    _, _, by_latter, _ = motion_residuals(graph, np.array([1]), config)
    found = np.linalg.inv(by_latter[0].T @ by_latter[0])
    turn, metre = (math.radians(config.slip_turn_deg) ** 2 / (2 * math.pi), math.radians(config.slip_metre_deg) ** 2)
    early = turn * (math.pi + 0.25) + 0.25 * metre
    late = turn * (math.pi + 0.25) + 0.75 * metre + math.radians(config.heading_sigma_deg) ** 2
    step = config.step_sigma_m**2
    expected = [[step + config.step_sigma**2, 0, 0], [0, step + early, early], [0, early, early + late]]
    assert found == pytest.approx(np.array(expected), rel=1e-9, abs=1e-15)


def test_a_step_that_nobody_knows_hardly_counts() -> None:
    known = stepped((1.0, 0.0, 0.0, 0.0, 0.0), Pose(0, 0, 0), Pose(1.5, 0.2, 0.1), (0.0,) * 4)
    unknown = replace(known, joined=np.array([0, 0]))
    one, other = (motion_residuals(graph, np.array([1]), GraphConfig())[0] for graph in (known, unknown))
    assert other == pytest.approx(0.01 * one)


def test_the_rotation_scale_bends_the_drive_by_what_was_turned_before_it() -> None:
    graph = stepped((1.0, 0.0, math.pi, 0.0, math.pi), Pose(0, 0, 0), Pose(1.0, 0.0, 0.0), (0.0,) * 4)
    e = 0.01
    bent = Pose(math.cos(e * math.pi), math.sin(e * math.pi), wrap(e * 2 * math.pi))
    poses_ = np.array([[0.0, 0.0, 0.0], [bent.x, bent.y, bent.theta]])
    errors_ = np.zeros(4)
    errors_[ROTATION] = e
    assert (
        np.abs(motion_residuals(replace(graph, poses=poses_, errors=errors_), np.array([1]), GraphConfig())[0]).max()
        < 1e-9
    )


def test_how_much_odometry_slips_is_what_most_of_its_steps_leave_over() -> None:
    """Two degrees to and fro at every step are slip; ten at one step are somebody's hand."""
    config, poses = GraphConfig(), [Pose(0.8 * k, 0.0, 0.0) for k in range(12)]
    straight = graph_of(poses, [Line(math.pi / 2, 1.0)], [(0, 0)])
    assert slip(straight, config) == 1.0

    def headed(degrees: list[float]) -> float:
        turned = straight.poses.copy()
        turned[:, 2] = np.array(degrees) * DEGREE
        return slip(replace(straight, poses=turned), config)

    own = math.sqrt(0.8 * config.slip_metre_deg**2 + config.heading_sigma_deg**2)
    assert headed([2.0 * (k % 2) for k in range(12)]) == pytest.approx(2.0 / own, rel=0.05)
    assert headed([0.0] * 6 + [10.0] * 6) == 1.0
    assert slip(Graph.empty(), config) == 1.0
