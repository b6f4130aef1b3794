"""Processor time of each block of a replay, sweep by sweep, the digests and the writing of the run among them.

The blocks are timed where the pipeline calls them, so nothing is done that a replay does not do.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from slam import pipeline
from slam.algorithms import Algorithm
from slam.pipeline import Step
from sonarlog.digest import RunDigest
from sonarlog.recording import read_log
from sonarlog.replay import replay_sweeps, sweeps_of
from sonarlog.runs import RunWriter, identify

BLOCKS = {
    "B": "self_calibrate",
    "C": "analyse_reliability",
    "D": "extract_features",
    "G": "post_calibrate",
    "H": "extend_map",
    "I": "next_goal",
}
"""Blocks that are functions of the pipeline's; E and F come with the algorithm."""


@dataclass
class Times:
    """Seconds: of reading and cutting, and by block of every sweep; `whole` of everything of each sweep."""

    reading: float = 0.0
    blocks: dict[str, list[float]] = field(default_factory=dict)
    whole: list[float] = field(default_factory=list)

    def timed(self, name: str, work: Callable[..., Any]) -> Callable[..., Any]:
        """The same function, its time added."""

        def timing(*arguments: Any, **named: Any) -> Any:
            begin = time.process_time()
            try:
                return work(*arguments, **named)
            finally:
                self.blocks.setdefault(name, []).append(time.process_time() - begin)

        return timing


@contextmanager
def _watched(times: Times) -> Iterator[None]:
    own = {name: getattr(pipeline, name) for name in BLOCKS.values()}
    try:
        for letter, name in BLOCKS.items():
            setattr(pipeline, name, times.timed(letter, own[name]))
        yield
    finally:
        for name, work in own.items():
            setattr(pipeline, name, work)


def measure(
    recording: Path, algorithm: Algorithm, run: Path, *, sweeps: int | None = None, each: Callable[[int, Times], None]
) -> tuple[Times, Step]:
    """Replay into a run, the first `sweeps` only if given; `each` hears of every sweep. Also the last step."""
    times = Times()
    begin = time.process_time()
    log = read_log(recording)
    cut = sweeps_of(log, recording)
    times.reading = time.process_time() - begin
    chosen = replace(
        algorithm,
        associate=times.timed("E", algorithm.associate),
        localise=times.timed("F", algorithm.localise),
    )
    identity = identify(log.digest, algorithm)
    result = RunDigest(identity.asked())
    with _watched(times), RunWriter(run, identity, recording=recording, force=True) as writer:
        add, write = times.timed("digests", result.add), times.timed("writing", writer.add)
        begin = time.process_time()
        for number, step in enumerate(replay_sweeps(log, replace(cut, sweeps=cut.sweeps[:sweeps]), chosen)):
            write(step, add(step), result)
            now = time.process_time()
            times.whole.append(now - begin)
            begin = now
            each(number, times)
        writer.finish(result, step.state, log.counts, log.surfaces)
    return times, step
