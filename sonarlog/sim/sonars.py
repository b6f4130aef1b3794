"""The sonar server: which disc fires when, and what it read.

Must not know: packets, sessions, who asks.
"""

from slam.dmath import DEGREE, sincos
from sonarlog.robot import Robot
from sonarlog.sim.body import Body
from sonarlog.sim.faults import SonarFaults
from sonarlog.sim.physics import Physics

_ARRAY = 8  # discs an array; one of each array fires at a time
_CYCLE_MS = range(2, 121)
_FITS = 64  # readings that a packet has room for


class Sonars:
    """The robot's discs, fired in turn, one an array a cycle; `new` holds (disc, range in robot units) until taken."""

    def __init__(self, robot: Robot, body: Body, physics: Physics, faults: SonarFaults) -> None:
        self._robot = robot
        self._body = body
        self._physics = physics
        self._stuck_mm = faults.stuck_mm
        headings = [sonar.heading_deg for sonar in robot.sonars]
        for n, error in enumerate(faults.mounting_deg):
            headings[n] += error
        self._mounted = [
            (s.x_mm / 1000, s.y_mm / 1000, *sincos(heading * DEGREE))
            for s, heading in zip(robot.sonars, headings, strict=True)
        ]
        self._pings = 0
        self.reset(0)

    @property
    def arrays(self) -> int:
        """How many arrays the robot has."""
        return -(-len(self._mounted) // _ARRAY)

    def reset(self, now_ns: int) -> None:
        """On, in the order and at the pace of the robot's memory; the first ping comes a cycle from now."""
        self.on = True
        self.new: list[tuple[int, int]] = []
        self._order = [tuple(range(first, len(self._mounted), _ARRAY)) for first in range(_ARRAY)]
        self._next = 0
        self._cycle_ns = self._robot.sonar_cycle_ms * 1_000_000
        self._due_ns = now_ns + self._cycle_ns

    def poll(self, discs: bytes) -> None:
        """Fire these discs, counted from 1, in this order; none at all if it is empty."""
        self._order = [(disc - 1,) for disc in discs if 1 <= disc <= len(self._mounted)]
        self._next = 0

    def set_cycle(self, cycle_ms: int) -> None:
        """Milliseconds from ping to ping, 2 to 120; others change nothing."""
        if cycle_ms in _CYCLE_MS:
            self._cycle_ns = cycle_ms * 1_000_000

    def tick(self, now_ns: int) -> None:
        """Fire what is due. The beat goes on while the sonars are off."""
        while self._due_ns <= now_ns:
            self._due_ns += self._cycle_ns
            if self.on and self._order:
                self.new.extend((disc, self._ping(disc)) for disc in self._order[self._next])
                self._next = (self._next + 1) % len(self._order)

    def take(self) -> tuple[tuple[int, int], ...]:
        """The readings that are new since the last call, in order of firing; of too many, the oldest are lost."""
        new, self.new = tuple(self.new[-_FITS:]), []
        return new

    def _ping(self, disc: int) -> int:
        mx, my, sine, cosine = self._mounted[disc]
        body = self._body
        turned, ahead = sincos(body.heading)
        x, y = body.x + mx * ahead - my * turned, body.y + mx * turned + my * ahead
        axis = cosine * ahead - sine * turned, sine * ahead + cosine * turned
        metres = self._physics.range_m(self._pings, x, y, *axis)
        self._pings += 1
        return round(self._stuck_mm.get(disc, metres * 1000) / self._robot.range_mm_per_unit)
