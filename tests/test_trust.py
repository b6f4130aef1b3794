"""Odometry with `paper` and `graph`: as it is until the walls refute it, then corrected as from the start."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slam import pipeline
from slam.algorithms import algorithm
from slam.dmath import DEGREE
from slam.geometry import Pose
from slam.motion import WheelErrors
from slam.pipeline import State, Step
from slam.sweep import Sweep
from sonarlog.canonical import canonical, read_canonical
from sonarlog.restore import restored
from sonarlog.viz.scene import Scene
from tests.made_runs import AT_ONCE
from tests.synthetic import RING, StraightWall
from tests.walks import Walk, off, room, straight, turned, walk

HALL = [*room(-2.0, -1.0, 14.0, 1.0), StraightWall(5.0, -1.0, 5.0, -0.7), StraightWall(9.0, 1.0, 9.0, 0.7)]
"""A corridor 2 m wide with both its ends and two piers."""
DRIFT = WheelErrors(drift=0.6 * DEGREE)
either = pytest.mark.parametrize("name", ["paper", "graph"])


def steps(name: str, sweeps: Sequence[Sweep], settings: Mapping[str, object] | None = None) -> list[Step]:
    return list(pipeline.run(sweeps, RING, algorithm(name).configured(settings or {})))


@cache
def drifting(name: str) -> tuple[Walk, list[Step]]:
    made = walk(HALL, straight(16), DRIFT)
    return made, steps(name, made.sweeps)


def refuted(made: Sequence[Step]) -> int:
    """The first sweep after which odometry is corrected."""
    return [step.state.track.rival is None for step in made].index(True)


@either
def test_perfect_odometry_is_left_as_it_is(name: str) -> None:
    made = walk(HALL, straight(16))
    run = steps(name, made.sweeps)
    odometry = pipeline.run(made.sweeps, RING, algorithm("odometry"))
    assert [step.pose for step in run] == [step.pose for step in odometry]
    assert not any(step.localisation.moved for step in run)
    assert max(off(run[-1].state.poses, made.stations)) <= 1e-5


def test_from_where_it_is_refuted_all_poses_and_chains_are_those_of_who_corrected_it_at_once() -> None:
    made, run = drifting("paper")
    at, other = refuted(run), steps("paper", made.sweeps, AT_ONCE)
    assert 3 <= at <= 10
    assert run[at - 1].state.poses != other[at - 1].state.poses
    for mine, yours in zip(run[at:], other[at:], strict=True):
        assert canonical((mine.state.track, mine.state.calibration)) == canonical(
            (yours.state.track, yours.state.calibration)
        )


def test_graph_s_poses_are_then_those_of_who_corrected_it_at_once_but_for_rounding() -> None:
    """What all sonars are turned by goes into the bearings of a sweep and out of them again."""
    made, run = drifting("graph")
    at, other = refuted(run), steps("graph", made.sweeps, AT_ONCE)
    assert 2 <= at <= 6
    assert max(off(run[at - 1].state.poses, other[at - 1].state.poses)) >= 0.01
    for mine, yours in zip(run[at:], other[at:], strict=True):
        assert max(off(mine.state.poses, yours.state.poses)) <= 1e-4
        assert mine.state.chains.roots == yours.state.chains.roots


@either
def test_the_sweep_that_refutes_it_says_which_poses_moved(name: str) -> None:
    _, run = drifting(name)
    at = refuted(run)
    before, after = run[at - 1].state.poses, run[at].state.poses
    assert run[at].localisation.moved == tuple((k, after[k]) for k in range(at) if after[k] != before[k])
    assert {k for k, _ in run[at].localisation.moved} >= set(range(2, at))
    assert not any(step.localisation.moved for step in run[:at])


@either
def test_every_sweep_s_links_are_to_the_chains_that_there_are_then(name: str) -> None:
    """Those of the sweep that takes the rival's place over, too; whoever shows them looks the chains up."""
    scene = Scene(RING, 0.15, None)
    for step in drifting(name)[1]:
        members = step.state.chains.members
        assert [members[link.member].chain for link in step.association.links] == [
            link.chain for link in step.association.links
        ]
        assert "map/E_association/links" in scene.show(step).shapes


@either
def test_what_is_drawn_is_what_is_known_after_that(name: str) -> None:
    """The walls that were drawn by odometry's poses are drawn anew: two walls would be left otherwise."""
    made, run = drifting(name)
    mine, yours = (each[-1].state.grid.dense()[0] > 0 for each in (run, steps(name, made.sweeps, AT_ONCE)))
    assert abs(int(mine.sum()) - int(yours.sum())) <= 0.02 * int(yours.sum())


@either
@pytest.mark.parametrize("shove", [Pose(0.0, 0.0, 3.0 * DEGREE), Pose(0.0, 0.18, 0.0)], ids=["3 degrees", "18 cm"])
def test_a_robot_that_was_pushed_is_found_again(name: str, shove: Pose) -> None:
    """A turn takes a second sweep: what two walls say of it a bad step may say as well."""
    made = walk(HALL, straight(16), shoves={6: shove})
    run = steps(name, made.sweeps)
    assert refuted(run) == (7 if shove.theta else 6)
    assert max(off(run[-1].state.poses, made.stations)) <= 0.06
    assert max(turned(run[-1].state.poses, made.stations)) <= 1.0


@either
def test_a_state_that_still_trusts_odometry_can_be_kept_and_gone_on_from(name: str) -> None:
    made, run = drifting(name)
    at = refuted(run) - 1
    kept = restored(State, read_canonical(canonical(run[at].state)))
    again = list(pipeline.run(made.sweeps[at + 1 :], RING, algorithm(name), kept))
    assert [canonical(step.state) for step in again] == [canonical(step.state) for step in run[at + 1 :]]


def test_odometry_that_was_interrupted_is_not_taken_as_it_is() -> None:
    made = walk(HALL, straight(8))
    later = [replace(sweep, session=int(k >= 5)) for k, sweep in enumerate(made.sweeps)]
    assert refuted(steps("graph", later)) == 5


def test_sweeps_that_hear_nothing_refute_nothing() -> None:
    made = walk(HALL, straight(4))
    deaf = [replace(sweep, range_mm=np.full_like(sweep.range_mm, RING.max_range_mm)) for sweep in made.sweeps]
    run = steps("graph", deaf)
    assert run[-1].state.track.rival is not None
    assert max(off(run[-1].state.poses, made.stations)) <= 1e-5
