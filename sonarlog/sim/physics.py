"""What a sonar hears: the first surface that sends the ping back, as ultrasound does in rooms.

Walls are mirrors: a wall answers from the foot of the perpendicular on it, if that lies within its half beam of the
axis, whatever the axis' own angle (Fig. 4 of the paper). Concave corners answer from their point, poles from their
rim, convex edges weakly. All else is silence, or now and then the long way round by two walls.
Plain floats and + − * / sqrt only, one ping at a time: with the few dozen walls of a world this beats numpy.
Must not know: robots, odometry, time.
"""

from dataclasses import dataclass
from math import inf, sqrt

from slam.dmath import DEGREE, cos
from sonarlog.sim.corners import find_corners
from sonarlog.sim.rng import Noise
from sonarlog.sim.world import Pole, Wall, World

Echo = tuple[float, float, float]  # distance, and the unit vector along which it comes back

_GRAZE = 1e-6  # metres; an echo's own surface does not hide it


@dataclass(frozen=True)
class Acoustics:
    """How sonars err and what they can hear. By default 1 cm of noise and 4 % of wild readings."""

    noise_m: float = 0.010
    outliers: float = 0.04  # share of readings that are anything at all: crosstalk
    min_range_m: float = 0.1
    max_range_m: float = 5.0  # what a ping without an echo reads
    corner_half_beam_deg: float = 13.0
    edge_half_beam_deg: float = 6.0
    edge_echo: float = 0.6
    edge_range_m: float = 2.5  # scattered sound dies away
    bounce_echo: float = 0.06  # share of the silent pings that come home by way of two walls

    def __post_init__(self) -> None:
        if not 0 <= self.outliers <= 1 or not 0 <= self.noise_m <= 1:
            raise ValueError("outliers is a share between 0 and 1, noise at most 1 m")


QUIET = Acoustics(noise_m=0.0, outliers=0.0, bounce_echo=0.0, edge_echo=0.0)
"""Geometry alone, for tests."""


class Physics:
    """The sound of one world."""

    def __init__(self, world: World, acoustics: Acoustics, seed: int) -> None:
        self._acoustics = acoustics
        self._jitter = Noise(seed, "sonar noise")
        self._chance = Noise(seed, "sonar chance")
        self._walls = [_wall(wall) for wall in world.walls]
        self._poles = [_pole(pole) for pole in world.poles]
        self._corners = find_corners(world.walls)
        self._corner_cos = cos(acoustics.corner_half_beam_deg * DEGREE)
        self._edge_cos = cos(acoustics.edge_half_beam_deg * DEGREE)

    def range_m(self, n: int, x: float, y: float, ax: float, ay: float) -> float:
        """Ping number n from (x, y) along the unit axis (ax, ay): metres; the maximum where nothing answers."""
        limits = self._acoustics
        wild, luck, scatter, bounce = self._chance.chances(n)
        if wild < limits.outliers:  # the same number, stretched, says how wild
            return limits.min_range_m + wild / limits.outliers * (limits.max_range_m - limits.min_range_m)
        distance = self._first_echo(x, y, ax, ay, luck=luck, scatter=scatter)
        if distance == inf and bounce < limits.bounce_echo:
            distance = self._double_bounce(x, y, ax, ay)
        if limits.noise_m:
            distance += self._jitter.normal(n) * limits.noise_m
        return min(max(distance, limits.min_range_m), limits.max_range_m)

    def _first_echo(self, x: float, y: float, ax: float, ay: float, *, luck: float, scatter: float) -> float:
        echoes = self._from_walls(x, y, ax, ay, luck)
        echoes += self._from_corners(x, y, ax, ay, scatter)
        echoes += self._from_poles(x, y, ax, ay, luck)
        for distance, dx, dy in sorted(echoes):
            if self._hit(x, y, dx, dy)[0] > distance - _GRAZE:
                return distance
        return inf

    def _from_walls(self, x: float, y: float, ax: float, ay: float, luck: float) -> list[Echo]:
        echoes: list[Echo] = []
        for x0, y0, ux, uy, length, cos_half, echo in self._walls:
            cosine = ay * ux - ax * uy  # of the angle between the axis and the wall's left normal
            if -cos_half < cosine < cos_half or luck >= echo:
                continue
            dx, dy = x - x0, y - y0
            height = ux * dy - uy * dx  # over the wall, positive on its left
            if cosine * height < 0.0 and 0.0 <= dx * ux + dy * uy <= length:
                side = -1.0 if height > 0.0 else 1.0
                echoes.append((abs(height), -uy * side, ux * side))
        return echoes

    def _from_corners(self, x: float, y: float, ax: float, ay: float, scatter: float) -> list[Echo]:
        echoes: list[Echo] = []
        heard = scatter < self._acoustics.edge_echo
        for corner in self._corners:
            dx, dy = corner.x - x, corner.y - y
            along = dx * ax + dy * ay
            if along <= _GRAZE:
                continue
            distance = sqrt(dx * dx + dy * dy)
            if corner.faces(-dx, -dy):
                answers = corner.concave and along >= self._corner_cos * distance
            else:
                near = heard and distance <= self._acoustics.edge_range_m
                answers = near and corner.edge and along >= self._edge_cos * distance
            if answers:
                echoes.append((distance, dx / distance, dy / distance))
        return echoes

    def _from_poles(self, x: float, y: float, ax: float, ay: float, luck: float) -> list[Echo]:
        echoes: list[Echo] = []
        for cx, cy, radius, cos_half, echo in self._poles:
            dx, dy = cx - x, cy - y
            distance = sqrt(dx * dx + dy * dy)
            if distance > radius and luck < echo and dx * ax + dy * ay >= cos_half * distance:
                echoes.append((distance - radius, dx / distance, dy / distance))
        return echoes

    def _hit(self, x: float, y: float, dx: float, dy: float) -> tuple[float, int]:
        """How far the ray from (x, y) along that unit vector runs, and into which wall (-1: a pole, or nothing)."""
        nearest, which = inf, -1
        for i, (x0, y0, ux, uy, length, _, _) in enumerate(self._walls):
            across = dx * uy - dy * ux
            if across == 0.0:
                continue
            qx, qy = x0 - x, y0 - y
            t = (qx * uy - qy * ux) / across
            if _GRAZE < t < nearest and -_GRAZE <= (qx * dy - qy * dx) / across <= length + _GRAZE:
                nearest, which = t, i
        for cx, cy, radius, _, _ in self._poles:
            qx, qy = cx - x, cy - y
            along, aside = qx * dx + qy * dy, qx * dy - qy * dx
            if along > 0.0 and abs(aside) < radius:
                t = along - sqrt(radius * radius - aside * aside)
                if _GRAZE < t < nearest:
                    nearest, which = t, -1
        return nearest, which

    def _double_bounce(self, x: float, y: float, ax: float, ay: float) -> float:
        """Along the axis to the first wall, on as from a mirror to the next surface: that long is the way home, too."""
        first, which = self._hit(x, y, ax, ay)
        if which < 0:
            return inf
        _, _, ux, uy, *_ = self._walls[which]
        along = 2.0 * (ax * ux + ay * uy)
        second, _ = self._hit(x + first * ax, y + first * ay, along * ux - ax, along * uy - ay)
        return first + second


def _wall(wall: Wall) -> tuple[float, float, float, float, float, float, float]:
    """Start, unit vector along it, length, cosine of its half beam, share of pings it answers."""
    ux, uy = (wall.x1 - wall.x0) / wall.length, (wall.y1 - wall.y0) / wall.length
    return wall.x0, wall.y0, ux, uy, wall.length, cos(wall.material.half_beam_deg * DEGREE), wall.material.echo


def _pole(pole: Pole) -> tuple[float, float, float, float, float]:
    """Centre, radius, cosine of the half beam, share of pings it answers."""
    return pole.x, pole.y, pole.radius, cos(pole.material.half_beam_deg * DEGREE), pole.material.echo
