"""Time per block of a run: a fact about the machine that made it, and no part of its result.

Must not know: which clock there is (it is handed in), files.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median

Clock = Callable[[], int]
"""Nanoseconds since any moment: processor time for choice, which other programs disturb least."""

TIMES = "times"
"""The name of the metadata that a run keeps them in."""

TIMED = ("B", "C", "D", "E", "F", "G", "H", "I")
"""The blocks that take time in a replay: all sweeps are cut (A) before the first step."""


@dataclass(frozen=True)
class BlockTimes:
    """What each block took of each sweep, in µs, by its letter: as many numbers for each of TIMED."""

    taken_us: dict[str, tuple[int, ...]]

    def __post_init__(self) -> None:
        """Raises ValueError for other blocks, for blocks of different numbers of sweeps, and for times before 0."""
        if tuple(self.taken_us) != TIMED:
            raise ValueError(f"times of blocks {', '.join(self.taken_us)}, not of {', '.join(TIMED)}")
        if len({len(taken) for taken in self.taken_us.values()}) != 1:
            raise ValueError("times of different numbers of sweeps")
        if any(each < 0 for taken in self.taken_us.values() for each in taken):
            raise ValueError("a block cannot take less than no time")

    @property
    def whole_us(self) -> tuple[int, ...]:
        """What all blocks took of each sweep."""
        return tuple(map(sum, zip(*self.taken_us.values(), strict=True)))

    def median_ms(self, block: str | None = None) -> float:
        """Of a sweep, by one block or (None) by all of them; 0 without sweeps."""
        return median(self._of(block) or (0,)) / 1e3

    def total_ms(self, block: str | None = None) -> float:
        """Of all sweeps, by one block or (None) by all of them."""
        return sum(self._of(block)) / 1e3

    def _of(self, block: str | None) -> tuple[int, ...]:
        return self.whole_us if block is None else self.taken_us[block]

    def told(self) -> str:
        """In a line: the medians of the sweeps, and all together."""
        blocks = ", ".join(f"{block} {short(self.median_ms(block))}" for block in TIMED)
        return f"{short(self.median_ms())} ms a sweep ({blocks}), {self.total_ms() / 1e3:.2f} s in all"

    def as_dict(self) -> dict[str, dict[str, float]]:
        """Median of a sweep and total in ms, by block and of all: plain values, ready for JSON."""
        rows = [*((block, block) for block in TIMED), ("all", None)]
        return {name: {"median_ms": self.median_ms(block), "total_ms": self.total_ms(block)} for name, block in rows}

    def as_metadata(self) -> dict[str, str]:
        """As a run keeps it: by block, in µs, sweep after sweep."""
        return {f"{block}_us": json.dumps(taken, separators=(",", ":")) for block, taken in self.taken_us.items()}


class Stopwatch:
    """Hears a pipeline's blocks (`slam.pipeline.Hear`); `taken_ns` is what each took by the clock, sweep by sweep."""

    def __init__(self, clock: Clock) -> None:
        self.taken_ns: dict[str, list[int]] = {block: [] for block in TIMED}
        self._clock = clock
        self._since = 0

    def __call__(self, block: str) -> None:
        """That block is done; "A", a sweep came in, only starts the watch."""
        now = self._clock()
        if block in self.taken_ns:
            self.taken_ns[block].append(now - self._since)
        self._since = now

    def times(self) -> BlockTimes:
        """So far."""
        return BlockTimes({block: tuple(ns // 1000 for ns in taken) for block, taken in self.taken_ns.items()})


def times_in(metadata: Mapping[str, Mapping[str, str]]) -> BlockTimes | None:
    """What the blocks took, of a run's metadata; None from runs that keep no times, or those of other blocks."""
    kept = metadata.get(TIMES, {})
    try:
        return BlockTimes({block: tuple(map(int, json.loads(kept[f"{block}_us"]))) for block in TIMED})
    except (KeyError, ValueError, TypeError):
        return None


def short(ms: float) -> str:
    """Milliseconds in few digits, hundredths only of less than one."""
    return f"{ms:.1f}" if ms >= 1 else f"{ms:.2f}"
