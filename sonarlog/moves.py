"""How a robot is moved: one motion a SIP, scans and turns on the spot, and what its sonars say of the way ahead.

An action is a generator that yields the motion it wants until the next SIP and returns whether the way was closed.
Must not know: the port, the clock, the session, what it all is for (a route, an exploration).
"""

from abc import ABC, abstractmethod
from collections.abc import Generator
from typing import NamedTuple

import numpy as np

from sonarlog.decode import Reading, Sample
from sonarlog.log import Event
from sonarlog.protocol.commands import Command, encode_command
from sonarlog.protocol.packets import Sip
from sonarlog.robot import Robot
from sonarlog.surroundings import Echoes, Floats, Place, Wall, place, points_of, room_to_walls, unrefuted, walls_of

SAY_AGAIN_NS = 500_000_000  # commands are never acknowledged
OVERLAP_DEG = 6.0  # more than a full circle, so that it closes even where odometry turns too fast
SCANS_KEPT = 4
AGAIN = 5  # so often a sweep is begun anew
SCAN_VALID_M = 1.0  # walls seen by a scan further back than this are not relied on


class Motion(NamedTuple):
    """Speeds to keep until the next SIP: mm/s forwards, °/s counter-clockwise."""

    forward: float = 0.0
    turn: float = 0.0


STAND = Motion()


class Decided(NamedTuple):
    """A decision as it is recorded: when it was taken, and all that was decided as JSON."""

    t_ns: int
    json: str


Moves = Generator[Motion, None, bool]
Pause = Generator[Motion, None, None]
Script = Generator[Motion, None, None]


class Mover(ABC):
    """A robot driven by dead reckoning and what the sonars see; a subclass says what there is to do.

    `finished`: all of it is done. `sweeps` counts scans done.
    """

    def __init__(self, robot: Robot, *, speed_mm_s: float, scan_deg_s: float) -> None:
        self.finished = False
        self.sweeps = 0
        self._robot = robot
        self._speed = min(speed_mm_s, robot.max_velocity_mm_s)
        self._scan_rate = min(scan_deg_s, robot.max_turn_deg_s)
        self._echoes = Echoes(robot)
        self._walls: tuple[Wall, ...] = ()
        self._scans: list[Floats] = []  # near echoes of the last few
        self._points: Floats = np.zeros((0, 2))  # all of them
        self._scanned_at: Place | None = None
        self._recalled: tuple[Wall, ...] = ()
        self._recalled_ns = -1_000_000_000
        self._scan_readings: list[Reading] | None = None
        self._now_ns = 0
        self._here = Place(0.0, 0.0, 0.0)
        self._path = 0.0  # metres driven
        self._still_sips = 0
        self._stalled = False
        self._session: int | None = None
        self._anew = False  # odometry has begun anew since this was looked at last
        self._said: tuple[int, int] | None = None
        self._said_ns = 0
        self._events: list[Event] = []
        self._script = self._drive()

    def take_events(self) -> list[Event]:
        """What happened since this was asked last."""
        events, self._events = self._events, []
        return events

    def take_decisions(self) -> list[Decided]:
        """What was decided since this was asked last."""
        return []

    def hear(self, sample: Sample) -> None:  # noqa: B027  # a route has no use for it
        """Every packet of the robot, whether it may be driven just then or not."""

    def step(self, sample: Sample) -> bytes:
        """What to send after this SIP; samples of other packets, and a finished route, send nothing."""
        if sample.pose is None or not isinstance(sample.packet, Sip) or self.finished:
            return b""
        self._sense(sample, sample.packet)
        try:
            motion = next(self._script)
        except StopIteration:
            self.finished = True
            motion = STAND
        return self._say(motion)

    def _sense(self, sample: Sample, sip: Sip) -> None:
        assert sample.pose is not None
        here = place(sample.pose)
        moved = distance(here, self._here)
        self._path += moved
        still = moved < 0.002 and abs(here.heading_deg - self._here.heading_deg) < 0.15
        self._still_sips = self._still_sips + 1 if still else 0
        self._stalled |= sip.stalled
        self._anew |= self._session is not None and sample.session != self._session
        self._session = sample.session
        self._now_ns, self._here = sample.t_ns, here
        self._echoes.add(sample.readings)
        if self._scan_readings is not None:
            self._scan_readings += sample.readings

    def _say(self, motion: Motion) -> bytes:
        speeds = (round(motion.forward), round(motion.turn))
        if speeds == self._said and self._now_ns - self._said_ns < SAY_AGAIN_NS:
            return b""
        self._said, self._said_ns = speeds, self._now_ns
        return encode_command(Command.VEL, speeds[0]) + encode_command(Command.RVEL, speeds[1])

    @abstractmethod
    def _drive(self) -> Script:
        """Everything there is to do, motion after motion."""

    def _enough(self) -> bool:
        """Whether to stop, be it on the way; a subclass may have reasons."""
        return False

    def _scan(self, way: int) -> Moves:
        """A full circle, left (1) or right (-1), and back to where the robot looked; True if it does not turn."""
        for again in range(AGAIN, -1, -1):
            self._anew, begin = False, self._here
            self._event("info", f"sweep {self.sweeps} begins, turning {'left' if way > 0 else 'right'}")
            readings: list[Reading] = []
            self._scan_readings = readings
            stuck = yield from self._rotate(way * (360 + OVERLAP_DEG), self._scan_rate, brake=False)
            yield from self._rest()
            self._scan_readings = None
            if not self._anew:
                break
            if self._enough() or not again:
                self._event("error", f"sweep {self.sweeps} is given up: odometry began anew in it")
                return True
            self._event("warn", f"sweep {self.sweeps} is done again: odometry began anew in it")
        turned = abs(self._here.heading_deg - begin.heading_deg)
        self._walls, self._scanned_at = walls_of(readings, self._robot), self._here
        new = points_of(readings, self._robot)
        self._scans = [*(unrefuted(points, new, self._here) for points in self._scans[1 - SCANS_KEPT :]), new]
        self._points = np.concatenate(self._scans)
        text = f"sweep {self.sweeps} ends after {turned:.0f}° with {len(readings)} readings"
        self._event("warn" if stuck else "info", text)
        self.sweeps += not stuck
        yield from self._rotate(begin.heading_deg + way * 360 - self._here.heading_deg, 30)
        yield from self._rest()
        return stuck

    def _rotate(self, degrees: float, rate: float, *, brake: bool = True) -> Moves:
        """By so many degrees (±1 with `brake`, else at least so many); True if the robot does not turn."""
        goal = self._here.heading_deg + degrees
        way = 1 if degrees > 0 else -1
        best, since_ns = abs(degrees), self._now_ns
        while (left := (goal - self._here.heading_deg) * way) > (1.0 if brake else 0.0):
            if left < best - 1:
                best, since_ns = left, self._now_ns
            if self._now_ns - since_ns > 5_000_000_000:
                self._event("error", "the robot does not turn")
                return True
            yield Motion(turn=way * (min(rate, max(3.0, 1.5 * left)) if brake else rate))
        return False

    def _rest(self, sips: int = 3) -> Pause:
        """Until the robot has stood still for so many SIPs, or for three seconds."""
        begin_ns = self._now_ns
        self._still_sips = 0
        while self._still_sips < sips and self._now_ns - begin_ns < 3_000_000_000:
            yield STAND

    def _room(self, way: int) -> float:
        """Metres in front of the hull: what the sonars see, and the walls known from before."""
        heading = self._here.heading_deg + (0 if way > 0 else 180)
        known = room_to_walls(self._known_walls(), self._here, heading, self._robot.radius_mm / 1000)
        return min(known, self._echoes.room(self._here, backwards=way < 0))

    def _known_walls(self) -> tuple[Wall, ...]:
        """What the last scan saw, if it is near, else what was seen on the way here; that looked up once a second."""
        if self._scan_is_near():
            return self._walls
        if self._now_ns - self._recalled_ns >= 1_000_000_000:
            self._recalled, self._recalled_ns = self._echoes.walls(), self._now_ns
        return self._recalled

    def _scan_is_near(self) -> bool:
        return self._scanned_at is not None and distance(self._scanned_at, self._here) < SCAN_VALID_M

    def _event(self, level: str, text: str) -> None:
        self._events.append(Event(self._now_ns, level, text))


def distance(a: Place, b: Place) -> float:
    """Metres."""
    return float(((a.x - b.x) ** 2 + (a.y - b.y) ** 2) ** 0.5)
