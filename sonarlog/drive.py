"""The driver: executes a route, one decision a SIP: samples in, commands out.

Each action is a generator that yields the motion it wants until the next SIP and returns whether the way was closed.
Must not know: the port, the clock, the session.
"""

from collections.abc import Generator
from typing import NamedTuple

from sonarlog.decode import Reading, Sample
from sonarlog.log import Event
from sonarlog.protocol.commands import Command, encode_command
from sonarlog.protocol.packets import Sip
from sonarlog.robot import Robot
from sonarlog.route import Action, Follow, Go, Route, Scan, Turn, walk
from sonarlog.surroundings import Echoes, Place, Wall, best_way, place, room_to_walls, walls_of, wrap

SAY_AGAIN_NS = 500_000_000  # commands are never acknowledged
OVERLAP_DEG = 6.0  # more than a full circle, so that it closes even where odometry turns too fast
HEADWAY_M = 0.2  # less than this before something in the way: the way is closed
CLEARANCE_M = 0.35  # a way that comes nearer to a wall is closed
STOP_M = 0.22  # room before the hull at which the robot stands
SCAN_VALID_M = 1.0  # walls seen by a scan further back than this are not relied on


class Motion(NamedTuple):
    """Speeds to keep until the next SIP: mm/s forwards, °/s counter-clockwise."""

    forward: float = 0.0
    turn: float = 0.0


STAND = Motion()
Moves = Generator[Motion, None, bool]
Pause = Generator[Motion, None, None]


class Driver:
    """One route, driven by dead reckoning and what the sonars see. `sweeps` counts scans done."""

    def __init__(self, route: Route, robot: Robot, *, speed_mm_s: float = 300, scan_deg_s: float = 12) -> None:
        self.finished = False
        self.sweeps = 0
        self._route = route
        self._robot = robot
        self._speed = min(speed_mm_s, robot.max_velocity_mm_s)
        self._scan_rate = min(scan_deg_s, robot.max_turn_deg_s)
        self._echoes = Echoes(robot)
        self._walls: tuple[Wall, ...] = ()
        self._scanned_at: Place | None = None
        self._recalled: tuple[Wall, ...] = ()
        self._recalled_ns = -1_000_000_000
        self._scan_readings: list[Reading] | None = None
        self._ahead_deg: float | None = None
        self._turned_last = False
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
        moved = _distance(here, self._here)
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
        if self._ahead_deg is None:
            self._ahead_deg = here.heading_deg

    def _say(self, motion: Motion) -> bytes:
        speeds = (round(motion.forward), round(motion.turn))
        if speeds == self._said and self._now_ns - self._said_ns < SAY_AGAIN_NS:
            return b""
        self._said, self._said_ns = speeds, self._now_ns
        return encode_command(Command.VEL, speeds[0]) + encode_command(Command.RVEL, speeds[1])

    def _drive(self) -> Generator[Motion, None, None]:
        walker = walk(self._route)
        try:
            action = next(walker)
            while True:
                closed = yield from self._do(action)
                self._turned_last = isinstance(action, Turn)
                action = walker.send(closed)
        except StopIteration:
            self._event("info", "the route is done")

    def _do(self, action: Action) -> Moves:
        if isinstance(action, Scan):
            return self._scan()
        if isinstance(action, Turn):
            return self._turn(action.degrees)
        if isinstance(action, Go):
            return self._go(action.metres)
        return self._follow(action)

    def _scan(self) -> Moves:
        # A turn just before must not run into the scan: a stop of this length tells them apart.
        yield from self._rest(16 if self._turned_last else 3)
        way = 1 if self.sweeps % 2 == 0 else -1  # left and right by turns halves what odometry gets wrong
        while True:
            self._anew, begin = False, self._here
            self._event("info", f"sweep {self.sweeps} begins, turning {'left' if way > 0 else 'right'}")
            readings: list[Reading] = []
            self._scan_readings = readings
            stuck = yield from self._rotate(way * (360 + OVERLAP_DEG), self._scan_rate, brake=False)
            yield from self._rest()
            self._scan_readings = None
            if not self._anew:
                break
            self._event("warn", f"sweep {self.sweeps} is done again: odometry began anew in it")
        turned = abs(self._here.heading_deg - begin.heading_deg)
        self._walls, self._scanned_at = walls_of(readings, self._robot), self._here
        text = f"sweep {self.sweeps} ends after {turned:.0f}° with {len(readings)} readings"
        self._event("warn" if stuck else "info", text)
        self.sweeps += not stuck
        yield from self._rotate(begin.heading_deg + way * 360 - self._here.heading_deg, 30)
        yield from self._rest()
        return False

    def _turn(self, degrees: float) -> Moves:
        yield from self._rotate(degrees, 45)
        yield from self._rest()
        self._ahead_deg = self._here.heading_deg
        return False

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

    def _go(self, metres: float) -> Moves:
        return (yield from self._travel("go", metres, self._here.heading_deg, steer=False))

    def _follow(self, action: Follow) -> Moves:
        heading = self._here.heading_deg
        if self._scan_is_near():
            ahead = heading if self._ahead_deg is None else self._ahead_deg
            way = best_way(self._walls, self._here, ahead, action.metres)
            # To the side there has to be more room, or the robot turns round at a dead end.
            if way.clearance < CLEARANCE_M * (1 + abs(wrap(way.heading_deg - ahead)) / 90):
                self._event("info", f"follow {action.metres:g}: the way ahead is closed")
                return True
            turn = wrap(way.heading_deg - heading)
            heading += turn
            if abs(turn) > 3:
                yield from self._rotate(turn, 45)
                yield from self._rest()
        return (yield from self._travel("follow", action.metres, heading, steer=True))

    def _travel(self, name: str, metres: float, heading_deg: float, *, steer: bool) -> Moves:
        """So many metres along a heading, braking before what is in the way; True if that is no way at all."""
        begin = self._path
        way = 1 if metres >= 0 else -1
        self._stalled = False
        standing_ns: int | None = None
        blocked = False
        while (left := abs(metres) - (self._path - begin)) > 0.01 and not blocked:
            speed = min(self._speed, max(30.0, 900 * left), 900 * (self._room(way) - STOP_M))
            if speed < 25:
                speed = 0.0
                standing_ns = standing_ns or self._now_ns
                blocked = self._now_ns - standing_ns > 1_000_000_000  # an echo heard once is no wall
            elif self._stalled:
                blocked = True
            else:
                standing_ns = None
            aim = heading_deg
            if steer and speed:
                heading_deg, aim = self._steer(heading_deg)
            off = wrap(aim - self._here.heading_deg)
            yield STAND if blocked else Motion(way * speed, max(-10.0, min(10.0, 1.5 * off)) if speed else 0.0)
        yield from self._rest()
        self._ahead_deg = self._here.heading_deg
        done = self._path - begin
        if blocked:
            why = "the wheels stalled" if self._stalled else "something is in the way"
            self._event("warn", f"{name} {metres:g}: stopped after {done:.2f} m, {why}")
        return blocked and done < HEADWAY_M

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
        return self._scanned_at is not None and _distance(self._scanned_at, self._here) < SCAN_VALID_M

    def _steer(self, heading_deg: float) -> tuple[float, float]:
        """(the corridor's heading as far as known, the heading to steer): towards the middle of both sides.

        Between two walls, what stays off the middle turns the idea of the corridor's heading; with one wall only, the
        robot just keeps off it.
        """
        left, right = self._echoes.side(1, self._here), self._echoes.side(-1, self._here)
        off = 0.0  # metres the middle is to the left
        if left is not None and right is not None:
            off = (left - right) / 2
            heading_deg += max(-0.3, min(0.3, 0.3 * off))
        elif left is not None:
            off = min(0.0, left - 0.6)
        elif right is not None:
            off = max(0.0, 0.6 - right)
        return heading_deg, heading_deg + max(-10.0, min(10.0, 40 * off))

    def _event(self, level: str, text: str) -> None:
        self._events.append(Event(self._now_ns, level, text))


def _distance(a: Place, b: Place) -> float:
    return float(((a.x - b.x) ** 2 + (a.y - b.y) ** 2) ** 0.5)
