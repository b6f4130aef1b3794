"""The first sweep and block whose results differ, with what the block took, and what it made of it on both sides.

Must not know: maps, walls, how differences are shown.
"""

from dataclasses import dataclass
from itertools import islice
from typing import Any

from sonarlog.apart import Apart, apart
from sonarlog.canonical import read_canonical
from sonarlog.diff.decisions import chained, decided
from sonarlog.digest import BLOCKS, MAP, digest_of
from sonarlog.runs import BadRun, Run, read_blocks

NEEDS = {
    "A": "",
    "B": "A",
    "C": "B",
    "D": "C",
    "E": "BD",
    "F": "BE",
    "G": "BCDF",
    "H": "BCG",
    "I": "F",
    MAP: "H",
}
"""Which blocks' results of the same sweep each block takes."""


@dataclass(frozen=True)
class FirstDifference:
    """The first sweep and block whose results differ, with what differs there in words.

    `decisions` are those of A and of B. In plain terms (`read_canonical`; empty and None where a run keeps no values):
    `inputs` what the block took of the same sweep, by name, the same on both sides; `outputs` what it made of it in A
    and in B; `differences` between these.
    """

    sweep: int
    block: str
    name: str
    decisions: tuple[str, str]
    inputs: dict[str, Any]
    outputs: tuple[Any, Any]
    differences: tuple[Apart, ...]
    sides: tuple[str, str] = ("A", "B")

    @property
    def words(self) -> str:
        """`A: wall 2 joins chain 5 (…); B: wall 2 starts chain 7`."""
        if not self.decisions[1]:
            return self.decisions[0]
        return f"{self.sides[0]}: {self.decisions[0]}; {self.sides[1]}: {self.decisions[1]}"


def first_difference(a: Run, b: Run, sides: tuple[str, str] = ("A", "B")) -> FirstDifference | None:
    """The first sweep and block, in the order of Fig. 5, whose digests differ; None if none does. Raises BadRun."""
    for k, (mine, yours) in enumerate(zip(a.sweeps, b.sweeps, strict=False)):
        for letter in BLOCKS:
            if mine.digests.get(letter) != yours.digests.get(letter):
                return _difference(a, b, k, letter, sides)
        if mine.digests.get(MAP) != yours.digests.get(MAP):
            return _said(k, "H", _of_map(a, b))
    if len(a.sweeps) != len(b.sweeps):
        shorter, longer = sorted((len(a.sweeps), len(b.sweeps)))
        which = sides[0] if len(a.sweeps) == longer else sides[1]
        return _said(shorter, "A", f"only {which} has sweep {shorter} and those after it")
    if a.map_digest != b.map_digest:
        return _said(max(0, len(a.sweeps) - 1), "H", _of_map(a, b))
    return None


def _of_map(a: Run, b: Run) -> str:
    """What differs where the evidence does not."""
    mine, yours = ((run.grid.occupied_from, run.grid.free_from) for run in (a, b))
    if mine != yours:
        return "what counts as occupied or free differs"
    return "what the cells became differs, though what was added to them does not"


@dataclass(frozen=True)
class Chaining:
    """The first sweep in which a wall joins another chain in A than in B, and what becomes of it in A and in B."""

    sweep: int
    decisions: tuple[str, str]


def first_chaining(a: Run, b: Run) -> Chaining | None:
    """Where the walls begin to be chained otherwise: what matters where two algorithms differ from the start."""
    for mine, yours in zip(a.sweeps, b.sweeps, strict=False):
        said = chained(mine.data, yours.data)
        if said is not None:
            return Chaining(mine.index, said)
    return None


def _said(sweep: int, block: str, words: str) -> FirstDifference:
    return FirstDifference(sweep, block, BLOCKS[block][0], (words, ""), {}, (None, None), ())


def _difference(a: Run, b: Run, k: int, letter: str, sides: tuple[str, str]) -> FirstDifference:
    mine, yours = kept(a, k), kept(b, k)
    outputs = _plain(mine, letter), _plain(yours, letter)
    differences = tuple(apart(*outputs)) if letter in mine and letter in yours else ()
    blocks = yours or mine  # what the block took is the same on both sides, for nothing before it differs
    inputs = {f"{need} {BLOCKS[need][0]}": _plain(blocks, need) for need in NEEDS[letter] if need in blocks}
    decisions = decided(letter, (a.sweeps[k].data, b.sweeps[k].data), outputs, differences, a.grid.cell_m)
    return FirstDifference(k, letter, BLOCKS[letter][0], decisions, inputs, outputs, differences, sides)


def _plain(blocks: dict[str, bytes], letter: str) -> Any:
    return read_canonical(blocks[letter]) if letter in blocks else None


def kept(run: Run, k: int) -> dict[str, bytes]:
    """The canonical bytes of one sweep's blocks; empty where the run keeps none. Raises BadRun if they were altered."""
    for blocks in islice(read_blocks(run.path), k, k + 1):
        for letter, data in blocks.items():
            if digest_of(data) != run.sweeps[k].digests[letter]:
                raise BadRun(f"{run.path} was altered: block {letter} of sweep {k} does not have its digest")
        return blocks
    return {}
