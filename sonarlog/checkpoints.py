"""Checkpoints: the whole state after every so many sweeps, kept in a run, from which a replay goes on.

Must not know: how a run's file is written, printing.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from slam import pipeline
from slam.algorithms import Algorithm
from slam.pipeline import State, Step
from sonarlog.canonical import canonical, read_canonical
from sonarlog.digest import RunDigest
from sonarlog.errors import SonarlogError
from sonarlog.log import Log
from sonarlog.mcap_file import McapReader
from sonarlog.recording import read_log, recording_digest
from sonarlog.replay import Replayed, Watcher, sweeps_of, true_pose, used_and_left_out
from sonarlog.restore import restored
from sonarlog.runs import CHECKPOINTS_TOPIC, BadRun, Run, read_run
from sonarlog.sweeps import Cut


class NoCheckpoint(SonarlogError):
    """The run keeps no checkpoint to go on from, or it is of something else."""


@dataclass(frozen=True)
class Checkpoint:
    """After `sweep` sweeps: the chain of digests so far, and the canonical bytes of the state."""

    sweep: int
    chain: str
    state: bytes

    def restored(self) -> State:
        """The state that the next sweep starts from. Raises BadRun."""
        try:
            state: State = restored(State, read_canonical(self.state))
        except (TypeError, KeyError) as error:
            raise BadRun(
                f"the checkpoint after sweep {self.sweep} is of another version of the code: {error}"
            ) from None
        return state


@dataclass(frozen=True)
class Stretch:
    """The sweeps of a run from `begin` to `end` (exclusive), its state at either border as canonical bytes.

    None before the first sweep and after the last.
    """

    begin: int
    end: int
    before: Checkpoint | None
    after: Checkpoint | None


def read_checkpoints(run: Run) -> list[Checkpoint]:
    """All checkpoints of a run, in order."""
    found = []
    for message in McapReader(run.path).stream([CHECKPOINTS_TOPIC]):
        sweep = int.from_bytes(message.data[:4], "little")
        found.append(Checkpoint(sweep, run.sweeps[sweep - 1].chain, message.data[4:]))
    return found


def stretches(run: Run) -> list[Stretch]:
    """The run, cut at its checkpoints."""
    borders = [None, *(each for each in read_checkpoints(run) if each.sweep < len(run.sweeps)), None]
    cuts = [0, *(each.sweep for each in borders if each is not None), len(run.sweeps)]
    return [Stretch(cuts[k], cuts[k + 1], borders[k], borders[k + 1]) for k in range(len(borders) - 1)]


def resume(
    recording: Path, algorithm: Algorithm, path: Path, sweep: int, watcher: Watcher | None = None
) -> tuple[Replayed, int]:
    """Replay on from the last checkpoint at or before a sweep; also the number of the sweep that it begins with.

    Raises NoCheckpoint, and what reading the run and the recording raise.
    """
    run = read_run(path)
    if run.identity.recording_digest != recording_digest(recording):
        raise NoCheckpoint(f"{path} is a run of another recording than {recording}")
    if run.identity.algorithm != algorithm.name:
        raise NoCheckpoint(f"{path} is a run of {run.identity.algorithm}, not of {algorithm.name}")
    kept = [each for each in read_checkpoints(run) if each.sweep <= sweep]
    if not kept:
        raise NoCheckpoint(f"{path} keeps no checkpoint before sweep {sweep}: make it with --checkpoint-every")
    log = read_log(recording, run.identity.given_robot)
    sweeps = sweeps_of(log, recording)
    result = RunDigest.after(kept[-1].chain, kept[-1].restored().grid)
    if watcher:
        watcher.begin(log, len(sweeps.sweeps) - kept[-1].sweep)
    for step in _steps(log, sweeps, algorithm, kept[-1], None):
        result.add(step)
        if watcher:
            watcher.step(step, true_pose(log.truth, int(step.sweep.t_ns[step.sweep.reference])))
    counts = used_and_left_out(log, sweeps)
    return Replayed(result.result(), len(sweeps.sweeps), counts, log.missing), kept[-1].sweep


def _steps(log: Log, sweeps: Cut, algorithm: Algorithm, start: Checkpoint | None, end: int | None) -> Iterator[Step]:
    chosen = sweeps.sweeps[start.sweep if start else 0 : end]
    return pipeline.run(chosen, log.robot.ring(), algorithm, start.restored() if start else None)


def stretch_is_same(recording: Path, algorithm: Algorithm, path: Path, number: int) -> bool:
    """Whether a stretch of a run comes out the same from its own checkpoint: every digest, and the state at its end."""
    run = read_run(path)
    stretch = stretches(run)[number]
    log = read_log(recording, run.identity.given_robot)
    sweeps = sweeps_of(log, recording)
    if len(sweeps.sweeps) != len(run.sweeps):
        return False
    first = stretch.before
    result = RunDigest.after(first.chain, first.restored().grid) if first else RunDigest(run.identity.asked())
    state = None
    for k, step in enumerate(_steps(log, sweeps, algorithm, first, stretch.end), stretch.begin):
        if result.add(step) != run.sweeps[k].digests or result.chain != run.sweeps[k].chain:
            return False
        state = step.state
    if stretch.after is not None:
        return canonical(state) == stretch.after.state
    return result.result() == run.digest
