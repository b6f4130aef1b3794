"""The explorer: scan, decide, drive to where the next scan shows most, until nothing reachable is unknown.

The robot stands while it is decided. Must not know: the port, files, how a goal is chosen.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, degrees, hypot, radians

import numpy as np

from slam.algorithms import Algorithm
from slam.dmath import Floats
from slam.frontier import way_to
from slam.geometry import Pose
from slam.pipeline import Step
from sonarlog.decode import Sample
from sonarlog.exploring.live_sweeps import LiveSweeps
from sonarlog.exploring.mapper import Mapper, described
from sonarlog.moves import STAND, Decided, Motion, Mover, Moves, Pause, Script, distance
from sonarlog.protocol.packets import Sip
from sonarlog.robot import Robot
from sonarlog.surroundings import room_to_points, wrap

SECOND = 1_000_000_000
AHEAD_M = 0.30  # the point of the path that the robot steers at is so far along it
STOP_M = 0.12  # room before the hull at which the robot stands
BESIDE_M = 0.06  # room beside the hull
ON_THE_SPOT_DEG = 25.0  # further off than this it turns before it goes on
WAIT_NS = 1_500_000_000  # an echo heard once is no wall
BACK_M = 0.12  # off what was touched
NEAR_HOME_M = 0.25
HOME_LEG = 36  # cells from scan to scan on the way back
VAIN = 20  # scans in a row that leave the map as large as it was: there is nothing more to be had
NEW_M2 = 0.1  # so much more free area is something new
POOR = 3  # scans in a row that give no sweep: something is wrong with the robot


@dataclass(frozen=True)
class Limits:
    """When to end though there is more to see, and how fast to go."""

    max_time_ns: int | None = None
    max_distance_m: float | None = None
    min_volts: float = 0.0
    come_back: bool = False
    speed_mm_s: float = 300.0
    turn_deg_s: float = 45.0
    scan_deg_s: float = 12.0


class Explorer(Mover):
    """Drives by the decisions of block I. `ask_end` ends it at the next chance, by the way home if that is wanted."""

    def __init__(
        self,
        robot: Robot,
        algorithm: Algorithm,
        limits: Limits,
        *,
        watch: Callable[[Step], None] = lambda _step: None,
    ) -> None:
        """`watch` sees every step; it must not wait."""
        super().__init__(robot, speed_mm_s=limits.speed_mm_s, scan_deg_s=limits.scan_deg_s)
        self.ended = ""
        self._limits = limits
        self._algorithm = algorithm
        self._turn_rate = min(limits.turn_deg_s, robot.max_turn_deg_s)
        self._sweeps = LiveSweeps(robot)
        self._mapper = Mapper(robot, algorithm)
        self._watch = watch
        self._decisions: list[Decided] = []
        self._volts: float | None = None
        self._asked = ""
        self._area_m2 = 0.0
        self._vain = 0
        self._last_turn = -1
        self._began_ns: int | None = None
        self._passed: Floats = np.zeros((0, 2))  # near echoes of the last half minute, looked up twice a second
        self._passed_ns = -SECOND

    @property
    def metres(self) -> float:
        """Driven so far."""
        return self._path

    def ask_end(self, why: str) -> None:
        """End at the next chance; `why` in words."""
        self._asked = self._asked or why

    def take_decisions(self) -> list[Decided]:
        """What was decided since this was asked last."""
        decisions, self._decisions = self._decisions, []
        return decisions

    def hear(self, sample: Sample) -> None:
        """Every packet: sweeps are cut from them, as a replay will."""
        self._sweeps.hear(sample)
        if isinstance(sample.packet, Sip):
            tenths = sample.packet.extra("battery_x10")
            self._volts = (tenths if tenths else sample.packet.battery) / 10

    def _drive(self) -> Script:
        poor = 0
        while not self.ended:
            yield from self._scan(-self._last_turn)
            self._last_turn = -self._last_turn
            step = self._think()
            poor = 0 if step else poor + 1
            if poor >= POOR:
                self.ended = f"{POOR} scans in a row gave no sweep"
            elif step:
                self.ended = self._over(step)
                if not self.ended:
                    yield from self._to(step)
        self._event("info", f"the exploration ends: {self.ended}")
        if self._limits.come_back:
            yield from self._home()

    def _think(self) -> Step | None:
        """Let the pipeline have what was seen; the last step, None if there was no sweep."""
        step = None
        for sweep in self._sweeps.take():
            step, told = self._mapper.take(sweep)
            self._decisions.append(Decided(self._now_ns, told))
            self._watch(step)
        if step is not None:
            self._event("info", f"station {self._mapper.count - 1}: {described(step)}")
        return step

    def _over(self, step: Step) -> str:
        """Why to end here, or nothing."""
        limits = self._limits
        if self._asked:
            return self._asked
        if self._began_ns is None:
            self._began_ns = self._now_ns
        vain = self._nothing_new(step)
        if step.decision.chosen is None or vain:
            return f"{VAIN} scans in a row showed nothing new" if vain else "nothing reachable is unknown"
        if limits.max_time_ns is not None and self._now_ns - self._began_ns >= limits.max_time_ns:
            return "the time is up"
        if limits.max_distance_m is not None and self._path >= limits.max_distance_m:
            return f"{self._path:.1f} m are driven"
        if self._volts is not None and self._volts < limits.min_volts:
            return f"the battery is low: {self._volts:.1f} V"
        return ""

    def _nothing_new(self, step: Step) -> bool:
        """Whether the map has not grown for too long: a goal that moves away as one comes near never ends."""
        grid = step.state.grid
        area = float(np.count_nonzero(grid.free(grid.dense()[0]))) * grid.cell_m * grid.cell_m
        grown = area >= self._area_m2 + NEW_M2
        self._vain = 0 if grown else self._vain + 1
        self._area_m2 = max(area, self._area_m2) if grown else self._area_m2
        return self._vain >= VAIN

    def _to(self, step: Step) -> Moves:
        """Along the path to where the next scan is due."""
        return (yield from self._along(step.decision.path[: step.decision.leg + 1], step))

    def _along(self, path: Floats, step: Step) -> Moves:
        """Along a path in the map frame; True where something is in the way."""
        points = carried(path, step)
        waited_ns: int | None = None
        self._stalled = False
        at, session = 0, self._session
        while session == self._session:  # else nobody knows where the path lies
            at, aim, left = _ahead(points, at, self._here.x, self._here.y)
            if left < 0.06:
                break
            off = wrap(degrees(atan2(aim[1] - self._here.y, aim[0] - self._here.x)) - self._here.heading_deg)
            if abs(off) > ON_THE_SPOT_DEG:
                self._last_turn = 1 if off > 0 else -1
                if (yield from self._rotate(off, self._turn_rate)):
                    return True
                yield from self._rest()
                continue
            speed = min(self._speed, 60 + 900 * left, 500 * (self._room(1) - STOP_M)) * max(0.3, 1 - abs(off) / 40)
            if self._stalled:
                yield from self._back_off()
                return True
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

    def _room(self, way: int) -> float:
        """Also what was heard anywhere near, in the last scans and since, and what any of the last few pings says."""
        heading = self._here.heading_deg + (0 if way > 0 else 180)
        hull = self._robot.radius_mm / 1000
        if self._now_ns - self._passed_ns >= SECOND // 2:
            self._passed, self._passed_ns = self._echoes.points(), self._now_ns
        points = np.concatenate([self._points, self._passed])
        scanned = room_to_points(points, self._here, heading, hull + BESIDE_M)
        return min(super()._room(way), scanned, self._echoes.room(self._here, backwards=way < 0, last=3))

    def _back_off(self) -> Pause:
        """Off what the robot ran into."""
        self._event("warn", "the wheels stalled: backing off")
        yield from self._rest()
        begin = self._here
        began_ns = self._now_ns
        while distance(begin, self._here) < BACK_M and self._now_ns - began_ns < 2 * SECOND and self._room(-1) > 0.05:
            yield Motion(-80.0)
        yield from self._rest()

    def _home(self) -> Pause:
        """Back to where it began, through what is known to be free, scanning now and then."""
        tries = 0
        while (step := self._mapper.step) is not None and tries < POOR:
            here, start = self._pose(step), step.state.poses[0]
            if hypot(here.x - start.x, here.y - start.y) < NEAR_HOME_M:
                self._event("info", "the exploration is back at its start")
                return
            state, config = step.state, self._algorithm.config.frontier
            path = way_to(state.grid, state.poses, state.intent, here, (start.x, start.y), config)
            if path is None:
                break
            blocked = yield from self._along(path.points[: HOME_LEG + 1], step)
            tries = tries + 1 if blocked else 0
            if hypot(self._pose(step).x - start.x, self._pose(step).y - start.y) >= NEAR_HOME_M:
                yield from self._scan(-self._last_turn)
                self._last_turn = -self._last_turn
                self._think()
        self._event("warn", "the exploration finds no way back to its start")

    def _pose(self, step: Step) -> Pose:
        """Where the robot is in the map by odometry since that step."""
        here = Pose(self._here.x, self._here.y, radians(self._here.heading_deg))
        return step.pose.compose(step.calibrated.odometry.step_to(here))


def carried(path: Floats, step: Step) -> Floats:
    """The path (n, 2) of the map frame in the odometry's, metres."""
    to_odometry = step.calibrated.odometry.compose(step.pose.step_to(Pose(0.0, 0.0, 0.0)))
    return to_odometry.points(path)


def _ahead(points: Floats, at: int, x: float, y: float) -> tuple[int, tuple[float, float], float]:
    """The nearest point of the path not before `at`, the point to steer at, and metres left to the end."""
    window = points[at : at + 12]
    at += int(np.argmin(np.hypot(window[:, 0] - x, window[:, 1] - y)))
    gone = np.cumsum(np.hypot(*np.diff(points[at:], axis=0).T)) if at + 1 < len(points) else np.zeros(0)
    aim = points[min(at + int(np.searchsorted(gone, AHEAD_M)) + 1, len(points) - 1)]
    left = hypot(points[-1, 0] - x, points[-1, 1] - y) if at + 3 >= len(points) else float(gone[-1])
    return at, (float(aim[0]), float(aim[1])), left
