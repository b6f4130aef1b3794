"""The follower: drives along a path, slows down and stops before what the sonars say, gets off what it touched.

Must not know: where paths come from, maps, the port.
"""

from math import atan2, degrees, hypot

import numpy as np

from slam.dmath import Floats
from sonarlog.decode import Sample
from sonarlog.moves import STAND, Motion, Mover, Moves, Pause, distance
from sonarlog.protocol.packets import Sip
from sonarlog.robot import Robot
from sonarlog.safety import BUMPS
from sonarlog.surroundings import room_at_slant, room_to_points, wrap

SECOND = 1_000_000_000
AHEAD_M = 0.30  # the point of the path that the robot steers at is so far along it
ASTRAY_M = 0.25  # further off the path than this is where nobody has looked whether it is free
STOP_M = 0.12  # room before the hull at which the robot stands
BESIDE_M = 0.06  # room beside the hull
ON_THE_SPOT_DEG = 25.0  # further off than this it turns before it goes on
WAIT_NS = 1_500_000_000  # an echo heard once is no wall
BACK_M = 0.12  # off what was touched
CREEP_MM_S, CREEP_STOP_M, CREEP_BESIDE_M = 80.0, 0.25, 0.12  # while it is not sure where it is


class Follower(Mover):
    """A mover along paths in odometry's frame. While it is not `sure` where it is it creeps, and keeps further off."""

    def __init__(self, robot: Robot, *, speed_mm_s: float, turn_deg_s: float, scan_deg_s: float) -> None:
        super().__init__(robot, speed_mm_s=speed_mm_s, scan_deg_s=scan_deg_s)
        self.sure = True
        self._turn_rate = min(turn_deg_s, robot.max_turn_deg_s)
        self._last_turn = -1
        self._touched = ""
        self._passed: Floats = np.zeros((0, 2))  # near echoes of the last half minute, looked up twice a second
        self._passed_ns = -SECOND

    @property
    def metres(self) -> float:
        """Driven so far."""
        return self._path

    def _sense(self, sample: Sample, sip: Sip) -> None:
        interrupted = self._session is not None and sample.session != self._session
        super()._sense(sample, sip)
        if interrupted:
            self._forget()
        if sip.stall_bumps & BUMPS:
            self._touched = "a bumper was hit"
        elif sip.stalled:
            self._touched = "the wheels stalled"

    def _forget(self) -> None:
        """Odometry was interrupted: nobody knows how far the robot went meanwhile, nor where what it saw lies."""
        self.sure = False
        self._event("warn", "odometry was interrupted: a scan where it stands, then slowly until it knows the walls")
        self._echoes.forget()
        self._scans, self._points, self._passed = [], np.zeros((0, 2)), np.zeros((0, 2))
        self._walls, self._recalled, self._scanned_at = (), (), None

    def _look_round(self) -> Moves:
        """A scan, the other way round than the turn before; True if the robot does not turn."""
        self._last_turn = -self._last_turn
        return (yield from self._scan(self._last_turn))

    def _along(self, points: Floats) -> Moves:
        """Along a path (n, 2) m; True where something is in the way."""
        waited_ns: int | None = None
        self._touched = ""
        at, session = 0, self._session
        while session == self._session and not self._enough():  # after a reset nobody knows where the path lies
            at, off_m, aim, left = ahead(points, at, self._here.x, self._here.y)
            if left < 0.06:
                break
            if off_m > ASTRAY_M:
                self._event("warn", f"{off_m:.2f} m off the path: stopping here")
                yield from self._rest()
                return True
            off = wrap(degrees(atan2(aim[1] - self._here.y, aim[0] - self._here.x)) - self._here.heading_deg)
            if self._touched:
                yield from self._back_off()
                return True
            if abs(off) > ON_THE_SPOT_DEG:
                self._last_turn = 1 if off > 0 else -1
                if (yield from self._rotate(off, self._turn_rate)):
                    return True
                yield from self._rest()
                continue
            speed = self._speed_for(left, off)
            if speed < 25:
                waited_ns = waited_ns or self._now_ns
                if self._now_ns - waited_ns > WAIT_NS:
                    self._event("warn", f"something is in the way, {left:.2f} m before the next scan")
                    return True
                yield STAND
                continue
            waited_ns = None
            yield Motion(speed, max(-self._turn_rate, min(self._turn_rate, 2.0 * off)))
        yield from self._rest()
        return False

    def _speed_for(self, left: float, off: float) -> float:
        """mm/s with so many metres left, and so many degrees off the way."""
        most, stop_m = (self._speed, STOP_M) if self.sure else (min(self._speed, CREEP_MM_S), CREEP_STOP_M)
        return min(most, 60 + 900 * left, 500 * (self._room(1) - stop_m)) * max(0.3, 1 - abs(off) / 40)

    def _room(self, way: int) -> float:
        """Also what was heard anywhere near, in the last scans and since, and what any of the last few pings says."""
        heading = self._here.heading_deg + (0 if way > 0 else 180)
        hull = self._robot.radius_mm / 1000 + (BESIDE_M if self.sure else CREEP_BESIDE_M)
        if self._now_ns - self._passed_ns >= SECOND // 2:
            self._passed, self._passed_ns = self._echoes.points(), self._now_ns
        points = np.concatenate([self._points, self._passed])
        scanned = room_to_points(points, self._here, heading, hull)
        slant = room_at_slant(self._known_walls(), self._here, heading, hull)
        return min(super()._room(way), scanned, slant, self._echoes.room(self._here, backwards=way < 0, last=3))

    def _back_off(self) -> Pause:
        """Off what the robot ran into."""
        self._event("warn", f"{self._touched}: backing off")
        yield from self._rest()
        begin, began_ns = self._here, self._now_ns
        while distance(begin, self._here) < BACK_M and self._now_ns - began_ns < 2 * SECOND and self._room(-1) > 0.05:
            yield Motion(-80.0)
        yield from self._rest()


def ahead(points: Floats, at: int, x: float, y: float) -> tuple[int, float, tuple[float, float], float]:
    """The nearest point of the path not before `at`, how far it is, the point to steer at, and metres left."""
    window = points[at : at + 12]
    off = np.hypot(window[:, 0] - x, window[:, 1] - y)
    at += int(np.argmin(off))
    gone = np.cumsum(np.hypot(*np.diff(points[at:], axis=0).T)) if at + 1 < len(points) else np.zeros(0)
    aim = points[min(at + int(np.searchsorted(gone, AHEAD_M)) + 1, len(points) - 1)]
    left = hypot(points[-1, 0] - x, points[-1, 1] - y) if at + 3 >= len(points) else float(gone[-1])
    return at, float(off.min()), (float(aim[0]), float(aim[1])), left
