"""Whether a run comes out the same again; if not, the first sweep and block that part, with both sides' values.

Must not know: how the second run was made, printing.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from slam.grid import Grid, Patch
from sonarlog.apart import Apart, apart, plain
from sonarlog.canonical import read_canonical
from sonarlog.diff import cell_changes
from sonarlog.diff.decisions import decided
from sonarlog.diff.first import NEEDS, kept
from sonarlog.digest import BLOCKS, MAP
from sonarlog.errors import SonarlogError
from sonarlog.recording import recording_digest
from sonarlog.runs import Run, read_blocks
from sonarlog.step_data import chains_of, pose_data


class NoRecording(SonarlogError):
    """The recording that a run was made from is not to be found."""


class CannotDump(SonarlogError):
    """The folder for the values cannot be written, or holds such values already."""


@dataclass(frozen=True)
class Parting:
    """Where two runs part: `block` of sweep number `sweep`, by letter, "map", or "" for what the run was asked.

    `inputs` are the block's, the same on both sides; `outputs` those of the run and of the replay, in plain terms (None
    where the run kept no values); `differences` between the outputs.
    """

    sweep: int
    block: str
    name: str
    words: str
    inputs: dict[str, Any]
    outputs: tuple[Any, Any]
    differences: tuple[Apart, ...]

    @property
    def ulps(self) -> int | None:
        """The largest difference of a float in units in the last place."""
        return max((each.ulps for each in self.differences if each.ulps is not None), default=None)


@dataclass(frozen=True)
class Verified:
    """What came of it: where the two part first (None: nowhere), and how far apart they end."""

    sweeps: tuple[int, int]
    digests: tuple[str, str]
    first: Parting | None
    position_mm: float
    heading_deg: float
    cells: int

    @property
    def same(self) -> bool:
        """Whether everything is the same to the bit."""
        return self.first is None

    def as_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON; the blocks' values go to a dump."""
        first = self.first
        return {
            "same": self.same,
            "sweeps": list(self.sweeps),
            "digests": list(self.digests),
            "first": first
            and {
                "sweep": first.sweep,
                "block": first.block,
                "name": first.name,
                "words": first.words,
                "values": len(first.differences),
                "ulps": first.ulps,
                "differences": [vars(each) for each in first.differences[:20]],
            },
            "position_mm": self.position_mm,
            "heading_deg": self.heading_deg,
            "cells": self.cells,
        }


def find_recording(run: Run, given: Path | None) -> Path:
    """The recording that the run was made from: as given, or where the run says, or beside it. Raises NoRecording."""
    said = Path(run.machine.get("recording", ""))
    wanted = run.identity.recording_digest
    if given is not None:
        if recording_digest(given) != wanted:
            raise NoRecording(f"{given} is not the recording that {run.path} was made from")
        return given
    beside = [folder / said.name for folder in (run.path.parent, Path(), Path("recordings"))] if said.name else []
    for path in dict.fromkeys([said, *beside]):
        if path.is_file() and recording_digest(path) == wanted:
            return path
    name = f"{said.name}, " if said.name else ""
    raise NoRecording(f"the recording of {run.path} ({name}digest {wanted}) is not beside it: name it after the run")


def compare(run: Run, again: Run) -> Verified:
    """Hold a run against another of the same recording. Raises BadRun for values that do not have their digests."""
    off = [(a.step_to(b), a, b) for a, b in zip(run.poses, again.poses, strict=False)]
    position = max((max(abs(a.x - b.x), abs(a.y - b.y)) for _, a, b in off), default=0.0)
    turned = max((abs(step.theta) for step, _, _ in off), default=0.0)
    table = cell_changes(run.grid, again.grid).table
    return Verified(
        sweeps=(len(run.sweeps), len(again.sweeps)),
        digests=(run.digest, again.digest),
        first=_first(run, again),
        position_mm=1000.0 * position,
        heading_deg=turned * 57.29577951308232,
        cells=sum(count for i, row in enumerate(table) for j, count in enumerate(row) if i != j),
    )


def _first(run: Run, again: Run) -> Parting | None:
    for k, (mine, yours) in enumerate(zip(run.sweeps, again.sweeps, strict=False)):
        for block in (*BLOCKS, MAP):
            if mine.digests.get(block) != yours.digests.get(block):
                return _parting(run, again, k, block)
    if len(run.sweeps) != len(again.sweeps):
        words = f"{len(run.sweeps)} sweeps in the run, {len(again.sweeps)} in the replay"
        return Parting(min(len(run.sweeps), len(again.sweeps)), "A", BLOCKS["A"][0], words, {}, (None, None), ())
    if run.digest != again.digest:
        return _asked(run, again)
    return None


def _asked(run: Run, again: Run) -> Parting:
    """Every block came out the same, but not what was asked: a setting that changed nothing, another version."""
    asked = run.identity.asked(), again.identity.asked()
    differences = tuple(apart(*asked))
    names = ", ".join(each.where for each in differences) or "the chain of digests"
    words = f"every block of every sweep is the same, but not what was asked of them: {names}"
    return Parting(0, "", "what was asked", words, {}, asked, differences)


def _parting(run: Run, again: Run, k: int, block: str) -> Parting:
    mine, yours = kept(run, k), kept(again, k)
    inputs = {f"{letter} {BLOCKS[letter][0]}": read_canonical(yours[letter]) for letter in NEEDS[block]}
    inputs["before"] = _state_before(again, k)
    if block == MAP:
        words = "what the cells became differs, though what was added to them does not"
        return Parting(k, MAP, "the map", words, inputs, (None, None), ())
    outputs = (read_canonical(mine[block]) if mine else None, read_canonical(yours[block]))
    differences = tuple(apart(*outputs)) if mine else ()
    said = decided(block, (run.sweeps[k].data, again.sweeps[k].data), outputs, differences, run.grid.cell_m)
    words = f"run: {said[0]}; replay: {said[1]}"
    return Parting(k, block, BLOCKS[block][0], words, inputs, outputs, differences)


def _state_before(run: Run, k: int) -> dict[str, Any]:
    """What the sweep started from: settings, poses, walls and map after the sweep before."""
    chains = chains_of([sweep.data for sweep in run.sweeps[:k]])
    cells, left, bottom = _map_before(run, k).dense()
    return {
        "settings": run.identity.config,
        "poses": [pose_data(sweep.pose) for sweep in run.sweeps[:k]],
        "walls": [
            {
                "chain": m.chain,
                "sweep": m.sweep,
                "alpha": m.segment.alpha,
                "rho": m.segment.rho,
                "start": m.segment.start,
                "end": m.segment.end,
            }
            for m in chains.members
        ],
        "map": {"left": left, "bottom": bottom, "cells": cells},
    }


def _map_before(run: Run, k: int) -> Grid:
    """The map made anew of what each sweep added to it."""
    grid = Grid(run.grid.cell_m, run.grid.occupied_from, run.grid.free_from)
    for patch in _patches(run, k):
        grid = grid.extended(patch)
    return grid


def _patches(run: Run, k: int) -> Iterator[Patch]:
    for blocks in islice(read_blocks(run.path), k):
        patch = read_canonical(blocks["H"])
        yield Patch(patch["left"], patch["bottom"], patch["delta"])


def dump(parting: Parting, folder: Path, *, force: bool = False) -> list[Path]:
    """Write inputs.json, output.run.json, output.replay.json and apart.json, every number in full. Raises CannotDump.

    The numbers are written so that reading them back gives the same bits.
    """
    parts = {
        "inputs.json": parting.inputs,
        "output.run.json": parting.outputs[0],
        "output.replay.json": parting.outputs[1],
        "apart.json": {
            "sweep": parting.sweep,
            "block": parting.block,
            "name": parting.name,
            "words": parting.words,
            "differences": [vars(each) for each in parting.differences],
        },
    }
    paths = [folder / name for name in parts]
    taken = [path for path in paths if path.exists()]
    if taken and not force:
        raise CannotDump(f"{taken[0]} exists and is not overwritten: choose another folder, or give --force")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, value in zip(paths, parts.values(), strict=True):
            path.write_text(json.dumps(plain(value), indent=1, ensure_ascii=False, allow_nan=False), encoding="utf-8")
    except OSError as error:
        raise CannotDump(f"cannot write to {folder}: {error.strerror or error}") from None
    return paths
