"""What the driver makes of walls that its sonars do not hear while it drives."""

from math import cos, radians, sin

import numpy as np
import pytest

from sonarlog.surroundings import NEAR_M, Place, Wall, room_at_slant, unrefuted

HULL_M = 0.24


@pytest.mark.parametrize(("off_deg", "stops"), [(40.0, False), (65.0, True), (72.0, True), (88.0, False)])
def test_a_wall_between_the_beams_is_taken_to_go_on(off_deg: float, stops: bool) -> None:
    """0.35 m off, met at a slant: sonars look to the front and to the side, and hear nothing of it between."""
    normal = radians(off_deg)
    wall = Wall(off_deg, 0.35, 0.35 * cos(normal), 0.35 * sin(normal))
    room = room_at_slant([wall], Place(0.0, 0.0, 0.0), 0.0, HULL_M)
    assert room == pytest.approx((0.35 - HULL_M) / cos(normal) if stops else NEAR_M)


def test_so_far_from_where_it_was_seen_it_may_have_ended() -> None:
    wall = Wall(70.0, 0.35, 0.35 * cos(radians(70.0)), 0.35 * sin(radians(70.0)))
    beside = Place(-0.8 * sin(radians(70.0)), 0.8 * cos(radians(70.0)), 0.0)  # as near to its line, 0.8 m along it
    assert room_at_slant([wall], beside, 0.0, HULL_M) < NEAR_M  # towards what was seen
    assert room_at_slant([wall], Place(-beside.x, -beside.y, 0.0), 0.0, HULL_M) == NEAR_M  # away from it


def test_what_was_nearer_than_anything_a_scan_heard_was_nothing() -> None:
    scan = np.array([[0.4, 0.0], [0.0, 1.0]])
    earlier = np.array([[0.2, 0.1], [-0.3, 0.0], [0.41, 0.0], [-0.5, 0.0]])
    assert unrefuted(earlier, scan, Place(0.0, 0.0, 0.0)).tolist() == [[0.41, 0.0], [-0.5, 0.0]]
    assert unrefuted(earlier, scan[:0], Place(0.0, 0.0, 0.0)).tolist() == []
    assert unrefuted(earlier, scan, Place(3.0, 0.0, 0.0)).tolist() == earlier.tolist()
