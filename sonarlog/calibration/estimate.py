"""From recordings to a calibration: what was found, how sure it is, and what the recordings do not determine.

Must not know: how a robot's file is written, printing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sonarlog.calibration.adjustment import Adjusted, Priors, adjust
from sonarlog.calibration.correction import Calibration
from sonarlog.calibration.equations import DEGREE, RING, SONARS
from sonarlog.calibration.observations import Stretch, stretches
from sonarlog.errors import SonarlogError
from sonarlog.log import Log
from sonarlog.recording import read_log, recording_digest
from sonarlog.robot import Robot
from sonarlog.sweeps import CutConfig, cut

ROUNDS = 2  # with the errors of the first taken out, walls are told apart better
FEWEST_SWEEPS = 3
DIGITS = 6  # after the point, in a robot's file
UNSEEN = "saw no wall; is it dead, or covered?"
LIMITS = (0.003, 0.01, 0.25 * DEGREE, 1.0 * DEGREE, 1.0 * DEGREE)
"""What one standard deviation may be at most: rotation, distance, drift, ring, each sonar."""
ADVICE = (
    "turn in place more, to both sides, between walls",
    "drive towards a wall and away from it, with scans on the way",
    "drive further, with scans at both ends that see the same walls",
    "drive along walls and towards them, with scans on the way",
    "scan where several walls are in reach",
)

Advance = Callable[[int, int], None]


class CannotCalibrate(SonarlogError):
    """Recordings that say nothing at all of their robot's errors, or of several robots."""


@dataclass(frozen=True)
class Parameter:
    """One of the robot's errors: found, its standard deviation, what was believed before, what it may be at most.

    In the units of the robot's file: scales as factors, °/m, degrees. `advice` says what to record if it is not
    determined.
    """

    name: str
    value: float
    sigma: float
    before: float
    prior: float
    limit: float
    advice: str

    @property
    def determined(self) -> bool:
        """Whether the recordings say what it is."""
        return self.sigma <= self.limit

    @property
    def verdict(self) -> str:
        """In words."""
        if not self.determined:
            return f"not determined: {self.advice}"
        return "found" if abs(self.value - self.before) > 2.0 * self.sigma else "no error to be seen"


@dataclass(frozen=True)
class Found:
    """What the recordings say: the robot as it was taken for, its errors, and what they were found in."""

    robot: Robot
    parameters: tuple[Parameter, ...]
    recordings: tuple[str, ...]
    sweeps: int
    arcs: int
    metres: float

    @property
    def missing(self) -> tuple[Parameter, ...]:
        """Those that are not determined."""
        return tuple(each for each in self.parameters if not each.determined)

    @property
    def calibrated(self) -> Robot:
        """The robot with its errors; what is not determined is left as it was, and as uncertain."""
        values = [round(each.value if each.determined else each.before, DIGITS) for each in self.parameters]
        sigma = [round(each.sigma if each.determined else each.prior, DIGITS) for each in self.parameters]
        names = [each.name for each in self.parameters[:SONARS]]
        calibration = Calibration(
            rotation_scale=values[0],
            distance_scale=values[1],
            drift_deg_per_m=values[2],
            ring_deg=values[RING],
            sonar_deg=tuple(values[SONARS:]),
            sigma=dict(zip(names, sigma, strict=False)) | {"sonar_deg": sigma[SONARS:]},
            recordings=self.recordings,
        )
        return replace(self.robot, calibration=calibration)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {
            "robot": self.robot.name,
            "recordings": list(self.recordings),
            "sweeps": self.sweeps,
            "arcs": self.arcs,
            "metres": self.metres,
            "parameters": [vars(each) | {"determined": each.determined} for each in self.parameters],
        }


def calibrate(
    recordings: Sequence[Path], robot: Robot | None = None, advance: Advance = lambda _done, _count: None
) -> Found:
    """The errors of the one robot that made these recordings, which is `robot` if not what they say.

    Raises CannotCalibrate, and what reading recordings raises.
    """
    logs = [read_log(path, robot) for path in recordings]
    first = start = _one_robot(recordings, logs)
    for number in range(ROUNDS):
        parts, sweeps = _observed(recordings, logs, advance, number)
        if not any(len(part.arcs) for part in parts):
            raise CannotCalibrate(
                f"{_named(recordings)}: no wall was seen from two places: drive between walls, scanning every metre, "
                "or record --route calibration"
            )
        found = adjust(parts, len(start.sonars), Priors())
        result = Found(
            robot=first,
            parameters=_parameters(first.calibration, start.calibration, found, parts),
            recordings=tuple(recording_digest(path) for path in recordings),
            sweeps=sweeps,
            arcs=found.arcs,
            metres=sum(part.metres for part in parts),
        )
        if number + 1 < ROUNDS:
            start = result.calibrated
            logs = [read_log(path, start) for path in recordings]
    return result


def _one_robot(recordings: Sequence[Path], logs: Sequence[Log]) -> Robot:
    for path, log in zip(recordings, logs, strict=True):
        if log.robot != logs[0].robot:
            raise CannotCalibrate(
                f"{path} and {recordings[0]} are not of the same robot: calibrate one at a time, or say which it is "
                "with --robot"
            )
    return logs[0].robot


def _observed(
    recordings: Sequence[Path], logs: Sequence[Log], advance: Advance, number: int
) -> tuple[list[Stretch], int]:
    """All stretches of all recordings, and of how many sweeps."""
    cuts = [cut(log, CutConfig(kind="scan")).sweeps for log in logs]
    count = sum(len(sweeps) for sweeps in cuts)
    if count < FEWEST_SWEEPS:
        raise CannotCalibrate(
            f"{_named(recordings)}: {count} full turns in place, and {FEWEST_SWEEPS} are the least: "
            "record --route calibration, or a drive with scans"
        )
    done = number * count

    def next_sweep() -> None:
        nonlocal done
        done += 1
        advance(done, ROUNDS * count)

    found = [part for log, sweeps in zip(logs, cuts, strict=True) for part in stretches(log, sweeps, next_sweep)]
    return found, count


def _named(recordings: Sequence[Path]) -> str:
    return ", ".join(map(str, recordings))


def _parameters(
    before: Calibration | None, known: Calibration | None, found: Adjusted, parts: list[Stretch]
) -> tuple[Parameter, ...]:
    """The errors of the robot as it was at first, of those found on top of what is known by now."""
    sonars = len(found.errors) - SONARS
    first, now = (each or Calibration() for each in (before, known))
    units = np.array([1.0, 1.0, *[1.0 / DEGREE] * (2 + sonars)])
    errors, sigma, prior = (units * values for values in (found.errors, found.sigma, Priors().of(sonars)))
    rotation, distance = 1.0 + errors[0], 1.0 + errors[1]
    values = [
        rotation * now.rotation_scale,
        distance * now.distance_scale,
        rotation * now.drift_deg_per_m + errors[2] * now.distance_scale,
        now.ring_deg + errors[RING],
        *(_of(now, k) + errors[SONARS + k] for k in range(sonars)),
    ]
    start = [first.rotation_scale, first.distance_scale, first.drift_deg_per_m, first.ring_deg]
    start += [_of(first, k) for k in range(sonars)]
    seen = sum((np.bincount(part.arcs.sonar, minlength=sonars) for part in parts), np.zeros(sonars, dtype=np.int64))
    names = ["rotation_scale", "distance_scale", "drift_deg_per_m", "ring_deg", *(f"sonar {k}" for k in range(sonars))]
    return tuple(
        Parameter(
            name=name,
            value=float(values[k]),
            sigma=float(sigma[k]),
            before=float(start[k]),
            prior=float(prior[k]),
            limit=float(units[k] * LIMITS[min(k, SONARS)]),
            advice=UNSEEN if k >= SONARS and not seen[k - SONARS] else ADVICE[min(k, SONARS)],
        )
        for k, name in enumerate(names)
    )


def _of(calibration: Calibration, sonar: int) -> float:
    return calibration.sonar_deg[sonar] if calibration.sonar_deg else 0.0
