"""How long each block takes in two runs, and what the numbers are worth. Must not know: what the blocks made."""

from dataclasses import dataclass

from sonarlog.digest import BLOCKS
from sonarlog.runs import Run
from sonarlog.times import TIMED

NOISE, MOOD = 1.3, 2.0
"""Ratios beyond this, either way, are told without being asked for: of two runs made one beside the other, and of runs
made at different times, when the machine may have been busier throughout."""
SHARE = 0.05
"""Blocks that take less of a sweep than this on both sides are not told by themselves."""
ALL = ""
"""Stands for all blocks together where a block's letter stands else."""
MACHINE = ("host", "platform", "python", "numpy")
"""Facts that two runs of one machine share."""


@dataclass(frozen=True)
class BlockTime:
    """Milliseconds a sweep (median) of a block, by its letter, or of ALL of them, in A and in B."""

    block: str
    name: str
    a_ms: float
    b_ms: float

    @property
    def ratio(self) -> float | None:
        """How many times as long as A's B's takes; None where A's takes no time that the clock shows."""
        return self.b_ms / self.a_ms if self.a_ms else None

    def beyond(self, ratio: float) -> bool:
        """Whether one takes more than so many times as long as the other."""
        return max(self.a_ms, self.b_ms) > ratio * min(self.a_ms, self.b_ms)

    def mirrored(self) -> "BlockTime":
        """From B to A."""
        return BlockTime(self.block, self.name, self.b_ms, self.a_ms)


@dataclass(frozen=True)
class TimeChanges:
    """`blocks` in the order of Fig. 5, `whole` all of them together.

    `apart` are the facts about the machines that differ, by name, in A and in B; `now` says of each side whether it was
    replayed for this comparison, or is a run that was kept.
    """

    blocks: tuple[BlockTime, ...]
    whole: BlockTime
    apart: dict[str, tuple[str, str]]
    now: tuple[bool, bool]

    @property
    def rows(self) -> tuple[BlockTime, ...]:
        """Every block, then all together."""
        return *self.blocks, self.whole

    @property
    def noise(self) -> float:
        """Ratios up to this say nothing."""
        return NOISE if all(self.now) and not self.apart else MOOD

    @property
    def telling(self) -> tuple[BlockTime, ...]:
        """The rows whose ratio says something, of blocks that matter."""
        least = SHARE * max(self.whole.a_ms, self.whole.b_ms)
        return tuple(row for row in self.rows if row.beyond(self.noise) and max(row.a_ms, row.b_ms) >= least)

    @property
    def words(self) -> str:
        """What the numbers are worth, to stand behind `Times:`."""
        if self.apart:
            which = "two machines" if {"host", "platform"} & set(self.apart) else "other libraries"
            facts = ", ".join(f"{name} {a} and {b}" for name, (a, b) in self.apart.items())
            return f"of {which} ({facts}): the ratios are theirs as much as the code's"
        if all(self.now):
            return f"both measured now on this machine; less than × {self.noise:g} may be noise"
        kept = "both kept from" if not any(self.now) else f"{'B' if self.now[0] else 'A'} kept from"
        return f"of one machine, {kept} earlier; less than × {self.noise:g} may be noise, of all blocks alike"

    def mirrored(self) -> "TimeChanges":
        """From B to A."""
        blocks = tuple(block.mirrored() for block in self.blocks)
        apart = {name: (b, a) for name, (a, b) in self.apart.items()}
        return TimeChanges(blocks, self.whole.mirrored(), apart, (self.now[1], self.now[0]))


def time_changes(a: Run, b: Run, now: tuple[bool, bool]) -> TimeChanges | None:
    """Times of both, block by block; None unless both runs keep them."""
    mine, yours = a.times, b.times
    if mine is None or yours is None:
        return None
    pairs = ((name, a.machine.get(name, ""), b.machine.get(name, "")) for name in MACHINE)
    return TimeChanges(
        blocks=tuple(BlockTime(x, BLOCKS[x][0], mine.median_ms(x), yours.median_ms(x)) for x in TIMED),
        whole=BlockTime(ALL, "all blocks", mine.median_ms(), yours.median_ms()),
        apart={name: (here, there) for name, here, there in pairs if here != there},
        now=now,
    )
