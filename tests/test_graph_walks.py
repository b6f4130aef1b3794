"""`graph` on noise-free walks: where odometry errs it learns by how much, and what cannot be known it leaves."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slam import pipeline
from slam.algorithms import ALGORITHMS, algorithm
from slam.dmath import DEGREE
from slam.geometry import Pose
from slam.motion import WheelErrors
from slam.pipeline import State
from slam.sweep import TURN, Sweep
from sonarlog.canonical import canonical, read_canonical
from sonarlog.restore import restored
from tests.synthetic import RING, StraightWall
from tests.walks import Walk, off, room, straight, track, turned, walk

GRAPH = algorithm("graph")
HALL = room(-2.0, -1.0, 14.0, 1.0)
"""A corridor 2 m wide with both its ends."""
LEFT, ALTERNATING = (1,), (1, -1)


@cache
def hall(stations: int = 14) -> Walk:
    """Down the corridor with wheels that do not err."""
    return walk(HALL, straight(stations))


def end(made: Walk, name: str = "graph") -> State:
    return track(made.sweeps, name)[-1].state


def chains_of(state: State) -> int:
    """How many chains have members."""
    return len(set(state.track.graph.landmark.tolist()))


# what the wheels get wrong ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(set(ALGORITHMS) - {"literal"}))
@pytest.mark.parametrize("sides", [ALTERNATING, LEFT], ids=["alternating", "left"])
def test_with_perfect_odometry_nobody_makes_the_pose_worse_than_5_cm(name: str, sides: tuple[int, ...]) -> None:
    made = hall() if sides == ALTERNATING else walk(HALL, straight(14), sides=sides)
    assert max(off(end(made, name).poses, made.stations)) <= 0.05


@pytest.mark.parametrize(
    ("rotation", "distance", "drift_deg", "sides"),
    [
        (0.015, 0.0, 0.0, ALTERNATING),
        (-0.015, 0.0, 0.0, LEFT),
        (0.0, 0.03, 0.0, ALTERNATING),
        (0.0, 0.0, 0.5, ALTERNATING),
        (0.01, 0.02, -0.8, ALTERNATING),
        (0.01, 0.02, -0.8, LEFT),
    ],
    ids=["turns-more", "turns-less-left", "drives-farther", "drifts", "all", "all-left"],
)
def test_errors_of_the_wheels_are_learnt(
    rotation: float, distance: float, drift_deg: float, sides: tuple[int, ...]
) -> None:
    """The path within 5 cm and 0.4°, where raw odometry is off by up to 8 m; the errors within the bounds below.

    The first heading is that of one sweep, whose bearings come in steps of 4°: 0.2° of it are 4 cm at the end.
    """
    made = walk(HALL, straight(16), WheelErrors(rotation, distance, drift_deg * DEGREE), sides)
    state = end(made)
    assert max(off(state.poses, made.stations)) <= 0.05
    assert max(turned(state.poses, made.stations)) <= 0.4
    learnt = state.track.graph.errors
    assert abs(learnt[0] - rotation) <= 0.002
    assert abs(learnt[1] - distance) <= 0.0015
    # Who always turns to the left cannot tell much turning from little drifting: only their sum is known.
    if sides == ALTERNATING:
        assert abs(learnt[2] / DEGREE - drift_deg) <= 0.1
    else:
        turns = 360.0 / 0.8  # degrees turned a metre
        both = turns * (learnt[0] - rotation) + (learnt[2] / DEGREE - drift_deg)
        assert abs(both) <= 0.1
    assert (state.calibration.distance_scale, state.calibration.drift) == (learnt[1], learnt[2])


def test_what_nothing_shows_stays_as_it_was_believed() -> None:
    """Between two endless walls nobody can know how far the robot went."""
    endless = [StraightWall(-40, 1, 40, 1), StraightWall(-40, -1, 40, -1)]
    made = walk(endless, straight(10), WheelErrors(distance=0.03))  # it faces back in the middle of its turns
    state = end(made)
    assert state.track.graph.errors[1] == pytest.approx(0.0, abs=1e-3)
    assert abs(state.poses[-1].x) == pytest.approx(7.2 / 1.03, abs=0.01)
    assert max(abs(pose.y) for pose in state.poses) <= 0.01


def test_a_bend_is_followed_whatever_the_wheels_do() -> None:
    walls = [
        StraightWall(-2, 1, 7, 1), StraightWall(-2, -1, 9, -1), StraightWall(9, -1, 9, 8),
        StraightWall(7, 1, 7, 8), StraightWall(-2, -1, -2, 1), StraightWall(7, 8, 9, 8),
    ]  # fmt: skip
    route = [*straight(11), *((8.0, 0.8 * k) for k in range(1, 8))]
    made = walk(walls, route, WheelErrors(0.01, 0.02, 0.3 * DEGREE), LEFT)
    assert max(off(end(made, "odometry").poses, made.stations)) >= 5.0
    state = end(made)
    assert max(off(state.poses, made.stations)) <= 0.03
    assert max(turned(state.poses, made.stations)) <= 0.3


# what happens to robots ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "shove",
    [Pose(0.0, 0.2, 0.0), Pose(0.0, -0.2, 0.0), Pose(0.0, 0.0, 3 * DEGREE), Pose(0.0, 0.2, -3 * DEGREE)],
    ids=["left", "right", "turned", "both"],
)
def test_a_kidnapping_is_recovered_from(shove: Pose) -> None:
    """Carried off by 20 cm or turned by 3° between two stations: found again at the next one, put right behind it."""
    made = walk(HALL, straight(12), WheelErrors(0.01, 0.0, 0.3 * DEGREE), shoves={6: shove})
    steps = track(made.sweeps)
    live = [step.pose for step in steps]
    assert max(off(live[5:], made.stations[5:])) <= 0.03
    assert max(turned(live[7:], made.stations[7:])) <= 0.4
    assert max(turned(steps[-1].state.poses, made.stations)) <= 0.7
    assert chains_of(steps[-1].state) == 3  # both sides and the near end: no wall twice


def deaf(sweep: Sweep) -> Sweep:
    return replace(sweep, range_mm=np.full_like(sweep.range_mm, RING.max_range_mm))


def test_a_sweep_without_any_echo_is_passed_over() -> None:
    made = hall()
    steps = track([deaf(sweep) if k == 5 else sweep for k, sweep in enumerate(made.sweeps)])
    silent = steps[5]
    assert (silent.association.links, silent.association.unlinked) == ((), ())
    assert off([silent.pose], [silent.calibrated.predicted])[0] <= 1e-3
    assert silent.state.chains.members == steps[4].state.chains.members
    assert max(off(steps[-1].state.poses, made.stations)) <= 0.03


@pytest.mark.parametrize("silent", [1, 3], ids=["first", "first-three"])
def test_a_robot_that_hears_nothing_at_first(silent: int) -> None:
    made = hall()
    state = track([deaf(sweep) if k < silent else sweep for k, sweep in enumerate(made.sweeps)])[-1].state
    assert max(off(state.poses, made.stations)) <= 0.03


def elsewhere(sweep: Sweep) -> Sweep:
    """The same as a new session has it, whose odometry begins anew, turned and shifted."""
    turn = TURN // 9
    sine, cosine = math.sin(2 * math.pi / 9), math.cos(2 * math.pi / 9)
    return replace(
        sweep,
        session=1,
        heading=sweep.heading + turn,
        x_um=np.rint(cosine * sweep.x_um - sine * sweep.y_um).astype(np.int64) + 5_000_000,
        y_um=np.rint(sine * sweep.x_um + cosine * sweep.y_um).astype(np.int64) - 3_000_000,
    )


@pytest.mark.parametrize("shove", [Pose(0.0, 0.0, 0.0), Pose(0.0, 0.08, 0.04)], ids=["still", "moved"])
def test_a_new_session_goes_on_where_the_robot_is(shove: Pose) -> None:
    """Its odometry is not connected with the one before: the walls tell, for who has hardly been moved."""
    route = [*straight(6), (4.01, 0.0), *((4.01 + 0.8 * k, 0.0) for k in range(1, 6))]
    made = walk(HALL, route, shoves={6: shove})
    steps = track([elsewhere(sweep) if k >= 6 else sweep for k, sweep in enumerate(made.sweeps)])
    assert steps[6].calibrated.motion is None
    assert max(off(steps[-1].state.poses, made.stations)) <= 0.03
    assert max(turned(steps[-1].state.poses, made.stations)) <= 0.6
    assert chains_of(steps[-1].state) == 3  # both sides and the near end: no wall twice


def test_round_a_block_the_first_walls_are_met_again() -> None:
    """30 m round; odometry is off by more than a metre when it comes back."""
    walls = [*room(-1, -1, 9, 7), *room(1, 1, 7, 5)]
    sides = [((0.0, 0.0), (8.0, 0.0)), ((8.0, 0.0), (8.0, 6.0)), ((8.0, 6.0), (0.0, 6.0)), ((0.0, 6.0), (0.0, 0.0))]
    route = [(a[0] + (b[0] - a[0]) * k / 8, a[1] + (b[1] - a[1]) * k / 8) for a, b in sides for k in range(8)] + [
        (0.1, 0.0),
        (1.0, 0.0),
    ]
    made = walk(walls, route, WheelErrors(0.015, 0.03, 0.6 * DEGREE))
    assert max(off(end(made, "odometry").poses, made.stations)) >= 1.0
    state = end(made)
    assert max(off(state.poses, made.stations)) <= 0.04
    assert max(turned(state.poses, made.stations)) <= 0.3
    again = state.track.graph
    assert all(len(np.unique(again.landmark[again.sweep == k])) >= 2 for k in (0, len(route) - 2))
    assert set(again.landmark[again.sweep == 0].tolist()) & set(again.landmark[again.sweep == len(route) - 2].tolist())


# the same bits ---------------------------------------------------------------------------------------------------


def test_the_same_sweeps_give_the_same_bits_whole_and_from_any_checkpoint() -> None:
    made = walk(HALL, straight(8), WheelErrors(0.01, 0.02, 0.3 * DEGREE), shoves={5: Pose(0.0, 0.2, 0.0)})
    states = [canonical(step.state) for step in pipeline.run(made.sweeps, RING, GRAPH)]
    assert states == [canonical(step.state) for step in pipeline.run(made.sweeps, RING, GRAPH)]
    for k in (0, 3, 5):
        kept = restored(State, read_canonical(states[k]))
        assert canonical(kept) == states[k]
        on = list(pipeline.run(made.sweeps[k + 1 :], RING, GRAPH, kept))
        assert [canonical(step.state) for step in on] == states[k + 1 :]


def test_members_are_the_sightings_in_their_order() -> None:
    made = hall()
    known = end(made).track
    graph, members = known.graph, known.chains.members
    assert [member.chain for member in members] == graph.landmark.tolist()
    assert [member.sweep for member in members] == graph.sweep.tolist()
    assert [(pose.x, pose.y, pose.theta) for pose in known.poses] == [tuple(row) for row in graph.poses.tolist()]
    for chain, root in enumerate(known.chains.roots):
        assert root == next((k for k, member in enumerate(members) if member.chain == chain), -1)
    for member in members:  # the first frame faces back: the near end is at +2 m, the far one at −14 m
        (x0, y0), (x1, y1) = member.segment.start, member.segment.end
        beside = min(abs(y0 - y) + abs(y1 - y) for y in (-1.0, 1.0))
        ahead = min(abs(x0 - x) + abs(x1 - x) for x in (2.0, -14.0))
        assert min(beside, ahead) <= 0.06
