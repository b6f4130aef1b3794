"""The driver: executes a route, one decision a SIP: samples in, commands out.

Must not know: the port, the clock, the session.
"""

from sonarlog.decode import Sample
from sonarlog.moves import STAND, Motion, Mover, Moves, Script
from sonarlog.protocol.packets import Sip
from sonarlog.robot import Robot
from sonarlog.route import Action, Follow, Go, Route, Scan, Turn, walk
from sonarlog.surroundings import best_way, wrap

HEADWAY_M = 0.2  # less than this before something in the way: the way is closed
CLEARANCE_M = 0.35  # a way that comes nearer to a wall is closed
STOP_M = 0.22  # room before the hull at which the robot stands


class Driver(Mover):
    """One route, driven by dead reckoning and what the sonars see."""

    def __init__(self, route: Route, robot: Robot, *, speed_mm_s: float = 300, scan_deg_s: float = 12) -> None:
        super().__init__(robot, speed_mm_s=speed_mm_s, scan_deg_s=scan_deg_s)
        self._route = route
        self._ahead_deg: float | None = None
        self._turned_last = False

    def _sense(self, sample: Sample, sip: Sip) -> None:
        super()._sense(sample, sip)
        if self._ahead_deg is None:
            self._ahead_deg = self._here.heading_deg

    def _drive(self) -> Script:
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
            return self._scan_here()
        if isinstance(action, Turn):
            return self._turn(action.degrees)
        if isinstance(action, Go):
            return self._go(action.metres)
        return self._follow(action)

    def _scan_here(self) -> Moves:
        # A turn just before must not run into the scan: a stop of this length tells them apart.
        yield from self._rest(16 if self._turned_last else 3)
        # Left and right by turns halves what odometry gets wrong.
        yield from self._scan(1 if self.sweeps % 2 == 0 else -1)
        return False

    def _turn(self, degrees: float) -> Moves:
        yield from self._rotate(degrees, 45)
        yield from self._rest()
        self._ahead_deg = self._here.heading_deg
        return False

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
