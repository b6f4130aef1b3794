"""Cutting a log into sweeps: full turns in place, or, where a robot scans while it drives, stretches of the drive.

Must not know: packets, files. Integers only: the same log gives the same sweeps everywhere.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np

from slam.sweep import TURN, Sweep
from sonarlog.log import Ints, Log, Odometry

CutKind = Literal["auto", "scan", "driving"]

DEGREE = TURN // 360


@dataclass(frozen=True)
class CutConfig:
    """What is a turn in place, and how long a driving sweep is."""

    kind: CutKind = "auto"  # auto: scans if there is at least one, else driving sweeps
    full_turn_deg: int = 345  # by odometry, whose rotation scale may be a few per cent off
    still_um: int = 8_000  # a robot turning in place moves less than this from one packet to the next
    turning: int = TURN // 2048  # heading change from one packet to the next that is no jitter
    pause_ns: int = 15_000_000_000  # a robot stops in the middle of a turn when its line falls silent
    driving_um: int = 500_000
    driving_deg: int = 30
    min_readings: int = 8


@dataclass(frozen=True)
class Cut:
    """The sweeps of a log, and how many of its readings are in none, by reason."""

    sweeps: tuple[Sweep, ...]
    left_out: dict[str, int] = field(default_factory=dict)


def cut(log: Log, config: CutConfig | None = None) -> Cut:
    """All sweeps of the log in order of time."""
    config = config or CutConfig()
    scans = [] if config.kind == "driving" else list(_scans(log, config))
    if scans or config.kind == "scan":
        used = np.concatenate([np.zeros(0, dtype=np.int64), *(chosen for chosen, _ in scans)])
        between = len(log.readings.t_ns) - len(np.unique(used))
        return Cut(tuple(sweep for _, sweep in scans), {"between_scans": between} if between else {})
    stretches = list(_stretches(log, config))
    whole = [item for item in stretches if len(item[0]) >= config.min_readings]
    short = len(log.readings.t_ns) - sum(len(chosen) for chosen, _ in whole)
    return Cut(tuple(sweep for _, sweep in whole), {"short_stretches": short} if short else {})


def turns_in_place(odometry: Odometry, config: CutConfig) -> list[tuple[int, int]]:
    """Full turns as (first, last) rows of the odometry; two turns without a stop between them are two."""
    found, (begin, last) = finished_turns(odometry, config)
    return found + (_whole_turns(odometry, begin, last, config) if last > begin else [])


def finished_turns(odometry: Odometry, config: CutConfig) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Those full turns that no later row can change, and (first, last) of the turn that still goes on.

    Where none does, both are the last row: from the first of the two on it is to be looked again.
    """
    moved = np.abs(np.diff(odometry.x_um)) + np.abs(np.diff(odometry.y_um))
    turned = np.diff(odometry.heading)
    still = moved <= config.still_um
    same = np.diff(odometry.session) == 0
    found: list[tuple[int, int]] = []
    begin, last, way = 0, 0, 0
    in_place = (still & same).tolist()
    directions = (np.sign(turned) * (still & same & (np.abs(turned) >= config.turning))).tolist()
    t_ns = odometry.t_ns.tolist()
    for k, direction in enumerate(directions):
        broken = not in_place[k] or t_ns[k + 1] - t_ns[last] > config.pause_ns
        if way and (broken or direction == -way):
            found += _whole_turns(odometry, begin, last, config)
            way = 0
        if direction and not way:
            begin, way = k, direction
        if direction:
            last = k + 1
    end = max(0, len(odometry.t_ns) - 1)
    return found, (begin, last) if way else (end, end)


def _whole_turns(odometry: Odometry, begin: int, end: int, config: CutConfig) -> list[tuple[int, int]]:
    """One turn in one direction, cut into equal parts if it is several circles."""
    angle = abs(int(odometry.heading[end] - odometry.heading[begin]))
    if angle < config.full_turn_deg * DEGREE:
        return []
    circles = max(1, (angle + TURN - config.full_turn_deg * DEGREE) // TURN)
    turned = np.abs(odometry.heading[begin : end + 1] - odometry.heading[begin])
    borders = [begin + int(np.searchsorted(turned, angle * part // circles)) for part in range(circles)] + [end]
    return list(pairwise(borders))


def _scans(log: Log, config: CutConfig) -> Iterator[tuple[Ints, Sweep]]:
    return scans_of(log, turns_in_place(log.odometry, config), config)


def scans_of(log: Log, turns: Iterable[tuple[int, int]], config: CutConfig) -> Iterator[tuple[Ints, Sweep]]:
    """The sweep of each turn with enough readings, and which of the log's readings are in it."""
    odometry, readings = log.odometry, log.readings
    order = np.argsort(readings.t_ns, kind="stable")
    times = readings.t_ns[order]
    for begin, end in turns:
        first = np.searchsorted(times, odometry.t_ns[begin], side="left")
        last = np.searchsorted(times, odometry.t_ns[end], side="right")
        inside = np.sort(order[first:last])
        chosen = inside[readings.session[inside] == odometry.session[begin]]
        if len(chosen) >= config.min_readings:
            middle = (odometry.heading[begin] + odometry.heading[end]) // 2
            reference = int(np.argmin(np.abs(readings.heading[chosen] - middle)))
            yield chosen, _sweep(log, chosen, reference, "scan")


def _stretches(log: Log, config: CutConfig) -> Iterator[tuple[Ints, Sweep]]:
    """Readings until the robot has moved or turned far enough, or odometry broke."""
    readings = log.readings
    limit = config.driving_um * config.driving_um
    begin = 0
    for k in range(1, len(readings.t_ns) + 1):
        if k < len(readings.t_ns) and readings.session[k] == readings.session[begin]:
            dx, dy = int(readings.x_um[k] - readings.x_um[begin]), int(readings.y_um[k] - readings.y_um[begin])
            turned = abs(int(readings.heading[k] - readings.heading[begin]))
            if dx * dx + dy * dy < limit and turned < config.driving_deg * DEGREE:
                continue
        chosen = np.arange(begin, k)
        yield chosen, _sweep(log, chosen, len(chosen) // 2, "driving")
        begin = k


def _sweep(log: Log, chosen: Ints, reference: int, kind: Literal["scan", "driving"]) -> Sweep:
    r = log.readings
    return Sweep(
        kind=kind,
        session=int(r.session[chosen[0]]),
        reference=reference,
        t_ns=r.t_ns[chosen],
        sonar=r.sonar[chosen],
        range_mm=r.range_mm[chosen],
        x_um=r.x_um[chosen],
        y_um=r.y_um[chosen],
        heading=r.heading[chosen],
    )
