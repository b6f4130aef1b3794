"""What the robot knows of its surroundings while it drives: walls seen by the last scan, echoes of the last second.

Only for driving: nothing here is recorded or replayed. Must not know: commands, routes, time but the readings' own.
Frame: odometry's, metres; angles in degrees.
"""

from collections import deque
from collections.abc import Sequence
from math import cos, radians, sin, tan
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

GOES_ON_M = 0.7
NEAR_M = 3.0  # walls further away do not matter to the next metre


class Wall(NamedTuple):
    """The tangent at a wall's nearest point: p on it satisfies n(normal_deg)·p = rho.

    (x, y) is that point, which alone was seen: it may be an edge or a post as well.
    """

    normal_deg: float
    rho: float
    x: float
    y: float


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


def walls_of(
    readings: Sequence[Reading], robot: Robot, *, readings_needed: int = 10, sonars_needed: int = 3
) -> tuple[Wall, ...]:
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
        if members.sum() < readings_needed or len(np.unique(sonar[members])) < sonars_needed:
            return tuple(walls)
        normal = axis[best] + float(np.mean(_wrap_array(axis[members] - axis[best])))
        n_x, n_y = cos(radians(normal)), sin(radians(normal))
        far = float(np.mean(reach[members]))
        foot_x, foot_y = float(centre_x) + far * n_x, float(centre_y) + far * n_y
        walls.append(Wall(wrap(normal), foot_x * n_x + foot_y * n_y, foot_x, foot_y))
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
    normal = radians(wall.normal_deg)
    return wall.rho - here.x * cos(normal) - here.y * sin(normal)


def beam_origin(pose: Pose, sonar: Sonar) -> tuple[float, float, float]:
    """Where a sonar sits and looks: x, y in metres, axis in degrees."""
    at = place(pose)
    cosine, sine = cos(radians(at.heading_deg)), sin(radians(at.heading_deg))
    x = at.x + (sonar.x_mm * cosine - sonar.y_mm * sine) / 1000
    y = at.y + (sonar.x_mm * sine + sonar.y_mm * cosine) / 1000
    return x, y, at.heading_deg + sonar.heading_deg


class Echoes:
    """What the sonars said in the last half minute."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._readings: deque[Reading] = deque()  # oldest first

    def add(self, readings: Sequence[Reading]) -> None:
        """Take note of new readings and forget old ones."""
        self._readings += readings
        while self._readings and self._readings[-1].t_ns - self._readings[0].t_ns > MEMORY_NS:
            self._readings.popleft()

    def forget(self) -> None:
        """What was heard lies somewhere else now."""
        self._readings.clear()

    def room(self, here: Place, *, backwards: bool = False, last: int = 1) -> float:
        """Metres from the robot's hull to what the sonars that look there see now, by the `last` readings of each.

        A wall at a slant shows only in the sonars near its normal, so those up to 50° off count too, where what they
        see is within 15 cm of the robot's track.
        """
        radius = self._robot.radius_mm / 1000
        room = NEAR_M
        for number, sonar in enumerate(self._robot.sonars):
            off = abs(wrap(sonar.heading_deg - (180 if backwards else 0)))
            if off > 50:
                continue
            for seen in [self._point(reading, here) for reading in self._fresh(number, last)]:
                if seen is None:
                    continue
                ahead, aside = (-seen[0], seen[1]) if backwards else seen
                if off <= 20 or abs(aside) < radius + 0.15:
                    room = min(room, ahead - radius)
        return room

    def walls(self) -> tuple[Wall, ...]:
        """Walls in what was heard in the last half minute, on less evidence than a scan gives.

        A wall straight ahead lies between the beams of the two front sonars and shows in neither, but it did while
        the robot turned to it.
        """
        return walls_of(self._readings, self._robot, readings_needed=4, sonars_needed=2)

    def points(self) -> Floats:
        """Where the near echoes of the last half minute lie (n, 2), without those that stand alone."""
        return points_of(self._readings, self._robot)

    def side(self, sign: int, here: Place) -> float | None:
        """Metres from the robot's centre to what the sonar looking to that side (+1 left, -1 right) saw twice."""
        for number, sonar in enumerate(self._robot.sonars):
            if abs(sonar.heading_deg - 90 * sign) > 10:
                continue
            points = [self._point(reading, here) for reading in self._fresh(number, 2)]
            asides = [point[1] * sign for point in points if point is not None]
            if len(asides) == 2 and abs(asides[1] - asides[0]) < 0.15 and 0 < asides[0] < 2.0:
                return asides[0]
        return None

    def _fresh(self, sonar: int, count: int) -> list[Reading]:
        """The last so many readings of that sonar, newest first, without what is too old to be of now."""
        found: list[Reading] = []
        for reading in reversed(self._readings):
            if self._readings[-1].t_ns - reading.t_ns > FRESH_NS or len(found) == count:
                break
            if reading.sonar == sonar:
                found.append(reading)
        return found

    def _point(self, reading: Reading, here: Place) -> tuple[float, float] | None:
        """The point on the sonar's axis where the echo came from, ahead and to the left of the robot; None: no echo."""
        if reading.range_mm >= self._robot.max_range_mm:
            return None
        x, y, axis = beam_origin(reading.pose, self._robot.sonars[reading.sonar])
        dx = x + reading.range_mm / 1000 * cos(radians(axis)) - here.x
        dy = y + reading.range_mm / 1000 * sin(radians(axis)) - here.y
        cosine, sine = cos(radians(here.heading_deg)), sin(radians(here.heading_deg))
        return dx * cosine + dy * sine, dy * cosine - dx * sine


def room_to_walls(walls: Sequence[Wall], here: Place, heading_deg: float, radius: float) -> float:
    """Metres the hull can go along a heading before it comes to a point that was seen of a wall.

    Where a track meets a wall further from that point, at a slant, the sonars to the front see it in time.
    """
    room = NEAR_M
    for wall in walls:
        off = radians(heading_deg - wall.normal_deg)
        if cos(off) < 0.5:
            continue
        # Along the wall, from the point that was seen to where the track meets it.
        along = radians(wall.normal_deg + 90)
        beside = (here.x - wall.x) * cos(along) + (here.y - wall.y) * sin(along)
        if abs(beside + distance_to(wall, here) * tan(off)) < radius + 0.1:
            room = min(room, (distance_to(wall, here) - radius) / cos(off))
    return room


def room_at_slant(walls: Sequence[Wall], here: Place, heading_deg: float, radius: float) -> float:
    """Metres the hull can go along a heading before it touches a wall that no sonar hears, if that goes on as seen.

    One 55° to 80° off the heading lies between the beams to the front and those to the side. That it goes on for
    `GOES_ON_M` from the point that was seen is likely, and where it does not the robot only comes another way.
    """
    room = NEAR_M
    for wall in walls:
        off = radians(heading_deg - wall.normal_deg)
        if not 0.17 < cos(off) < 0.58:
            continue
        gap = max((distance_to(wall, here) - radius) / cos(off), 0.0)
        along = radians(wall.normal_deg + 90)
        beside = (here.x - wall.x) * cos(along) + (here.y - wall.y) * sin(along)
        if abs(beside + gap * sin(off)) < GOES_ON_M:
            room = min(room, gap)
    return room


def points_of(readings: Sequence[Reading], robot: Robot) -> Floats:
    """Where a scan's near echoes lie (n, 2), each with two others within 10 cm of it: wild readings stand alone."""
    near = [r for r in readings if 100 <= r.range_mm < NEAR_M / 2 * 1000]
    if not near:
        return np.zeros((0, 2))
    beams = np.array([(*beam_origin(r.pose, robot.sonars[r.sonar]), r.range_mm / 1000) for r in near])
    axis = np.radians(beams[:, 2])
    points = beams[:, :2] + beams[:, 3:] * np.stack([np.cos(axis), np.sin(axis)], axis=1)
    apart = np.hypot(*np.moveaxis(points[:, None] - points[None, :], -1, 0))
    return np.asarray(points[(apart < 0.10).sum(axis=1) >= 3])


def unrefuted(points: Floats, scan: Floats, here: Place) -> Floats:
    """The points of earlier scans that are no nearer than anything a scan from here heard.

    The nearest point of any surface answers a full turn; what an earlier scan had nearer were wild readings.
    """
    nearest, away = (np.hypot(some[:, 0] - here.x, some[:, 1] - here.y) for some in (scan, points))
    return np.asarray(points[away >= nearest.min(initial=NEAR_M / 2)])


def room_to_points(points: Floats, here: Place, heading_deg: float, radius: float) -> float:
    """Metres that a disc of that radius can go along a heading before it touches one of the points."""
    cosine, sine = cos(radians(heading_deg)), sin(radians(heading_deg))
    x, y = points[:, 0] - here.x, points[:, 1] - here.y
    ahead, aside = x * cosine + y * sine, y * cosine - x * sine
    hit = (np.abs(aside) < radius) & (ahead > 0)
    if not hit.any():
        return NEAR_M
    return float(np.min(ahead[hit] - np.sqrt(radius * radius - aside[hit] ** 2)))


def _wrap_array(degrees: Floats) -> Floats:
    wrapped: Floats = (degrees + 180) % 360 - 180
    return wrapped
