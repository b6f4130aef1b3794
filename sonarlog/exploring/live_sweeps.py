"""Sweeps as they come: cut from the samples of a robot that is still turning, the very ones a replay will cut.

A sweep is given out once nothing that comes later can change it. Must not know: files, what sweeps are for.
"""

from array import array

import numpy as np

from slam.sweep import Sweep
from sonarlog.decode import Sample
from sonarlog.log import Ints, Log, Odometry, Readings
from sonarlog.robot import Robot
from sonarlog.sweeps import CutConfig, finished_turns, scans_of

EARLIER_NS = 1_000_000_000
"""A reading is fired up to 80 ms before its packet came; of those this old, none is missed."""


class LiveSweeps:
    """Samples in, sweeps out. What lies before the turn that still goes on is forgotten."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._config = CutConfig(kind="scan")
        self._sips = array("q")
        self._fired = array("q")

    def hear(self, sample: Sample) -> None:
        """The next packet, whatever it is."""
        if sample.pose is not None:
            self._sips.extend((sample.t_ns, *sample.pose, sample.session))
            for t_ns, sonar, range_mm, pose in sample.readings:
                self._fired.extend((t_ns, sonar, range_mm, *pose, sample.session))

    def take(self) -> list[Sweep]:
        """The sweeps that are complete since this was asked last."""
        if not self._sips:
            return []
        odometry, readings = Odometry(*_columns(self._sips, 5)), Readings(*_columns(self._fired, 7))
        turns, (again, _) = finished_turns(odometry, self._config)
        log = Log(self._robot, odometry, readings)
        found = [sweep for _, sweep in scans_of(log, turns, self._config)]
        since_ns = int(odometry.t_ns[again]) - EARLIER_NS
        self._sips = self._sips[5 * again :]
        self._fired = self._fired[7 * int(np.searchsorted(readings.t_ns, since_ns)) :]
        return found


def _columns(values: "array[int]", width: int) -> list[Ints]:
    table = np.array(values, dtype=np.int64).reshape(-1, width)
    return [np.ascontiguousarray(table[:, column]) for column in range(width)]
