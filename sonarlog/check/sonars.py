"""Sonars that are dead or stuck, and how often each hears an echo.

Must not know: packets, sweeps, files.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from slam.sweep import TURN
from sonarlog.check.finding import Finding, problem
from sonarlog.log import Ints, Log

ENOUGH = 30  # readings, on average, before silence means anything
STUCK = 25  # equal readings in a row …
MOVED_UM, TURNED = 300_000, TURN // 12  # … while the robot moved or turned so far


@dataclass(frozen=True)
class SonarCheck:
    """One sonar: `stuck` is its longest run of equal readings while the robot moved."""

    number: int
    readings: int
    echo_rate: float
    median_mm: int  # of the echoes
    stuck: int


def sonar_checks(log: Log) -> tuple[SonarCheck, ...]:
    """One for each sonar the robot has."""
    return tuple(_check(log, number) for number in range(len(log.robot.sonars)))


def sonar_findings(checks: tuple[SonarCheck, ...]) -> Iterable[Finding]:
    """Which sonars are not to be trusted."""
    mean = sum(check.readings for check in checks) / max(1, len(checks))
    rate = sum(check.echo_rate for check in checks) / max(1, len(checks))
    if mean < ENOUGH:
        return
    for check in checks:
        if check.readings == 0:
            yield problem("sonar", f"sonar {check.number} is dead: it never fired")
        elif check.readings < mean / 2:
            yield problem("sonar", f"sonar {check.number} fired {check.readings} times, the others {mean:.0f}")
        elif check.echo_rate < rate / 20:
            yield problem("sonar", f"sonar {check.number} is dead: it hears no echo")
        elif check.stuck >= STUCK:
            yield problem("sonar", f"sonar {check.number} is stuck: {check.stuck} equal readings while the robot moved")


def _check(log: Log, number: int) -> SonarCheck:
    readings = log.readings
    mine = readings.sonar == number
    ranges = readings.range_mm[mine]
    echoes = ranges < log.robot.max_range_mm
    rate = float(np.mean(echoes)) if len(ranges) else 0.0
    median = int(np.median(ranges[echoes])) if echoes.any() else 0
    place = np.stack([readings.x_um[mine], readings.y_um[mine], readings.heading[mine]], axis=1)
    return SonarCheck(number, len(ranges), round(rate, 3), median, _stuck(ranges, echoes, place))


def _stuck(ranges: Ints, echoes: np.ndarray[tuple[int], np.dtype[np.bool_]], place: Ints) -> int:
    """The longest run of equal echoes over which the robot moved or turned far enough."""
    if not len(ranges):
        return 0
    borders = np.flatnonzero(np.diff(ranges) != 0) + 1
    longest = 0
    for begin, end in zip([0, *borders.tolist()], [*borders.tolist(), len(ranges)], strict=True):
        if end - begin <= longest or not echoes[begin]:
            continue
        spread = np.ptp(place[begin:end], axis=0)
        if max(spread[0], spread[1]) >= MOVED_UM or spread[2] >= TURNED:
            longest = end - begin
    return int(longest)
