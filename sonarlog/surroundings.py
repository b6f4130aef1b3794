"""What the robot knows of its surroundings while it drives: walls seen by the last scan, echoes of the last second.

Only for driving: nothing here is recorded or replayed. Must not know: commands, routes, time but the readings' own.
Frame: odometry's, metres; angles in degrees.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slam.sweep import TURN
from sonarlog.decode import Pose, Reading
from sonarlog.robot import Robot, Sonar

Floats = NDArray[np.float64]

FRESH_NS = 1_200_000_000
"""A sonar fires every 0.32 s; an echo older than this says nothing about what is there now."""

NEAR_M = 3.0  # walls further away do not matter to the next metre


class Wall(NamedTuple):
    """The tangent at a wall's nearest point: p on it satisfies n(normal_deg)·p = rho."""

    normal_deg: float
    rho: float


class Way(NamedTuple):
    """A direction to go, and how far from all walls the robot then stays, in metres."""

    heading_deg: float
    clearance: float


class Place(NamedTuple):
    """A pose in metres and degrees, heading unwrapped."""

    x: float
    y: float
    heading_deg: float


def place(pose: Pose) -> Place:
    """Metres and degrees from odometry's integers."""
    return Place(pose.x_um / 1e6, pose.y_um / 1e6, pose.heading * 360 / TURN)


def wrap(degrees: float) -> float:
    """To [-180, 180)."""
    return (degrees + 180) % 360 - 180


def walls_of(readings: Sequence[Reading], robot: Robot) -> tuple[Wall, ...]:
    """Walls (and whatever else reflects like one) seen by a scan.

    A wall answers a sonar with one and the same distance all the while its axis is within half a beam of the normal,
    so a wall is where many readings of several sonars agree in distance; its normal is the middle of their bearings.
    """
    near = [r for r in readings if 100 <= r.range_mm < NEAR_M * 1000]
    if not near:
        return ()
    beams = [(*beam_origin(r.pose, robot.sonars[r.sonar]), r.range_mm / 1000, r.sonar) for r in near]
    x, y, axis, distance, sonar = np.array(beams, dtype=np.float64).T
    angle = np.radians(axis)
    centre_x, centre_y = x.mean(), y.mean()
    reach = distance + (x - centre_x) * np.cos(angle) + (y - centre_y) * np.sin(angle)
    apart = np.abs(_wrap_array(axis[:, None] - axis[None, :]))
    agree = np.abs(reach[:, None] - reach[None, :])
    alike = (apart < 12) & (agree < 0.06)
    left = np.ones(len(near), dtype=bool)
    walls: list[Wall] = []
    while True:
        best = int(np.argmax((alike & left).sum(axis=1) * left))
        members = alike[best] & left
        if members.sum() < 10 or len(np.unique(sonar[members])) < 3:
            return tuple(walls)
        normal = axis[best] + float(np.mean(_wrap_array(axis[members] - axis[best])))
        n_x, n_y = np.cos(np.radians(normal)), np.sin(np.radians(normal))
        walls.append(Wall(wrap(normal), float(np.mean(reach[members]) + centre_x * n_x + centre_y * n_y)))
        left &= ~((apart[best] < 20) & (agree[best] < 0.15))


def best_way(walls: Sequence[Wall], here: Place, ahead_deg: float, metres: float) -> Way:
    """Where to go for so many metres: well clear of all walls (0.9 m is enough), else as much ahead as can be.

    Wide of 100° from `ahead_deg` is going back. In a corridor this is its axis, turned a little to the middle.
    """
    offsets = np.arange(-100.0, 101.0)
    theta = ahead_deg + offsets
    clearance = np.full(len(theta), NEAR_M)
    look = metres + 0.3
    for wall in walls:
        distance = distance_to(wall, here)
        clearance = np.minimum(clearance, distance - look * np.cos(np.radians(theta - wall.normal_deg)))
    score = np.minimum(clearance, 0.9) - 0.15 * np.radians(np.abs(offsets))
    best = int(np.argmax(score))
    return Way(float(theta[best]), float(clearance[best]))


def distance_to(wall: Wall, here: Place) -> float:
    """How far the wall's line is, in metres."""
    normal = np.radians(wall.normal_deg)
    return float(wall.rho - here.x * np.cos(normal) - here.y * np.sin(normal))


def beam_origin(pose: Pose, sonar: Sonar) -> tuple[float, float, float]:
    """Where a sonar sits and looks: x, y in metres, axis in degrees."""
    at = place(pose)
    cosine, sine = np.cos(np.radians(at.heading_deg)), np.sin(np.radians(at.heading_deg))
    x = at.x + (sonar.x_mm * cosine - sonar.y_mm * sine) / 1000
    y = at.y + (sonar.x_mm * sine + sonar.y_mm * cosine) / 1000
    return float(x), float(y), at.heading_deg + sonar.heading_deg


@dataclass(frozen=True)
class Echo:
    """What one sonar saw last: the point on its axis, None where nothing answered; and whether it saw that twice."""

    t_ns: int
    point: tuple[float, float] | None
    steady: bool


class Echoes:
    """The last reading of every sonar."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._last: dict[int, Echo] = {}

    def add(self, readings: Sequence[Reading]) -> None:
        """Take note of new readings."""
        for reading in readings:
            point = None
            if reading.range_mm < self._robot.max_range_mm:
                x, y, axis = beam_origin(reading.pose, self._robot.sonars[reading.sonar])
                angle = np.radians(axis)
                point = (
                    float(x + reading.range_mm / 1000 * np.cos(angle)),
                    float(y + reading.range_mm / 1000 * np.sin(angle)),
                )
            before = self._last.get(reading.sonar)
            steady = point is not None and before is not None and before.point is not None
            steady = steady and _apart(point, before.point if before else None) < 0.2
            self._last[reading.sonar] = Echo(reading.t_ns, point, steady)

    def room(self, here: Place, now_ns: int, *, backwards: bool = False) -> float:
        """Metres from the robot's hull to the nearest thing in its way, as far as the sonars that look there know.

        A wall at a slant shows only in the sonars near its normal, so those up to 50° off count too, where what they
        see is within 15 cm of the robot's track.
        """
        radius = self._robot.radius_mm / 1000
        room = NEAR_M
        for number, sonar in enumerate(self._robot.sonars):
            off = abs(wrap(sonar.heading_deg - (180 if backwards else 0)))
            seen = self._seen(number, here, now_ns)
            if seen is None or off > 50:
                continue
            ahead, aside = (-seen[0], seen[1]) if backwards else seen
            if off <= 20 or abs(aside) < radius + 0.15:
                room = min(room, ahead - radius)
        return room

    def side(self, sign: int, here: Place, now_ns: int) -> float | None:
        """Metres from the robot's centre to what the sonar looking to that side (+1 left, -1 right) steadily sees."""
        for number, sonar in enumerate(self._robot.sonars):
            if abs(sonar.heading_deg - 90 * sign) <= 10 and (echo := self._last.get(number)) and echo.steady:
                seen = self._seen(number, here, now_ns)
                if seen is not None and 0 < seen[1] * sign < 2.0:
                    return seen[1] * sign
        return None

    def _seen(self, number: int, here: Place, now_ns: int) -> tuple[float, float] | None:
        """The sonar's echo in the robot's frame, if it is fresh."""
        echo = self._last.get(number)
        if echo is None or echo.point is None or now_ns - echo.t_ns > FRESH_NS:
            return None
        dx, dy = echo.point[0] - here.x, echo.point[1] - here.y
        cosine, sine = np.cos(np.radians(here.heading_deg)), np.sin(np.radians(here.heading_deg))
        return float(dx * cosine + dy * sine), float(dy * cosine - dx * sine)


def _apart(a: tuple[float, float] | None, b: tuple[float, float] | None) -> float:
    return np.inf if a is None or b is None else float(np.hypot(a[0] - b[0], a[1] - b[1]))


def _wrap_array(degrees: Floats) -> Floats:
    wrapped: Floats = (degrees + 180) % 360 - 180
    return wrapped
