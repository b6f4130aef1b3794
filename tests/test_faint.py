"""Faint things: what readings of class (iii) agree on."""

from dataclasses import replace

import numpy as np
import pytest

from slam import pipeline
from slam.algorithms import algorithm
from slam.arcs import Beams
from slam.dmath import DEGREE
from slam.faint import HALF_M, LEAST, faint_things
from slam.geometry import Pose
from tests.synthetic import RING, scan


def beams(*readings: tuple[float, float]) -> Beams:
    """Readings (axis in degrees, distance in m) of a ring without a size."""
    axis, distance = (np.array(column) for column in zip(*readings, strict=True))
    n = len(axis)
    return Beams(np.arange(n) % 8, distance, np.ones(n, dtype=bool), np.zeros((n, 2)), axis * DEGREE, 12.5 * DEGREE)


POLE = [(176.0 + 2.0 * k, 1.5 + 0.01 * (k % 2)) for k in range(LEAST)]
"""Heard at 180°, over the seam of angles."""


@pytest.mark.parametrize(
    ("readings", "count"),
    [
        (POLE, 1),
        (POLE[1:], 0),  # too few
        ([*POLE, (20.0, 1.5), (60.0, 0.7), (-170.0, 2.2)], 1),  # alone they are nothing
        ([(axis, 1.5 + 0.1 * k) for k, (axis, _) in enumerate(POLE)], 0),  # they do not agree
        ([(40.0 * k, 1.5) for k in range(9)], 0),  # nowhere together
        ([*POLE, *((axis - 90.0, 0.8) for axis, _ in POLE)], 2),
        ([(axis, 3.5) for axis, _ in POLE], 0),  # too far away
    ],
)
def test_several_that_agree_are_a_thing(readings: list[tuple[float, float]], count: int) -> None:
    some = beams(*readings)
    found = faint_things(some, some.echo, 3.0)
    assert len(found.bearing) == len(found.foot) == len(found.half) == count


def test_it_is_where_the_middle_of_the_bearings_says() -> None:
    some = beams(*POLE)
    found = faint_things(some, some.echo, 3.0)
    assert found.foot[0] == pytest.approx([-1.504, 0.0], abs=1e-3)
    assert found.half.tolist() == [HALF_M]


def test_nothing_is_heard_in_no_readings() -> None:
    some = beams((0.0, 1.0))
    assert faint_things(some, np.zeros(1, dtype=bool), 3.0).foot.shape == (0, 2)


def test_where_only_lone_readings_came_back_the_robot_still_stands() -> None:
    sweep = scan([], Pose(0.0, 0.0, 0.0))
    range_mm = sweep.range_mm.copy()
    range_mm[100] = 1500
    (step,) = pipeline.run([replace(sweep, range_mm=range_mm)], RING, algorithm("paper"))
    cells, _, _ = step.state.grid.dense()
    assert step.state.grid.free(cells).any()
    assert not step.state.grid.occupied(cells).any()
