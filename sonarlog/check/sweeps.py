"""A verdict for each sweep: usable, or why not.

Must not know: packets, files, the pipeline.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from slam.sweep import TURN
from sonarlog.check.finding import Finding, problem
from sonarlog.log import Log
from sonarlog.sweeps import CutConfig, cut, turns_in_place

MEANT_DEG = 200  # a robot that turns so far in one place meant to scan; turning round takes 180
MISSED = 0.1  # of a sweep's SIPs may be missing
FEW = 0.5  # of the readings that its time allows
DEAF = 0.05  # of its readings with an echo are too few for any wall


@dataclass(frozen=True)
class SweepCheck:
    """One sweep, or what should have been one; `why_not` is empty where it can be used. Times since the first SIP."""

    kind: str  # "scan", "driving sweep", "part of a circle"
    begin_s: float
    end_s: float
    degrees: float
    readings: int
    echo_rate: float
    why_not: tuple[str, ...] = ()

    @property
    def usable(self) -> bool:
        """Nothing speaks against it."""
        return not self.why_not

    def text(self) -> str:
        """In words."""
        verdict = "usable" if self.usable else "not usable: " + "; ".join(self.why_not)
        what = f"{self.kind} at {self.begin_s:.1f} s, {self.degrees:.0f}°, {self.readings} readings"
        return f"{what}, {100 * self.echo_rate:.0f} % with echo: {verdict}"


def sweep_checks(log: Log) -> tuple[SweepCheck, ...]:
    """All of them in order of time."""
    config = CutConfig()
    full = turns_in_place(log.odometry, config)
    if not full:
        return tuple(_driving(log)) + tuple(_parts(log, full, config))
    checks = [_scan(log, begin, end, "scan") for begin, end in full]
    return tuple(sorted([*checks, *_parts(log, full, config)], key=lambda check: check.begin_s))


def sweep_findings(checks: tuple[SweepCheck, ...]) -> Iterable[Finding]:
    """The sweeps that cannot be used."""
    if not checks:
        yield problem("sweep", "there is none: no full turn and no drive long enough")
    for number, check in enumerate(checks):
        if not check.usable:
            yield problem("sweep", f"sweep {number}, {check.text()}")


def _parts(log: Log, full: list[tuple[int, int]], config: CutConfig) -> Iterable[SweepCheck]:
    """Turns in place that are no full circle though one was meant."""
    for begin, end in turns_in_place(log.odometry, replace(config, full_turn_deg=MEANT_DEG)):
        if not any(begin < last and first < end for first, last in full):
            check = _scan(log, begin, end, "part of a circle")
            yield replace(check, why_not=(f"{check.degrees:.0f}° are no full circle", *check.why_not))


def _scan(log: Log, begin: int, end: int, kind: str) -> SweepCheck:
    odometry, readings = log.odometry, log.readings
    first_ns, last_ns = int(odometry.t_ns[begin]), int(odometry.t_ns[end])
    inside = (readings.t_ns >= first_ns) & (readings.t_ns <= last_ns)
    count = int(np.count_nonzero(inside))
    echoes = int(np.count_nonzero(readings.range_mm[inside] < log.robot.max_range_mm))
    degrees = abs(int(odometry.heading[end] - odometry.heading[begin])) * 360 / TURN
    seconds = (last_ns - first_ns) / 1e9
    why = []
    sips = seconds * 1000 / log.robot.sip_cycle_ms
    missed = 1 - (end - begin) / max(1.0, sips)
    if missed > MISSED:
        why.append(f"{100 * missed:.0f} % of its packets are missing")
    expected = seconds * 1000 / log.robot.sonar_cycle_ms * -(-len(log.robot.sonars) // 8)
    if count < FEW * expected:
        why.append(f"{count} readings where {expected:.0f} should be")
    if count and echoes < DEAF * count:
        why.append("hardly an echo")
    zero = int(odometry.t_ns[0])
    return SweepCheck(
        kind,
        round((first_ns - zero) / 1e9, 3),
        round((last_ns - zero) / 1e9, 3),
        round(degrees, 1),
        count,
        round(echoes / max(1, count), 3),
        tuple(why),
    )


def _driving(log: Log) -> Iterable[SweepCheck]:
    zero = int(log.odometry.t_ns[0]) if len(log.odometry.t_ns) else 0
    for sweep in cut(log).sweeps:
        echoes = int(np.count_nonzero(sweep.range_mm < log.robot.max_range_mm))
        yield SweepCheck(
            "driving sweep",
            round((int(sweep.t_ns[0]) - zero) / 1e9, 3),
            round((int(sweep.t_ns[-1]) - zero) / 1e9, 3),
            round(abs(int(sweep.heading[-1] - sweep.heading[0])) * 360 / TURN, 1),
            len(sweep),
            round(echoes / len(sweep), 3),
            () if echoes else ("no echo",),
        )
