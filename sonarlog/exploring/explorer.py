"""The explorer: scan, decide, drive to where the next scan shows most, until nothing reachable is unknown.

The robot stands while it is decided. Must not know: the port, files, how a goal is chosen.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, inf, pi, radians

import numpy as np

from slam.algorithms import Algorithm
from slam.dmath import Floats
from slam.frontier import way_to
from slam.geometry import Pose
from slam.pipeline import Step
from sonarlog.decode import Sample
from sonarlog.exploring.follower import Follower
from sonarlog.exploring.live_sweeps import LiveSweeps
from sonarlog.exploring.mapper import Mapper, described
from sonarlog.moves import Decided, Moves, Pause, Script
from sonarlog.protocol.packets import Sip
from sonarlog.robot import Robot

NEAR_HOME_M = 0.25
HOME_LEG = 36  # cells from scan to scan on the way back
VAIN = 20  # scans in a row that leave the map as large as it was: there is nothing more to be had
NEW_M2 = 0.1  # so much more free area is something new
POOR = 3  # scans in a row that give no sweep: something is wrong with the robot
CREEP_LEG = 5  # cells to the next scan while it is not sure where it is
NEARER_M = 0.2  # a leg home that gains less has failed
LOW_SIPS = 10  # in a row; motors that start pull the battery down for a moment
ACROSS = radians(25)


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


class Explorer(Follower):
    """Drives by the decisions of block I. `ask_end` ends it at the next chance, by the way home if that is wanted."""

    def __init__(
        self,
        robot: Robot,
        algorithm: Algorithm,
        limits: Limits,
        *,
        watch: Callable[[Step], None] | None = None,
    ) -> None:
        """`watch` sees every step; it must not wait."""
        super().__init__(
            robot, speed_mm_s=limits.speed_mm_s, turn_deg_s=limits.turn_deg_s, scan_deg_s=limits.scan_deg_s
        )
        self.ended = ""
        self._limits = limits
        self._algorithm = algorithm
        self._sweeps = LiveSweeps(robot)
        self._mapper = Mapper(robot, algorithm)
        self._watch = watch
        self._decisions: list[Decided] = []
        self._volts = 0.0
        self._low = 0
        self._asked = ""
        self._area_m2 = 0.0
        self._vain = 0
        self._began_ns = 0

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
            self._low = self._low + 1 if self._volts < self._limits.min_volts else 0

    def _drive(self) -> Script:
        self._began_ns = self._now_ns
        poor = 0
        while not self.ended:
            yield from self._look_round()
            step = self._think()
            poor = 0 if step else poor + 1
            self.ended = self._over(step) if step else self._limit()
            if poor >= POOR:
                self.ended = f"{POOR} scans in a row gave no sweep"
            elif step and not self.ended:
                yield from self._to(step)
                self.ended = self._limit()
        self._event("info", f"the exploration ends: {self.ended}")
        if self._limits.come_back:
            yield from self._home()

    def _think(self) -> Step | None:
        """Let the pipeline have what was seen; the last step, None if there was no sweep."""
        step = None
        for sweep in self._sweeps.take():
            step, told = self._mapper.take(sweep)
            self._decisions.append(Decided(self._now_ns, told))
            if self._watch is not None:
                self._watch(step)
        if step is not None:
            self._event("info", f"station {self._mapper.count - 1}: {described(step)}")
            if not self.sure and step.sweep.session == self._session and tied(step):
                self.sure = True
                self._event("info", "the walls are known again: on as before")
        return step

    def _over(self, step: Step) -> str:
        """Why to end here, or nothing."""
        vain = self._nothing_new(step)
        if limit := self._limit():
            return limit
        if step.decision.chosen is None:
            return "nothing reachable is unknown"
        return f"{VAIN} scans in a row showed nothing new" if vain else ""

    def _limit(self) -> str:
        """Why to end wherever the robot is, or nothing."""
        limits = self._limits
        if self._asked:
            return self._asked
        if limits.max_time_ns is not None and self._now_ns - self._began_ns >= limits.max_time_ns:
            return "the time is up"
        if limits.max_distance_m is not None and self._path >= limits.max_distance_m:
            return f"{self._path:.1f} m are driven"
        if self._low >= LOW_SIPS:
            return f"the battery is low: {self._volts:.1f} V"
        return ""

    def _enough(self) -> bool:
        return not self.ended and bool(self._limit())

    def _nothing_new(self, step: Step) -> bool:
        """Whether the map has not grown for too long: a goal that moves away as one comes near never ends."""
        grid = step.state.grid
        area = float(np.count_nonzero(grid.free(grid.dense()[0]))) * grid.cell_m * grid.cell_m
        grown = area >= self._area_m2 + NEW_M2
        self._vain = 0 if grown else self._vain + 1
        self._area_m2 = area if grown else self._area_m2
        return self._vain >= VAIN

    def _to(self, step: Step) -> Moves:
        """Along the path to where the next scan is due; not far where the robot is not sure of its place."""
        leg = step.decision.path[: step.decision.leg + 1]
        return (yield from self._along(carried(leg if self.sure else leg[: CREEP_LEG + 1], step)))

    def _home(self) -> Pause:
        """Back to where it began, through what is known to be free, scanning now and then."""
        tries, best_m = 0, inf
        while (step := self._mapper.step) is not None and tries < POOR:
            here, start = self._pose(step), step.state.poses[0]
            if self.sure and hypot(here.x - start.x, here.y - start.y) < NEAR_HOME_M:
                self._event("info", "the exploration is back at its start")
                return
            state, config = step.state, self._algorithm.config.frontier
            path = way_to(state.grid, state.poses, state.intent, here, (start.x, start.y), config)
            nearer = path is not None and path.length_m < best_m - NEARER_M
            tries, best_m = (0, path.length_m) if path is not None and nearer else (tries + 1, best_m)
            if path is not None:
                yield from self._along(carried(path.points[: (HOME_LEG if self.sure else CREEP_LEG) + 1], step))
            if not self.sure:
                best_m = inf  # interrupted: that was no failure of the way
            here = self._pose(step)
            if not self.sure or hypot(here.x - start.x, here.y - start.y) >= NEAR_HOME_M:
                yield from self._look_round()
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


def tied(step: Step) -> bool:
    """Whether two walls that are not parallel are known from before: then the place is no guess."""
    bearings = [step.association.predicted[link.wall].alpha for link in step.association.links]
    return any(ACROSS < abs(a - b) % pi < pi - ACROSS for a in bearings for b in bearings)
