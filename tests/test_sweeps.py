"""Cutting logs into sweeps: turns in place, several circles, what breaks a turn, and stretches of driving."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest

from slam.sweep import TURN, Sweep
from sonarlog.log import Log, Odometry, Readings
from sonarlog.robot import load_robot
from sonarlog.sweeps import CutConfig, cut

TICK_NS = 100_000_000
DEGREE = TURN / 360


@dataclass
class Drive:
    """A robot that turns 1.2° or drives 30 mm a packet, two readings each."""

    rows: list[tuple[int, int, int, int]] = field(default_factory=lambda: [(0, 0, 0, 0)])  # t, x µm, heading, session

    def _on(self, x_um: int = 0, turn_deg: float = 0.0) -> None:
        t_ns, x, heading, session = self.rows[-1]
        self.rows.append((t_ns + TICK_NS, x + x_um, heading + round(turn_deg * DEGREE), session))

    def turn(self, degrees: float) -> "Drive":
        for _ in range(round(abs(degrees) / 1.2)):
            self._on(turn_deg=1.2 if degrees > 0 else -1.2)
        return self

    def go(self, metres: float) -> "Drive":
        for _ in range(round(metres / 0.03)):
            self._on(x_um=30_000)
        return self

    def wait(self, seconds: float) -> "Drive":
        for _ in range(round(seconds * 10)):
            self._on()
        return self

    def reset(self) -> "Drive":
        t_ns, x, heading, session = self.rows[-1]
        self.rows.append((t_ns + TICK_NS, x, heading, session + 1))
        return self

    def log(self) -> Log:
        t_ns, x, heading, session = (np.array(column, dtype=np.int64) for column in zip(*self.rows, strict=True))
        zero = np.zeros(2 * len(t_ns), dtype=np.int64)
        twice = {name: np.repeat(column, 2) for name, column in (("x_um", x), ("heading", heading))}
        readings = Readings(
            t_ns=np.repeat(t_ns, 2), sonar=np.arange(len(zero)) % 8, range_mm=zero + 1000, y_um=zero,
            session=np.repeat(session, 2), **twice,
        )  # fmt: skip
        odometry = Odometry(t_ns, x, np.zeros_like(x), heading, session)
        return Log(load_robot("amigo-sh"), odometry, readings)


def degrees(sweep: Sweep) -> int:
    return round((int(sweep.heading[-1]) - int(sweep.heading[0])) / DEGREE)


@pytest.mark.parametrize(
    ("drive", "turned"),
    [
        (Drive().turn(360), [360]),
        (Drive().turn(-360), [-360]),
        (Drive().go(1).turn(360).go(1).turn(-360).go(1), [360, -360]),
        (Drive().turn(360).turn(-360), [360, -360]),  # back without a stop
        (Drive().turn(720), [360, 360]),  # two circles without a stop
        (Drive().turn(-1080), [-360, -360, -360]),
        (Drive().turn(348), [348]),  # odometry's rotation scale may be off
        (Drive().turn(372), [372]),
        (Drive().turn(180).wait(1).turn(180), [360]),  # a short stop
        (Drive().turn(360).wait(30), [360]),
        (Drive().turn(180).wait(9).turn(180), [360]),  # a longer one: the line had fallen silent
        (Drive().turn(180).wait(30).turn(180), []),  # two half turns
        (Drive().turn(180).turn(-180), []),
        (Drive().turn(180).go(0.3).turn(180), []),
        (Drive().turn(90), []),
        (Drive().go(5), []),
        (Drive().turn(180).reset().turn(180), []),  # a scan interrupted by a reset
        (Drive().turn(200).reset().turn(360), [360]),
    ],
)  # fmt: skip
def test_full_turns_in_place_are_scans(drive: Drive, turned: list[int]) -> None:
    log = drive.log()
    found = cut(log, CutConfig(kind="scan"))
    assert [degrees(sweep) for sweep in found.sweeps] == turned
    for sweep in found.sweeps:
        assert (sweep.kind, sweep.session) == ("scan", int(log.readings.session[log.readings.t_ns == sweep.t_ns[0]][0]))
        middle = (int(sweep.heading[0]) + int(sweep.heading[-1])) / 2
        assert abs(int(sweep.heading[sweep.reference]) - middle) <= 1.2 * DEGREE
    used = {t for sweep in found.sweeps for t in sweep.t_ns.tolist()}
    left = len(log.readings.t_ns) - sum(t in used for t in log.readings.t_ns.tolist())
    assert found.left_out == ({"between_scans": left} if left else {})


def test_no_reading_is_lost_between_two_circles() -> None:
    found = cut(Drive().turn(720).log())
    first, second = found.sweeps
    assert first.t_ns[-1] == second.t_ns[0]  # of the packet at the border
    assert found.left_out == {}


def test_driving_sweeps_end_after_half_a_metre_or_thirty_degrees() -> None:
    log = Drive().go(2.1).turn(90).go(0.6).log()
    found = cut(log)
    assert {sweep.kind for sweep in found.sweeps} == {"driving"}
    parts = [(int(s.x_um[-1] - s.x_um[0]) / 1e6, degrees(s)) for s in found.sweeps]
    assert all(x < 0.5 and turned < 30 for x, turned in parts)
    for sweep, after in pairwise(found.sweeps):
        far = int(after.x_um[0] - sweep.x_um[0]) >= 500_000
        assert far or int(after.heading[0] - sweep.heading[0]) >= 30 * (TURN // 360)
        assert sweep.t_ns[-1] <= after.t_ns[0]
    assert sum(map(len, found.sweeps)) + found.left_out.get("short_stretches", 0) == len(log.readings.t_ns)


def test_a_reset_ends_a_driving_sweep_and_what_is_too_short_is_counted() -> None:
    found = cut(Drive().go(0.3).reset().go(0.06).reset().go(0.3).log())
    assert [sweep.session for sweep in found.sweeps] == [0, 2]
    assert found.left_out == {"short_stretches": 6}


def test_one_scan_makes_the_whole_log_one_of_scans_unless_told_otherwise() -> None:
    log = Drive().go(2).turn(360).go(2).log()
    assert [s.kind for s in cut(log).sweeps] == ["scan"]
    assert {s.kind for s in cut(log, CutConfig(kind="driving")).sweeps} == {"driving"}
    assert cut(Drive().go(2).log(), CutConfig(kind="scan")).sweeps == ()
