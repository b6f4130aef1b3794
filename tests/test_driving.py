"""Stretches seen while driving: a wall or a point, where it is, and how well its bearing is known."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from slam.arcs import Beams
from slam.dmath import DEGREE
from slam.driving import DrivingConfig, find_stretches

Seen = Callable[[float, float], float]
"""The range from a sonar at (x, y)."""


def driven(axis_deg: float, seen: Seen, noise: tuple[float, ...] = (0.0,)) -> Beams:
    """One sonar 10 cm beside the centre that reads every 4 cm of half a metre; F is where it is halfway."""
    x = np.linspace(-0.24, 0.24, 13)
    origin = np.stack([x, np.full(13, 0.1)], axis=1)
    ranges = np.array([seen(*o) + noise[k % len(noise)] for k, o in enumerate(origin.tolist())])
    sonar = np.zeros(13, dtype=np.int64)
    return Beams(sonar, ranges, np.ones(13, dtype=bool), origin, np.full(13, axis_deg * DEGREE), 12.5 * DEGREE)


def wall(bearing_deg: float, distance: float) -> Seen:
    sine, cosine = math.sin(bearing_deg * DEGREE), math.cos(bearing_deg * DEGREE)
    return lambda x, y: distance - (cosine * x + sine * y)


def point(px: float, py: float) -> Seen:
    return lambda x, y: math.hypot(px - x, py - y)


@pytest.mark.parametrize("bearing", [90.0, 84.0, 97.0])
def test_a_wall_beside_the_way_is_where_it_is(bearing: float) -> None:
    (found,) = find_stretches(driven(90.0, wall(bearing, 1.2)), DrivingConfig())
    assert found.parallax < 0.0
    assert (found.bearing / DEGREE, found.distance) == pytest.approx((bearing, 1.2), abs=1e-3)
    assert found.right - found.left > 0.4


@pytest.mark.parametrize(("axis", "at"), [(90.0, (0.02, 0.9)), (41.0, (0.9, 1.0)), (145.0, (-1.1, 0.8))])
def test_a_post_is_a_point_where_the_frame_sees_it(axis: float, at: tuple[float, float]) -> None:
    (found,) = find_stretches(driven(axis, point(*at)), DrivingConfig(min_readings=13))
    assert found.parallax > 0.0
    seen = found.distance * math.cos(found.bearing), found.distance * math.sin(found.bearing)
    assert seen == pytest.approx(at, abs=1e-3)
    assert (found.left, found.right) == (0.0, 0.0)


def test_what_lies_on_one_line_by_chance_is_not_known_better_than_its_readings() -> None:
    exact, noisy = (
        find_stretches(driven(90.0, wall(90.0, 1.2), noise), DrivingConfig(strong_sigma_deg=90.0))[0]
        for noise in ((0.0,), (0.01, -0.01, 0.0))
    )
    assert 0.3 * DEGREE < exact.sigma < noisy.sigma < 2.0 * DEGREE
