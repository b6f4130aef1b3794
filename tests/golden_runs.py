"""Golden runs: for each recording in recordings/ and each algorithm the digests, poses and map that it must give.

`make golden` shows what changed; with BLESS=1 it also writes. Usage: python -m tests.golden_runs [--write]
"""

import base64
import json
import sys
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from slam.algorithms import ALGORITHMS, algorithm
from slam.grid import Grid
from sonarlog.digest import BLOCKS, MAP, RunDigest
from sonarlog.log import Log
from sonarlog.recording import read_log, recording_digest
from sonarlog.replay import replay_sweeps, sweeps_of
from sonarlog.runs import identify
from sonarlog.step_data import pose_data
from sonarlog.sweeps import Cut

ROOT = Path(__file__).resolve().parent.parent
KEPT = ROOT / "tests" / "golden"
SHORT = 12
"""So many digits of a block's digest are kept; chain and run have all of theirs."""

STATES = ("unknown", "free", "occupied")


@dataclass(frozen=True)
class Golden:
    """One run: the digest of what was asked, of the run and of its map; for each sweep its row; the final map."""

    name: str
    asked: dict[str, Any]
    digest: str
    map_digest: str
    sweeps: list[dict[str, Any]]
    map: dict[str, Any]

    def path(self) -> Path:
        """Where it is kept."""
        return KEPT / f"{self.name}.json"

    def to_json(self) -> str:
        """One line a sweep, so that git's own diff can be read."""
        head = {"name": self.name, "digest": self.digest, "map_digest": self.map_digest, "asked": self.asked}
        rows = ",\n".join(f"  {json.dumps(row)}" for row in self.sweeps)
        lines = [f" {json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
        return "{\n" + ",\n".join([*lines, f' "sweeps": [\n{rows}\n ]', f' "map": {json.dumps(self.map)}']) + "\n}\n"


def recordings() -> list[Path]:
    """Those that are committed."""
    return sorted(path for path in (ROOT / "recordings").glob("*.mcap") if ".run." not in path.name)


def names() -> list[tuple[Path, str]]:
    """Every recording with every algorithm."""
    return [(path, name) for path in recordings() for name in ALGORITHMS]


def kept(path: Path, name: str) -> Golden | None:
    """The golden run as it was blessed; None if it never was."""
    file = KEPT / f"{path.stem}.{name}.json"
    return Golden(**json.loads(file.read_text(encoding="utf-8"))) if file.exists() else None


@cache
def _read(path: Path) -> tuple[Log, Cut, str]:
    log = read_log(path)
    return log, sweeps_of(log, path), recording_digest(path)


def made(path: Path, name: str) -> Golden:
    """The run as this code makes it."""
    log, sweeps, recording = _read(path)
    chosen = algorithm(name)
    asked = identify(recording, chosen).asked()
    result, rows = RunDigest(asked), []
    for step in replay_sweeps(log, sweeps, chosen):
        digests = {block: made[:SHORT] for block, made in result.add(step).items()}
        rows.append({"pose": pose_data(step.pose), "chain": result.chain, "digests": digests})
    return Golden(f"{path.stem}.{name}", asked, result.result(), result.map_digest(), rows, _packed(step.state.grid))


def _packed(grid: Grid) -> dict[str, Any]:
    cells, left, bottom = grid.dense()
    states = np.where(grid.occupied(cells), 2, np.where(grid.free(cells), 1, 0)).astype(np.uint8)
    data = base64.b64encode(zlib.compress(states.tobytes(), 9)).decode()
    return {"left": left, "bottom": bottom, "shape": list(states.shape), "states": data}


def _unpacked(kept: dict[str, Any], box: tuple[int, int, int, int]) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """The states of the cells in a box (left, bottom, right, top)."""
    states = np.frombuffer(zlib.decompress(base64.b64decode(kept["states"])), np.uint8).reshape(kept["shape"])
    left, bottom, right, top = box
    whole = np.zeros((top - bottom, right - left), dtype=np.uint8)
    x, y = kept["left"] - left, kept["bottom"] - bottom
    whole[y : y + states.shape[0], x : x + states.shape[1]] = states
    return whole


def changes(before: Golden | None, now: Golden) -> str:
    """What changed, as someone who uses it would read it; empty: nothing."""
    if before is None:
        return f"{now.name}: new, {len(now.sweeps)} sweeps, digest {now.digest}"
    if before == now:
        return ""
    return f"{now.name}: " + "; ".join(
        [*_asked(before, now), *_first(before, now), *_poses(before, now), *_cells(before, now)]
    )


def _asked(before: Golden, now: Golden) -> Iterator[str]:
    a, b = ({**golden.asked, **golden.asked["config"]} for golden in (before, now))
    for key in [*a, *(key for key in b if key not in a)]:
        if key != "config" and a.get(key) != b.get(key):
            yield f"{key} was {a.get(key)}, is {b.get(key)}"


def _first(before: Golden, now: Golden) -> Iterator[str]:
    blocks = {letter: f"{name} (block {letter})" for letter, (name, _) in BLOCKS.items()} | {MAP: "the map"}
    for k, (a, b) in enumerate(zip(before.sweeps, now.sweeps, strict=False)):
        for block, name in blocks.items():
            if a["digests"][block] != b["digests"][block]:
                yield f"differs first at sweep {k}, {name}"
                return
    if len(before.sweeps) != len(now.sweeps):
        yield f"{len(before.sweeps)} sweeps were, {len(now.sweeps)} are"
    else:
        yield "every block of every sweep is the same"


def _poses(before: Golden, now: Golden) -> Iterator[str]:
    pairs = [(a["pose"], b["pose"]) for a, b in zip(before.sweeps, now.sweeps, strict=False)]
    moved = [max(abs(a[0] - b[0]), abs(a[1] - b[1])) for a, b in pairs if a != b]
    if moved:
        yield f"{len(moved)} of {len(pairs)} poses change, by up to {1000 * max(moved):.3g} mm"


def _cells(before: Golden, now: Golden) -> Iterator[str]:
    maps = (before.map, now.map)
    low = [min(each[key] for each in maps) for key in ("left", "bottom")]
    right = max(each["left"] + each["shape"][1] for each in maps)
    top = max(each["bottom"] + each["shape"][0] for each in maps)
    a, b = (_unpacked(each, (low[0], low[1], right, top)) for each in maps)
    ways = [(i, j, int(np.count_nonzero((a == i) & (b == j)))) for i in range(3) for j in range(3) if i != j]
    told = [f"{count} {STATES[i]} → {STATES[j]}" for i, j, count in ways if count]
    if told:
        yield f"{int(np.count_nonzero(a != b))} of {int(np.count_nonzero(a | b))} known cells change: {', '.join(told)}"


def main(arguments: list[str]) -> int:
    """Show what changed; with --write bless it. Exit 1 if something changed and was not blessed."""
    changed = []
    for path, name in names():
        now = made(path, name)
        told = changes(kept(path, name), now)
        print(told or f"{now.name}: the same", flush=True)
        changed += [now] if told else []
    gone = {file.stem for file in KEPT.glob("*.json")} - {f"{path.stem}.{name}" for path, name in names()}
    for stem in sorted(gone):
        print(f"{stem}: no such recording or algorithm any more")
    if "--write" not in arguments:
        print("nothing to do" if not changed and not gone else "to bless all this: make golden BLESS=1")
        return 1 if changed or gone else 0
    KEPT.mkdir(exist_ok=True)
    for now in changed:
        now.path().write_text(now.to_json(), encoding="utf-8")
    for stem in gone:
        (KEPT / f"{stem}.json").unlink()
    print(f"blessed: {len(changed) + len(gone)} of {len(names())}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
