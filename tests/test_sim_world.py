"""Worlds, their truth, and what sonars hear in them."""

import numpy as np
import pytest

from slam.dmath import DEGREE, cos, sin
from sonarlog.robot import load_robot
from sonarlog.sim.corners import find_corners
from sonarlog.sim.physics import QUIET, Acoustics, Physics
from sonarlog.sim.rng import Noise
from sonarlog.sim.world import FREE, OCCUPIED, BadWorld, World, built_in, load_world, parse_world

MATERIAL = "[materials]\nm = { half_beam_deg = 12.5 }\n"


def world(*polylines: str, more: str = "") -> World:
    walls = "".join(f'[[walls]]\nmaterial = "m"\npoints = {points}\n' for points in polylines)
    return parse_world("test", MATERIAL + walls + more)


def heard(place: World, x: float, y: float, axis_deg: float, acoustics: Acoustics = QUIET) -> float:
    return Physics(place, acoustics, seed=1).range_m(0, x, y, cos(axis_deg * DEGREE), sin(axis_deg * DEGREE))


def test_spec_answer_1_a_wall_seen_by_eight_sonars() -> None:
    wall = world("[[1.5, -50.0], [1.5, 50.0]]")
    ranges = []
    for sonar in load_robot("amigo").sonars:
        turn = -sonar.heading_deg * DEGREE  # the robot turns until this sonar looks along the normal
        x, y = sonar.x_mm / 1000, sonar.y_mm / 1000
        ranges.append(heard(wall, x * cos(turn) - y * sin(turn), x * sin(turn) + y * cos(turn), 0.0))
    assert np.round(ranges, 4).tolist() == [1.4, 1.3565, 1.3473, 1.3473, 1.3565, 1.4, 1.3521, 1.3521]


@pytest.mark.parametrize(
    ("axis", "expected"),
    [(0.0, 1.0), (12.4, 1.0), (-12.4, 1.0), (12.6, 5.0), (-40.0, 5.0), (180.0, 5.0)],
)
def test_a_wall_answers_with_the_perpendicular_distance_within_its_half_beam(axis: float, expected: float) -> None:
    assert heard(world("[[1.0, -9.0], [1.0, 9.0]]"), 0.0, 0.0, axis) == pytest.approx(expected, abs=1e-12)


def test_only_what_is_in_sight_answers_and_only_from_its_own_foot_point() -> None:
    far = "[[2.0, -9.0], [2.0, 9.0]]"
    assert heard(world(far, "[[1.0, 0.1], [1.0, 9.0]]"), 0.0, 0.0, 0.0) == pytest.approx(2.0)  # no foot on the near one
    assert heard(world(far, "[[1.0, -0.2], [1.2, 0.2]]"), 0.0, 0.0, 0.0) == 5.0  # it hides the far one and looks away


def test_corners_answer_from_between_their_walls_and_edges_only_now_and_then() -> None:
    corner = world("[[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]")
    assert heard(corner, 0.0, 0.0, 45.0) == pytest.approx(2**0.5)
    assert heard(corner, 2.0, 2.0, 225.0) == 5.0
    loud = Acoustics(noise_m=0, outliers=0, bounce_echo=0, edge_echo=1)
    assert heard(corner, 2.0, 2.0, 225.0, loud) == pytest.approx(2**0.5)
    assert heard(corner, 2.0, 2.0, 215.0, loud) == 5.0


def test_a_wall_that_ends_on_another_makes_two_corners_and_no_edge() -> None:
    tee = world("[[-2.0, 0.0], [2.0, 0.0]]", "[[0.0, 0.0], [0.0, -3.0]]")
    at_joint = [corner for corner in find_corners(tee.walls) if (corner.x, corner.y) == (0.0, 0.0)]
    assert [(corner.concave, corner.edge) for corner in at_joint] == [(True, False)] * 2
    assert len(find_corners(tee.walls)) == 2 + 3  # and three free ends


def test_poles_answer_from_their_rim_and_hide_what_is_behind() -> None:
    pole = '[[poles]]\nx = 2.0\ny = 0.0\nradius = 0.25\nmaterial = "m"\n'
    place = world("[[3.0, -9.0], [3.0, 9.0]]", more=pole)
    assert heard(place, 0.0, 0.0, 10.0) == pytest.approx(1.75)
    assert heard(place, 0.0, 0.2, 0.0) == pytest.approx((4 + 0.04) ** 0.5 - 0.25)


def test_silence_may_come_home_by_way_of_two_walls() -> None:
    corridor = world("[[-9.0, 1.0], [9.0, 1.0]]", "[[-9.0, -1.0], [9.0, -1.0]]")
    echoing = Acoustics(noise_m=0, outliers=0, bounce_echo=1)
    assert heard(corridor, 0.0, 0.0, 60.0, echoing) == pytest.approx(3 / sin(60 * DEGREE))


def test_noise_and_wild_readings_are_as_many_as_said() -> None:
    physics = Physics(world("[[2.0, -9.0], [2.0, 9.0]]"), Acoustics(), seed=3)
    ranges = np.array([physics.range_m(n, 0.0, 0.0, 1.0, 0.0) for n in range(5000)])
    good = ranges[np.abs(ranges - 2.0) < 0.06]
    assert 0.03 < 1 - len(good) / len(ranges) < 0.05
    assert good.std() == pytest.approx(0.010, abs=0.0005)
    assert good.mean() == pytest.approx(2.0, abs=0.0005)


def test_noise_is_looked_up_by_number() -> None:
    noise = Noise(1, "stream")
    assert [noise.bits(n) for n in (5, 0, 5)] == [Noise(1, "stream").bits(n) for n in (5, 0, 5)]
    assert noise.bits(0) not in (Noise(2, "stream").bits(0), Noise(1, "other").bits(0))
    normals = np.array([noise.normal(n) for n in range(20_000)])
    assert abs(normals.mean()) < 0.03
    assert abs(normals.std() - 1) < 0.02


@pytest.mark.parametrize("name", built_in())
def test_a_world_is_closed_round_its_start_and_has_a_tour(name: str) -> None:
    place = load_world(name)
    raster = place.raster(0.05)
    assert place.tour
    assert place.about
    assert raster.cells[-raster.bottom, -raster.left] == FREE
    border = np.concatenate([raster.cells[[0, -1]].ravel(), raster.cells[:, [0, -1]].ravel()])
    assert not border.any()
    surfaces = place.surfaces()
    assert surfaces.segments.shape == (len(place.walls), 4)
    assert surfaces.poles.shape == (len(place.poles), 3)
    for x0, y0, _, _ in surfaces.segments:
        row, column = int(np.floor(y0 / 0.05)) - raster.bottom, int(np.floor(x0 / 0.05)) - raster.left
        assert raster.cells[row, column] == OCCUPIED


def test_the_corridor_is_as_long_and_wide_as_it_says() -> None:
    raster = load_world("corridor").raster(0.05)
    free = (raster.cells == FREE).sum() * 0.05**2
    assert free == pytest.approx(25 * 2, rel=0.05)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("walls = 3", "not iterable"),
        ("[[walls]]\nmaterial = 'x'\npoints = [[0, 0], [1, 0]]", "there is no 'x'"),
        (MATERIAL + "[[walls]]\nmaterial = 'm'\npoints = [[0, 0], [0, 0]]", "a millimetre"),
        (MATERIAL + "[[walls]]\nmaterial = 'm'\npoints = [[0, 0], [nan, 0]]", "a millimetre"),
        (MATERIAL + "[[walls]]\nmaterial = 'm'\npoints = [[0, 0]]", "two points"),
        (MATERIAL + "[[walls]]\nmaterial = 'm'\npoints = [[0, 0], [1, 0]]\nclose = true", "'close'"),
        ("[materials]\nm = { half_beam_deg = 99 }", "between 0 and 45"),
        ("wals = []", "unknown key 'wals'"),
        ("walls = [", "Invalid value"),
    ],
)
def test_a_bad_world_is_refused_by_name(text: str, complaint: str) -> None:
    with pytest.raises(BadWorld, match=complaint) as refusal:
        parse_world("mine.toml", text)
    assert "mine.toml" in str(refusal.value)


def test_an_unknown_world_names_the_known_ones() -> None:
    with pytest.raises(BadWorld, match="bend, clutter, corridor, loop, office"):
        load_world("corridoor")
    with pytest.raises(BadWorld, match="cannot be read"):
        load_world("absent.toml")
