"""Blocks E and F of `paper`: what chains show, points seen as the walls they answer like, corrections weighed."""

import math

import pytest

from slam.algorithms import algorithm
from slam.association import OPEN, POINT, WALL, Association, AssociationConfig, Chains, Link, Member
from slam.dmath import DEGREE
from slam.features import Wall
from slam.geometry import ORIGIN, Pose, Segment, segment
from slam.landmarks import LandmarkConfig, Landmarks, line_of, place_of
from slam.localisation import Localisation
from slam.recognition import RecognitionConfig, recognise
from slam.weighing import Balance, WeighingConfig, weigh, without_strangers

CONFIG = algorithm("paper").config
AHEAD, LEFT, RIGHT = (
    segment(0.0, 3.0, -0.5, 0.5),
    segment(90 * DEGREE, 1.0, -0.2, 0.2),
    segment(-90 * DEGREE, 1.0, -0.2, 0.2),
)


def sighting(x: float, y: float, station: Pose, tilt_deg: float = 0.0) -> Segment:
    """What a point at (x, y) answers like from a station, in the map frame."""
    alpha = math.atan2(y - station.y, x - station.x) + tilt_deg * DEGREE
    distance = math.hypot(x - station.x, y - station.y)
    return segment(alpha, distance, -0.3, 0.3).moved(Pose(station.x, station.y, 0.0))


def test_a_point_stands_where_lines_of_sight_cross_however_bad_the_bearings() -> None:
    stations = (ORIGIN, Pose(2.0, 0.0, 0.0))
    members = [
        Member(0, 0, sighting(1.0, 2.0, stations[0], 3.0), POINT, 3 * DEGREE),
        Member(0, 1, sighting(1.0, 2.0, stations[1], 3.0), POINT, 3 * DEGREE),
    ]
    place = place_of(members, stations, LandmarkConfig(post_m=0.001))
    assert (place.x, place.y) == pytest.approx((1.0, 2.0), abs=0.04)  # each alone is off by 12 cm
    line = place.line(Pose(1.0, 0.0, 0.0))
    assert (line.alpha / DEGREE, line.rho) == pytest.approx((90.0, 2.0), abs=2.5)


def test_a_pillar_is_as_thick_as_its_sightings_say_and_answers_from_its_other_side() -> None:
    stations = tuple(Pose(x, 0.0, 0.0) for x in (0.0, 0.7, 1.4, 2.1))
    radius = 0.2
    members = []
    for k, station in enumerate(stations):
        seen = sighting(1.0, 1.0, station)
        nearer = Segment(seen.alpha, seen.rho - radius, seen.start, seen.end)
        members.append(Member(0, k, nearer, POINT, 0.3 * DEGREE))
    place = place_of(members, stations, LandmarkConfig())
    assert (place.x, place.y, place.radius) == pytest.approx((1.0, 1.0, radius), abs=0.03)
    assert place.line(Pose(1.0, 3.0, 0.0)).rho == pytest.approx(-1.0 - radius, abs=0.05)


def test_the_line_of_a_wall_is_that_of_all_its_members_and_good_where_they_are() -> None:
    stations = tuple(Pose(float(x), 0.0, 0.0) for x in range(4))
    tilts = (4.0, 0.0, 0.0, 0.0)  # the root's bearing is bad
    members = []
    for k, tilt in enumerate(tilts):
        seen = segment((90 + tilt) * DEGREE, 1.5, -0.3, 0.3).moved(Pose(stations[k].x, 0.0, 0.0))
        members.append(Member(0, k, seen, WALL, (4.0 if k == 0 else 0.3) * DEGREE))
    near = line_of(members, stations, (1.5, 1.5), LandmarkConfig())
    assert near.alpha / DEGREE == pytest.approx(90.0, abs=0.5)
    assert near.sigma < 1.0 * DEGREE
    far = line_of(members, stations, (9.0, 1.5), LandmarkConfig())
    assert (far.alpha, far.rho) == pytest.approx((near.alpha, near.rho), abs=0.002)
    assert near.off < 0.02
    assert far.off > 2.0 * near.off


def test_a_point_is_recognised_from_where_its_foot_would_have_left_it_as_a_wall() -> None:
    stations = (ORIGIN, Pose(0.5, 0.0, 0.0))
    chains = Chains().joined([(None, 0, sighting(1.0, 2.0, stations[0]))], 0)
    chains = chains.joined([(0, POINT, sighting(1.0, 2.0, stations[1]))], 1)
    here = Pose(2.0, 0.0, 0.0)  # where it looks 53° from its root
    wall = Wall(0, sighting(1.0, 2.0, here).moved(Pose(-2.0, 0.0, 0.0)))
    landmarks = Landmarks(chains, stations, LandmarkConfig())
    found = recognise((wall,), landmarks, here, AssociationConfig(), RecognitionConfig())
    assert [(link.chain, link.nature) for link in found.links] == [(0, POINT)]


@pytest.mark.parametrize(
    ("driven", "parallax", "nature"),
    [
        (0.1, 0.0, OPEN),  # too near to where it was seen first
        (0.1, 11.0, POINT),
        (0.1, -11.0, WALL),
        (0.5, 0.0, WALL),
        (0.5, 11.0, OPEN),  # the robot's way says wall, its sonars say point
    ],
)
def test_what_moved_too_little_is_told_by_the_sonars_of_one_sweep(driven: float, parallax: float, nature: int) -> None:
    here = Pose(driven, 0.0, 0.0)
    landmarks = Landmarks(Chains().joined([(None, OPEN, LEFT)], 0), (ORIGIN,), LandmarkConfig())
    found = recognise((Wall(0, LEFT, parallax=parallax),), landmarks, here, AssociationConfig(), RecognitionConfig())
    assert [(link.chain, link.nature) for link in found.links] == [(0, nature)]


def test_who_fits_a_member_but_not_the_line_does_not_join() -> None:
    root, member, wall = (segment(a * DEGREE, 2.0, -0.4, 0.4) for a in (0.0, 9.0, 18.0))
    chains = Chains().joined([(None, 0, root)], 0).joined([(0, WALL, member)], 1)
    stations, here = (ORIGIN, Pose(0.0, 0.3, 0.0)), ORIGIN
    of_member = recognise(
        (Wall(0, wall),),
        Landmarks(chains, stations, LandmarkConfig()),
        here,
        AssociationConfig(),
        RecognitionConfig(explained=2.0),
    )
    assert [link.chain for link in of_member.links if link.nature == WALL] == []


def corrected(walls: list[Segment], roots: list[Segment]) -> Localisation:
    return weigh(balance(walls, roots), ORIGIN, CONFIG.localisation)


def balance(walls: list[Segment], roots: list[Segment]) -> Balance:
    chains = Chains().joined([(None, WALL, root) for root in roots], 0, (0.3 * DEGREE,) * len(roots))
    links = tuple(Link(k, k, k, 0.0, 0.0, 0.0, WALL) for k in range(len(walls)))
    sigmas = (0.5 * DEGREE,) * len(walls)
    landmarks = Landmarks(chains, (ORIGIN,), LandmarkConfig())
    return Balance(Association(links, (), tuple(walls)), sigmas, landmarks, WeighingConfig())


def turned(wall: Segment, degrees: float) -> Segment:
    return wall.moved(Pose(0.0, 0.0, degrees * DEGREE))


def test_one_wall_alone_cannot_turn_the_robot_far_and_two_that_agree_can() -> None:
    assert abs(corrected([turned(LEFT, 8.0)], [LEFT]).turn_deg) <= 1.5
    assert corrected([turned(LEFT, 8.0), turned(AHEAD, 8.0)], [LEFT, AHEAD]).turn_deg == pytest.approx(-8.0, abs=0.1)


def test_one_false_wall_among_three_does_not_turn_it() -> None:
    found = corrected([LEFT, RIGHT, turned(AHEAD, 9.0)], [LEFT, RIGHT, AHEAD])
    assert abs(found.turn_deg) <= 0.3
    assert found.shift == pytest.approx((0.0, 0.0), abs=0.015)


def test_what_does_not_fit_its_chain_at_the_pose_found_does_not_join_it() -> None:
    walls = [LEFT, turned(AHEAD, 9.0), RIGHT]
    agreed = without_strangers(balance(walls, [LEFT, AHEAD, RIGHT]), tuple(walls), ORIGIN)
    assert [link.wall for link in agreed.links] == [0, 2]
