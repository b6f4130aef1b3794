"""`paper` and odometry: taken as it is until the walls refute it, then corrected as if it had been from the start."""

from collections.abc import Mapping, Sequence
from functools import cache

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


def steps(sweeps: Sequence[Sweep], settings: Mapping[str, object] | None = None) -> list[Step]:
    return list(pipeline.run(sweeps, RING, algorithm("paper").configured(settings or {})))


@cache
def drifting() -> tuple[Walk, list[Step]]:
    made = walk(HALL, straight(16), DRIFT)
    return made, steps(made.sweeps)


def refuted(made: Sequence[Step]) -> int:
    """The first sweep after which odometry is corrected."""
    return [step.state.track.rival is None for step in made].index(True)


def test_perfect_odometry_is_left_as_it_is() -> None:
    made = walk(HALL, straight(16))
    run = steps(made.sweeps)
    odometry = pipeline.run(made.sweeps, RING, algorithm("odometry"))
    assert [step.pose for step in run] == [step.pose for step in odometry]
    assert not any(step.localisation.moved for step in run)
    assert max(off(run[-1].state.poses, made.stations)) <= 1e-5


def test_from_where_it_is_refuted_all_poses_and_chains_are_those_of_who_corrected_it_at_once() -> None:
    made, run = drifting()
    at, other = refuted(run), steps(made.sweeps, AT_ONCE)
    assert 3 <= at <= 10
    assert run[at - 1].state.poses != other[at - 1].state.poses
    for mine, yours in zip(run[at:], other[at:], strict=True):
        assert canonical((mine.state.track, mine.state.calibration)) == canonical(
            (yours.state.track, yours.state.calibration)
        )


def test_the_sweep_that_refutes_it_says_which_poses_moved() -> None:
    _, run = drifting()
    at = refuted(run)
    before, after = run[at - 1].state.poses, run[at].state.poses
    assert run[at].localisation.moved == tuple((k, after[k]) for k in range(at) if after[k] != before[k])
    assert {k for k, _ in run[at].localisation.moved} >= set(range(2, at))
    assert not any(step.localisation.moved for step in [*run[:at], *run[at + 1 :]])


def test_every_sweep_s_links_are_to_the_chains_that_there_are_then() -> None:
    """Those of the sweep that takes the rival's place over, too; whoever shows them looks the chains up."""
    scene = Scene(RING, 0.15, None)
    for step in drifting()[1]:
        members = step.state.chains.members
        assert [members[link.member].chain for link in step.association.links] == [
            link.chain for link in step.association.links
        ]
        assert "map/E_association/links" in scene.show(step).shapes


def test_what_is_drawn_is_what_is_known_after_that() -> None:
    """The walls that were drawn by odometry's poses are drawn anew: two walls would be left otherwise."""
    made, run = drifting()
    mine, yours = (each[-1].state.grid.dense()[0] > 0 for each in (run, steps(made.sweeps, AT_ONCE)))
    assert abs(int(mine.sum()) - int(yours.sum())) <= 0.02 * int(yours.sum())


@pytest.mark.parametrize("shove", [Pose(0.0, 0.0, 3.0 * DEGREE), Pose(0.0, 0.18, 0.0)], ids=["3 degrees", "18 cm"])
def test_a_robot_that_was_pushed_is_found_again(shove: Pose) -> None:
    made = walk(HALL, straight(16), shoves={6: shove})
    run = steps(made.sweeps)
    assert refuted(run) == 6
    assert max(off(run[-1].state.poses, made.stations)) <= 0.06
    assert max(turned(run[-1].state.poses, made.stations)) <= 1.0


def test_a_state_that_still_trusts_odometry_can_be_kept_and_gone_on_from() -> None:
    made, run = drifting()
    at = refuted(run) - 1
    kept = restored(State, read_canonical(canonical(run[at].state)))
    again = list(pipeline.run(made.sweeps[at + 1 :], RING, algorithm("paper"), kept))
    assert [canonical(step.state) for step in again] == [canonical(step.state) for step in run[at + 1 :]]
