"""Processor time of each block of a replay, sweep by sweep, the digests and the writing of the run among them.

The blocks are timed as any replay times them, so nothing is done that a replay does not do.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from slam.algorithms import Algorithm
from slam.pipeline import Step
from sonarlog.digest import RunDigest
from sonarlog.recording import read_log
from sonarlog.replay import replay_sweeps, sweeps_of
from sonarlog.runs import RunWriter, identify
from sonarlog.times import Stopwatch


@dataclass
class Times:
    """Seconds: of reading and cutting, and of everything of each sweep; by block as `watch` heard it."""

    reading: float = 0.0
    whole: list[float] = field(default_factory=list)
    watch: Stopwatch = field(default_factory=lambda: Stopwatch(time.process_time_ns))
    beside: dict[str, list[float]] = field(default_factory=dict)

    @property
    def blocks(self) -> dict[str, list[float]]:
        """Seconds of every sweep by block, and of what is done beside the blocks."""
        return {block: [ns / 1e9 for ns in taken] for block, taken in self.watch.taken_ns.items()} | self.beside

    def timed(self, name: str, work: Callable[..., Any]) -> Callable[..., Any]:
        """The same function, its time added to what is done beside the blocks."""

        def timing(*arguments: Any) -> Any:
            begin = time.process_time()
            try:
                return work(*arguments)
            finally:
                self.beside.setdefault(name, []).append(time.process_time() - begin)

        return timing


def measure(
    recording: Path, algorithm: Algorithm, run: Path, *, sweeps: int | None = None, each: Callable[[int, Times], None]
) -> tuple[Times, Step]:
    """Replay into a run, the first `sweeps` only if given; `each` hears of every sweep. Also the last step."""
    times = Times()
    begin = time.process_time()
    log = read_log(recording)
    cut = sweeps_of(log, recording)
    times.reading = time.process_time() - begin
    chosen = replace(cut, sweeps=cut.sweeps[:sweeps])
    identity = identify(log.digest, algorithm)
    result = RunDigest(identity.asked())
    with RunWriter(run, identity, recording=recording, force=True) as writer:
        add, write = times.timed("digests", result.add), times.timed("writing", writer.add)
        begin = time.process_time()
        for number, step in enumerate(replay_sweeps(log, chosen, algorithm, times.watch)):
            write(step, add(step), result)
            now = time.process_time()
            times.whole.append(now - begin)
            begin = now
            each(number, times)
        writer.finish(result, step.state, log.counts, log.surfaces, times.watch.times())
    return times, step
