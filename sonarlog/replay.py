"""Replay: a recording through the pipeline, sweep by sweep, into a run.

Must not know: files' formats, viewers, which clock there is.
"""

from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from slam import pipeline
from slam.algorithms import Algorithm
from slam.geometry import Pose
from slam.pipeline import Hear, Step, unheard
from sonarlog.accounting import TWICE, check
from sonarlog.digest import RunDigest
from sonarlog.errors import SonarlogError
from sonarlog.exploring.reproduction import Reproduced, Reproduction
from sonarlog.log import Log, Truth
from sonarlog.recording import read_log
from sonarlog.robot import Robot
from sonarlog.runs import RunWriter, identify
from sonarlog.sweeps import Cut, CutConfig, cut
from sonarlog.times import Clock, Stopwatch


class Watcher(Protocol):
    """Someone who follows a replay: a viewer, a progress bar."""

    def begin(self, log: Log, sweeps: int) -> None:
        """The log is read and cut into so many sweeps."""

    def step(self, step: Step, truth: Pose | None) -> None:
        """The next step, and where the robot really was, in the recording's frame, if that is known."""


class NoSweeps(SonarlogError):
    """There is nothing to replay in the recording."""


@dataclass(frozen=True)
class Replayed:
    """What came of a replay: the run's digest, and what of the recording was used and what was left out."""

    digest: str
    sweeps: int
    counts: dict[str, int]
    missing: tuple[str, ...] = ()  # of a damaged recording, in sentences
    reproduced: Reproduced | None = None  # of an exploration: whether it decides as it did


def replay(
    recording: Path,
    algorithm: Algorithm,
    output: Path | None,
    *,
    force: bool = False,
    cutting: CutConfig | None = None,
    watcher: Watcher | None = None,
    checkpoint_every: int = 0,
    robot: Robot | None = None,
    clock: Clock | None = None,
) -> Replayed:
    """Replay a recording and write the run (None: only its digest is made).

    With `checkpoint_every` the run keeps the whole state after so many sweeps, again and again. A `robot` is taken
    instead of the recording's own. `watcher` sees the log before the first step, and each step as it comes. With a
    `clock` the run keeps what each block took, beside the result. Raises NoSweeps, and what reading the recording and
    writing the run raise; a run that fails leaves no file.
    """
    log = read_log(recording, robot)
    sweeps = sweeps_of(log, recording, cutting)
    counts = used_and_left_out(log, sweeps)
    if log.decisions:
        counts["decisions"] = len(log.decisions)
    identity = identify(log.digest, algorithm, robot)
    result = RunDigest(identity.asked())
    decisions = Reproduction(log.decisions, algorithm)
    watch = Stopwatch(clock) if clock else None
    run = None
    if output is not None:
        run = RunWriter(output, identity, recording=recording, force=force, checkpoint_every=checkpoint_every)
    with run or nullcontext() as writer:
        if watcher:
            watcher.begin(log, len(sweeps.sweeps))
        for step in replay_sweeps(log, sweeps, algorithm, watch or unheard):
            digests = result.add(step)
            decisions.add(step)
            truth = true_pose(log.truth, int(step.sweep.t_ns[step.sweep.reference]))
            if writer:
                writer.add(step, digests, result, truth)
            if watcher:
                watcher.step(step, truth)
        if writer:
            writer.finish(result, step.state, counts, log.surfaces, watch.times() if watch else None)
    return Replayed(result.result(), len(sweeps.sweeps), counts, log.missing, decisions.result())


def replay_sweeps(log: Log, sweeps: Cut, algorithm: Algorithm, done: Hear = unheard) -> Iterator[Step]:
    """Step after step of the log's sweeps; `done` hears every block of each."""
    return pipeline.run(sweeps.sweeps, log.robot.ring(), algorithm, done=done)


def sweeps_of(log: Log, recording: Path, cutting: CutConfig | None = None) -> Cut:
    """The sweeps of a recording's log. Raises NoSweeps saying why there are none."""
    if len(log.readings.t_ns) == 0:
        raise NoSweeps(f"{recording} holds no sonar readings: there is nothing to replay")
    if len(log.odometry.t_ns) == 0:
        raise NoSweeps(f"{recording} holds no odometry: without it its readings have no place")
    sweeps = cut(log, cutting)
    if not sweeps.sweeps:
        count = len(log.readings.t_ns)
        raise NoSweeps(f"{recording} holds {count} readings, but no full turn and no drive long enough for a sweep")
    return sweeps


def used_and_left_out(log: Log, sweeps: Cut) -> dict[str, int]:
    """What the replay used of the recording and, by reason, what it did not. Raises Unaccounted."""
    used = sum(len(sweep) for sweep in sweeps.sweeps)
    left_out = {f"readings_left_out_{reason}": count for reason, count in sweeps.left_out.items()}
    twice = used + sum(sweeps.left_out.values()) - len(log.readings.t_ns)
    shared = {TWICE: twice} if twice > 0 else {}
    counts = {**log.counts, "sweeps": len(sweeps.sweeps), "readings_used": used, **shared, **left_out}
    check(counts)
    return counts


def true_pose(truth: Truth | None, t_ns: int) -> Pose | None:
    """The true pose at a moment, on the line between the two nearest known ones; None where it is not known."""
    if truth is None or not len(truth.t_ns) or not truth.t_ns[0] <= t_ns <= truth.t_ns[-1]:
        return None
    after = int(np.searchsorted(truth.t_ns, t_ns))
    x1, y1, theta1 = truth.pose[after].tolist()
    if truth.t_ns[after] == t_ns:
        return Pose(x1, y1, theta1)
    x0, y0, theta0 = truth.pose[after - 1].tolist()
    before = Pose(x0, y0, theta0)
    step = before.step_to(Pose(x1, y1, theta1))
    part = float(t_ns - truth.t_ns[after - 1]) / float(truth.t_ns[after] - truth.t_ns[after - 1])
    return Pose(x0 + part * (x1 - x0), y0 + part * (y1 - y0), theta0 + part * step.theta)
