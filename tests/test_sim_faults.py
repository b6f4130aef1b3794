"""Robots with something wrong: sonars that look elsewhere, are dead or stuck, and a robot that is moved unawares."""

from dataclasses import replace

import pytest

from slam.dmath import DEGREE
from sonarlog.robot import Robot, load_robot
from sonarlog.sim.body import Body
from sonarlog.sim.faults import BadFault, Kick, SonarFaults, draw_mounting, parse_faults, parse_kick
from sonarlog.sim.link import Simulation
from sonarlog.sim.odometry import Floor, OdometryErrors
from sonarlog.sim.physics import QUIET, Physics
from sonarlog.sim.sonars import Sonars
from sonarlog.sim.world import load_world

CYCLE_NS = 8 * 40_000_000


def body(kick: Kick | None = None) -> Body:
    return Body(load_world("corridor"), Floor(OdometryErrors(), seed=1), 0.18, kick)


def once_round(faults: SonarFaults, robot: Robot | None = None) -> list[int]:
    """What every sonar reads at the start of the corridor, in order."""
    sonars = Sonars(robot or load_robot("amigo-sh"), body(), Physics(load_world("corridor"), QUIET, seed=1), faults)
    sonars.tick(CYCLE_NS)
    return [range_mm for _, range_mm in sorted(sonars.take())]


def parsed(**settings: str) -> SonarFaults:
    return parse_faults(0.0, **{"dead": "", "stuck": "", **settings}, seed=1, sonars=8, max_range_mm=5000)


def test_dead_and_stuck_sonars_say_one_thing_and_the_others_do_not_notice() -> None:
    well = once_round(SonarFaults())
    assert once_round(parsed(dead="0, 5", stuck="2:1500")) == [5000, well[1], 1500, *well[3:5], 5000, *well[6:]]
    assert well[0] < 5000


def test_a_sonar_mounted_askew_looks_where_one_looks_that_is_meant_to() -> None:
    robot = load_robot("amigo-sh")
    errors = draw_mounting(2.0, 8, seed=3)
    assert errors != draw_mounting(2.0, 8, seed=4)
    assert all(1.4 <= abs(error) <= 2.6 for error in errors)
    askew = [replace(s, heading_deg=s.heading_deg + e) for s, e in zip(robot.sonars, errors, strict=True)]
    assert once_round(SonarFaults(errors)) == once_round(SonarFaults(), replace(robot, sonars=tuple(askew)))


def test_a_kick_moves_the_robot_once_and_odometry_does_not_notice() -> None:
    kicked, left_alone = body(Kick(after=0.5, turn=90.0, ahead=0.1, aside=0.2)), body()
    for each in (kicked, left_alone):
        for step in (0.25, 0.25):
            each.roll(step, 0.0)
    assert (kicked.x - left_alone.x, kicked.y - left_alone.y) == pytest.approx((0.1, 0.2))
    assert kicked.heading == pytest.approx(90 * DEGREE)
    assert (kicked.odometry_x, kicked.odometry_heading) == (left_alone.odometry_x, 0.0)
    kicked.roll(0.25, 0.0)
    assert kicked.y == pytest.approx(0.2 + 0.25)


@pytest.mark.parametrize("aside", [0.4, 0.9])
def test_a_kick_into_a_wall_or_through_it_goes_to_the_other_side(aside: float) -> None:
    kicked = body(Kick(after=0.0, aside=aside))
    kicked.place(0.0, 0.5, 0.0)  # the walls of the corridor are at 1 and -1 m
    kicked.roll(0.01, 0.0)
    assert kicked.y == pytest.approx(0.5 - aside)


@pytest.mark.parametrize(
    "settings", [{"dead": "8"}, {"dead": "x"}, {"stuck": "2"}, {"stuck": "2:0"}, {"stuck": "9:700"}]
)
def test_bad_sonar_faults(settings: dict[str, str]) -> None:
    with pytest.raises(BadFault, match=r"there is no sonar|is no list of SONAR:MM"):
        parsed(**settings)


def test_kick_texts() -> None:
    assert parse_kick("") is None
    assert parse_kick("after=10, turn=-3") == Kick(after=10.0, turn=-3.0)
    for text in ("3", "turn=3", "after=1,turn=200", "after=1,aside=2", "after=nan", "after=1,up=2", "after=1=2"):
        with pytest.raises(BadFault, match="known are after 0 to 10000, turn -180 to 180"):
            parse_kick(text)


def test_what_is_wrong_is_part_of_the_simulation() -> None:
    with pytest.raises(BadFault, match="dead: there is no sonar '12'; this robot has 0 to 7"):
        Simulation("corridor", dead="12").build()
    assert Simulation("corridor", robot="p3dx-sh", dead="12", kick="after=1,turn=3", mounting=2.0).build()
