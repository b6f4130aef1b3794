"""A recording as the plain CSV that `sonarlog import csv` takes, and back comes the same log.

Must not know: recordings, files.
"""

from collections.abc import Iterator
from typing import NamedTuple

from slam.sweep import TURN
from sonarlog.log import Log
from sonarlog.robot import RADIANS, Robot


class Place(NamedTuple):
    """Where the robot was: µm, µm, 1/2^20 of a turn."""

    x_um: int
    y_um: int
    heading: int


class Moment:
    """What is known of one moment: the robot's place, whether the robot reported it then, mm by sonar."""

    def __init__(self, place: Place, *, reported: bool) -> None:
        self.place, self.reported = place, reported
        self.ranges: dict[int, int] = {}

    def takes(self, place: Place, sonar: int) -> bool:
        """Whether a reading from there can be told in this moment's line."""
        return self.place == place and sonar not in self.ranges


def csv_lines(log: Log) -> Iterator[str]:
    """Line after line, with comment lines of the robot first.

    Each packet's odometry and each reading stands at its own moment. Where two say different things of one moment the
    reading is told a nanosecond later; a reading fired before the clock's zero is told at it.
    """
    yield from _robot_lines(log.robot)
    ranges = [f"r{sonar}_m" for sonar in range(len(log.robot.sonars))]
    yield ",".join(["t_s", "x_m", "y_m", "theta_deg", "odometry", *ranges])
    for t_ns, moment in sorted(_moments(log).items()):
        x_um, y_um, heading = moment.place
        place = f"{_decimal(x_um, 6)},{_decimal(y_um, 6)},{_degrees(heading)}"
        cells = [_decimal(moment.ranges[k], 3) if k in moment.ranges else "" for k in range(len(ranges))]
        yield ",".join([_decimal(t_ns, 9), place, str(int(moment.reported)), *cells])


def _robot_lines(robot: Robot) -> Iterator[str]:
    yield f"# name: {robot.name}"
    yield f"# half_beam_deg: {robot.half_beam_deg!r}"
    yield f"# max_range_mm: {robot.max_range_mm}"
    yield f"# radius_mm: {robot.radius_mm}"
    for sonar, mounting in zip(robot.sonars, robot.ring().mountings, strict=True):
        # A calibrated robot's sonars look where they were found to look.
        heading = sonar.heading_deg if robot.calibration is None else mounting.heading / RADIANS
        yield f"# sonar: {sonar.x_mm!r} {sonar.y_mm!r} {heading!r}"


def _moments(log: Log) -> dict[int, Moment]:
    odometry, readings = log.odometry, log.readings
    columns = (odometry.t_ns, odometry.x_um, odometry.y_um, odometry.heading)
    moments = {
        max(0, t_ns): Moment(Place(x_um, y_um, heading), reported=True)
        for t_ns, x_um, y_um, heading in zip(*(column.tolist() for column in columns), strict=True)
    }
    fired = (readings.t_ns, readings.sonar, readings.range_mm, readings.x_um, readings.y_um, readings.heading)
    for t_ns, sonar, range_mm, *where in zip(*(column.tolist() for column in fired), strict=True):
        place, at = Place(*where), max(0, t_ns)
        while at in moments and not moments[at].takes(place, sonar):
            at += 1
        moments.setdefault(at, Moment(place, reported=False)).ranges[sonar] = range_mm
    return moments


def _decimal(value: int, places: int) -> str:
    """An integer of 10^−places, written out."""
    whole, rest = divmod(abs(value), 10**places)
    return f"{'-' if value < 0 else ''}{whole}.{rest:0{places}d}"


def _degrees(heading: int) -> str:
    """Within ±180°, to a hundredth of the unit."""
    turned = (heading + TURN // 2) % TURN - TURN // 2
    return f"{turned * 360 / TURN:.6f}"
