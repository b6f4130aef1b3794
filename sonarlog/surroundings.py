"""What the robot knows of its surroundings while it drives: walls seen by the last scan, echoes of the last second.

Only for driving: nothing here is recorded or replayed. Must not know: commands, routes, time but the readings' own.
Frame: odometry's, metres; angles in degrees.
"""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slam.sweep import TURN
from sonarlog.decode import Pose, Reading
from sonarlog.robot import Robot, Sonar

Floats = NDArray[np.float64]

FRESH_NS = 1_200_000_000
"""A sonar fires every 0.32 s; an echo older than this says nothing about what is there now."""

MEMORY_NS = 30_000_000_000
"""So long an echo is remembered: things in the way do not go, and odometry is good for so long."""

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


class Echo(NamedTuple):
    """A reading's point on the sonar's axis, None where nothing answered."""

    t_ns: int
    sonar: int
    point: tuple[float, float] | None


class Echoes:
    """What the sonars said in the last seconds."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._heard: deque[Echo] = deque()  # oldest first

    def add(self, readings: Sequence[Reading]) -> None:
        """Take note of new readings and forget old ones."""
        for reading in readings:
            point = None
            if reading.range_mm < self._robot.max_range_mm:
                x, y, axis = beam_origin(reading.pose, self._robot.sonars[reading.sonar])
                angle, metres = np.radians(axis), reading.range_mm / 1000
                point = (float(x + metres * np.cos(angle)), float(y + metres * np.sin(angle)))
            self._heard.append(Echo(reading.t_ns, reading.sonar, point))
        while self._heard and self._heard[-1].t_ns - self._heard[0].t_ns > MEMORY_NS:
            self._heard.popleft()

    def room(self, here: Place, *, backwards: bool = False) -> float:
        """Metres from the robot's hull to what the sonars that look there see now.

        A wall at a slant shows only in the sonars near its normal, so those up to 50° off count too, where what they
        see is within 15 cm of the robot's track.
        """
        radius = self._robot.radius_mm / 1000
        room = NEAR_M
        latest = {echo.sonar: echo for echo in self._heard if self._is_fresh(echo)}
        for echo in latest.values():
            off = abs(wrap(self._robot.sonars[echo.sonar].heading_deg - (180 if backwards else 0)))
            if echo.point is None or off > 50:
                continue
            ahead, aside = _seen_from(here, np.array([echo.point]), backwards=backwards)
            if off <= 20 or abs(aside[0]) < radius + 0.15:
                room = min(room, float(ahead[0]) - radius)
        return room

    def remembered_room(self, here: Place, *, backwards: bool = False) -> float:
        """Metres from the hull to what stood in its track a while ago, as several echoes of two sonars agree.

        A wall straight ahead lies between the beams of the two front sonars and shows in neither, but it did while
        the robot turned to it.
        """
        radius = self._robot.radius_mm / 1000
        echoes = [echo for echo in self._heard if echo.point is not None]
        sonar = np.array([echo.sonar for echo in echoes])
        ahead, aside = _seen_from(here, np.array([echo.point for echo in echoes]).reshape(-1, 2), backwards=backwards)
        room = NEAR_M
        for index in np.flatnonzero((ahead > 0) & (ahead < NEAR_M) & (np.abs(aside) < radius + 0.05)):
            near = np.hypot(ahead - ahead[index], aside - aside[index]) < 0.12
            if near.sum() >= 3 and len(np.unique(sonar[near])) >= 2:
                room = min(room, float(ahead[index]) - radius)
        return room

    def side(self, sign: int, here: Place) -> float | None:
        """Metres from the robot's centre to what the sonar looking to that side (+1 left, -1 right) saw twice."""
        last = [
            echo
            for echo in self._heard
            if abs(self._robot.sonars[echo.sonar].heading_deg - 90 * sign) <= 10 and self._is_fresh(echo)
        ][-2:]
        if len(last) < 2 or last[0].point is None or last[1].point is None:
            return None
        _, aside = _seen_from(here, np.array([last[0].point, last[1].point]))
        distance = float(aside[1]) * sign
        return distance if 0 < distance < 2.0 and abs(aside[1] - aside[0]) < 0.15 else None

    def _is_fresh(self, echo: Echo) -> bool:
        return self._heard[-1].t_ns - echo.t_ns <= FRESH_NS


def room_to_walls(walls: Sequence[Wall], here: Place, heading_deg: float, radius: float) -> float:
    """Metres the hull can go along a heading before it comes to one of the walls."""
    room = NEAR_M
    for wall in walls:
        slant = float(np.cos(np.radians(heading_deg - wall.normal_deg)))
        if slant > 0.5:
            room = min(room, (distance_to(wall, here) - radius) / slant)
    return room


def _seen_from(here: Place, points: Floats, *, backwards: bool = False) -> tuple[Floats, Floats]:
    """Points (n, 2) in the robot's frame: how far ahead (astern if `backwards`) and how far to the left."""
    dx, dy = points[:, 0] - here.x, points[:, 1] - here.y
    cosine, sine = np.cos(np.radians(here.heading_deg)), np.sin(np.radians(here.heading_deg))
    ahead = dx * cosine + dy * sine
    return (-ahead if backwards else ahead), dy * cosine - dx * sine


def _wrap_array(degrees: Floats) -> Floats:
    wrapped: Floats = (degrees + 180) % 360 - 180
    return wrapped
