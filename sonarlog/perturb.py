"""How sensitive a log is: the same replay with its input moved by very little, and how far poses and map move then.

A healthy log ends where it did; one whose tracker was lost, or only just not, ends somewhere else.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from slam.algorithms import Algorithm
from slam.pipeline import Step, first_state
from sonarlog.diff import cell_changes
from sonarlog.errors import SonarlogError
from sonarlog.log import Ints, Log, Readings
from sonarlog.recording import read_log, recording_digest
from sonarlog.replay import Watcher, replay_sweeps, sweeps_of, true_pose
from sonarlog.robot import Robot, Sonar
from sonarlog.sim.rng import Noise


class BadPerturbation(SonarlogError):
    """Not one of the perturbations that there are."""

    def __init__(self, text: str) -> None:
        super().__init__(
            f"{text!r} is no perturbation: give 1ulp (every sonar's place and direction), 1mm (every range, by up to "
            "so much, at least 1 mm), or drop=1% (so many readings left out)"
        )


@dataclass(frozen=True)
class Perturbation:
    """What is changed: sonar mountings by `ulps`, ranges by up to ±`range_mm`, or a share `drop` is left out."""

    text: str
    ulps: int = 0
    range_mm: int = 0
    drop: float = 0.0

    @classmethod
    def parse(cls, text: str) -> "Perturbation":
        """From `1ulp`, `1mm` or `drop=1%`. Raises BadPerturbation."""
        try:
            if text.endswith("ulp"):
                made = cls(text, ulps=int(text.removesuffix("ulp")))
            elif text.endswith("mm"):
                made = cls(text, range_mm=int(text.removesuffix("mm")))
            elif text.startswith("drop=") and text.endswith("%"):
                made = cls(text, drop=float(text.removeprefix("drop=").removesuffix("%")) / 100.0)
            else:
                raise ValueError
        except ValueError:
            raise BadPerturbation(text) from None
        if not (1 <= made.ulps <= 1000 or 1 <= made.range_mm <= 1000 or 0.0 < made.drop < 1.0):
            raise BadPerturbation(text)
        return made

    def of(self, log: Log, seed: int) -> Log:
        """The log, perturbed; the same seed perturbs it the same way everywhere."""
        if self.ulps:
            sonars = tuple(self._nudged(sonar) for sonar in log.robot.sonars)
            return replace(log, robot=replace(log.robot, sonars=sonars))
        count = len(log.readings.t_ns)
        noise = Noise(seed, f"perturb {self.text}")
        chances = np.array([noise.uniform(k) for k in range(count)])
        if self.drop:
            return replace(log, readings=_only(log.readings, np.flatnonzero(chances >= self.drop)))
        echo = log.readings.range_mm < log.robot.max_range_mm
        off = np.floor(chances * (2 * self.range_mm + 1)).astype(np.int64) - self.range_mm
        moved = np.clip(log.readings.range_mm + off, 0, log.robot.max_range_mm - 1)
        return replace(log, readings=replace(log.readings, range_mm=np.where(echo, moved, log.readings.range_mm)))

    def _nudged(self, sonar: Sonar) -> Sonar:
        x, y, heading = sonar.x_mm, sonar.y_mm, sonar.heading_deg
        for _ in range(self.ulps):
            x, y, heading = (math.nextafter(value, math.inf) for value in (x, y, heading))
        return Sonar(x, y, heading)


def _only(readings: Readings, kept: Ints) -> Readings:
    return Readings(**{name: column[kept] for name, column in vars(readings).items()})


@dataclass(frozen=True)
class Sensitivity:
    """How far a perturbed replay is from the one as it is.

    Positions and headings are of the correction, map ← odometry, at the same place of the odometry: largest, and at the
    end. `sweep` is where it is largest; `parted` the first sweep whose walls were chained otherwise, if any.
    """

    text: str
    largest_mm: float
    sweep: int
    largest_deg: float
    end_mm: float
    cells: int
    known: int
    parted: int | None
    sweeps: tuple[int, int]


def sensitivity(
    recording: Path,
    algorithm: Algorithm,
    perturbation: Perturbation,
    watcher: Watcher | None = None,
    robot: Robot | None = None,
) -> Sensitivity:
    """Replay as it is and perturbed, side by side. Raises what reading the recording raises, and NoSweeps."""
    log = read_log(recording, robot)
    other = perturbation.of(log, int(recording_digest(recording)[:15], 16))
    mine, yours = sweeps_of(log, recording), sweeps_of(other, recording)
    if watcher:
        watcher.begin(log, len(mine.sweeps))
    offs: list[tuple[float, float]] = []
    parted: int | None = None
    grids = first_state(log.robot.ring(), algorithm).grid, first_state(other.robot.ring(), algorithm).grid
    both = zip(replay_sweeps(log, mine, algorithm), replay_sweeps(other, yours, algorithm), strict=False)
    for k, (a, b) in enumerate(both):
        offs.append(_off(a, b))
        grids = a.state.grid, b.state.grid
        if parted is None and _chained(a) != _chained(b):
            parted = k
        if watcher:
            watcher.step(a, true_pose(log.truth, int(a.sweep.t_ns[a.sweep.reference])))
    table = cell_changes(*grids).table
    worst = max(range(len(offs)), key=lambda k: offs[k][0], default=0)
    return Sensitivity(
        text=perturbation.text,
        largest_mm=offs[worst][0] if offs else 0.0,
        sweep=worst,
        largest_deg=max((turned for _, turned in offs), default=0.0),
        end_mm=offs[-1][0] if offs else 0.0,
        cells=sum(count for i, row in enumerate(table) for j, count in enumerate(row) if i != j),
        known=sum(count for row in table for count in row),
        parted=parted,
        sweeps=(len(mine.sweeps), len(yours.sweeps)),
    )


def _off(a: Step, b: Step) -> tuple[float, float]:
    """Millimetres and degrees between where the two corrections put the robot.

    The sweeps' frames need not be the same: the reading that a frame is named after may be left out.
    """
    there = b.pose.compose(b.calibrated.odometry.step_to(a.calibrated.odometry))
    step = a.pose.step_to(there)
    return 1000.0 * math.hypot(step.x, step.y), math.degrees(abs(step.theta))


def _chained(step: Step) -> list[int]:
    """The chains that the sweep's walls joined."""
    return [link.chain for link in step.association.links]
