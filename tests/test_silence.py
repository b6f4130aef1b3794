"""What was not heard: a doorway in line with a wall is told from a wall that goes on."""

import numpy as np
import pytest

from slam import pipeline
from slam.algorithms import algorithm
from slam.dmath import DEGREE
from slam.geometry import Pose
from slam.silence import DIRECTIONS, directions_of, missing, unheard
from tests.synthetic import RING, StraightWall, corridor, scan

PAPER = algorithm("paper")
SOUTH = StraightWall(-20.0, -1.0, 20.0, -1.0)
WITH_DOOR = [SOUTH, StraightWall(-20.0, 1.0, 1.0, 1.0), StraightWall(2.2, 1.0, 20.0, 1.0)]


@pytest.mark.parametrize(("walls", "shut"), [(WITH_DOOR, False), (corridor(2.0, 20.0), True)])
def test_a_doorway_stays_open_and_a_wall_goes_on(walls: list[StraightWall], shut: bool) -> None:
    stations = [Pose(0.8 * k, 0.0, 0.0) for k in range(5)]
    *_, last = pipeline.run([scan(walls, pose) for pose in stations], RING, PAPER)
    grid = last.state.grid
    doorway = grid.occupied(grid.window(24, 18, 16, 4)).any(axis=0)  # x from 1.2 to 2.0 m
    assert doorway.all() if shut else not doorway.any()


def test_a_sweep_knows_how_far_off_nothing_stands() -> None:
    step, = pipeline.run([scan([StraightWall(-3.0, 1.0, 3.0, 1.0)], Pose(0.0, 0.0, 0.0))], RING, PAPER)  # fmt: skip
    profile = unheard(step.calibrated.beams)
    towards = {deg: float(profile[directions_of(np.array([deg * DEGREE]))[0]]) for deg in (90.0, 0.0, 180.0, -90.0)}
    assert towards == pytest.approx({90.0: 1.0, 0.0: 3.2, 180.0: 3.2, -90.0: 3.2}, abs=0.051)


@pytest.mark.parametrize(
    ("station", "says"),
    [
        ((0.5, 0.0, 0.3), True),
        ((0.5, 2.0, 0.3), True),  # from the other side
        ((-0.5, 0.0, 0.3), False),  # sees it askew
        ((0.5, -1.5, 0.3), False),  # 2.5 m away, and nothing is known beyond 2 m
        ((0.02, 0.0, 0.3), False),  # by its end
    ],
)
def test_silence_speaks_only_of_what_stands_square_to_it(station: tuple[float, float, float], says: bool) -> None:
    gaps, profiles = np.array([[0.0, 1.0, 1.0, 1.0]]), np.full((1, DIRECTIONS), 2.0)
    gap, _, ways = missing(gaps, np.array([station]), profiles)
    assert gap.tolist() == ([0] if says else [])
    assert ways.shape == (len(gap), 4)
