"""What differs between two runs of one recording: where they part, and how far map, path and truth are apart after.

Each level is computed by itself; `headline` says the whole in a sentence. Must not know: files, printing.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from slam.grid import Cells, Grid
from sonarlog.diff_words import decision_words, headline
from sonarlog.digest import BLOCKS
from sonarlog.errors import SonarlogError
from sonarlog.metrics import PathErrors
from sonarlog.runs import Run
from sonarlog.scores import path_of, score

STATES = ("unknown", "free", "occupied")


class NotComparable(SonarlogError):
    """Two runs that cannot be held against one another."""


@dataclass(frozen=True)
class FirstDifference:
    """The first sweep and block whose results differ, with what differs there in words."""

    sweep: int
    block: str
    name: str
    words: str


@dataclass(frozen=True)
class CellChanges:
    """Cells by state in A and in B: `table[a][b]` in the order unknown, free, occupied; unknown in both is not counted.

    `changed` is the share of the cells known to either run whose state differs.
    """

    table: tuple[tuple[int, int, int], ...]
    changed: float


@dataclass(frozen=True)
class PathChanges:
    """How far the two paths are apart over the sweeps that both have; `sweep` is where they are furthest apart."""

    largest_m: float
    mean_m: float
    largest_heading_deg: float
    sweep: int
    place: tuple[float, float]


@dataclass(frozen=True)
class Truth:
    """Errors of both paths. `nearer` is "A", "B" or "" for a difference under a millimetre."""

    a: PathErrors
    b: PathErrors
    nearer: str


@dataclass(frozen=True)
class Diff:
    """All levels of the difference between run A and run B; `first` is None if their results are the same."""

    names: tuple[str, str]
    sweeps: tuple[int, int]
    settings: dict[str, tuple[Any, Any]]
    first: FirstDifference | None
    cells: CellChanges
    path: PathChanges
    truth: Truth | None

    @property
    def same(self) -> bool:
        """Whether every block of every sweep, and the map, came out the same to the bit."""
        return self.first is None

    @property
    def headline(self) -> str:
        """The whole in a sentence or two."""
        return headline(self)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {"same": self.same, "headline": self.headline, **asdict(self)}


def diff_runs(a: Run, b: Run) -> Diff:
    """Hold two runs against one another.

    Raises NotComparable if they are of different recordings, or if their maps' cells have different sizes.
    """
    if a.identity.recording_digest != b.identity.recording_digest:
        raise NotComparable(f"{a.path} and {b.path} are runs of different recordings: only runs of one can be compared")
    if a.grid.cell_m != b.grid.cell_m:
        sizes = f"{100 * a.grid.cell_m:g} cm and {100 * b.grid.cell_m:g} cm"
        raise NotComparable(f"{a.path} and {b.path} have cells of {sizes}: replay both with the same map.cell_m")
    return Diff(
        names=_names(a, b),
        sweeps=(len(a.sweeps), len(b.sweeps)),
        settings=_settings(a, b),
        first=first_difference(a, b),
        cells=cell_changes(a.grid, b.grid),
        path=_path_changes(a, b),
        truth=_truth(a, b),
    )


def first_difference(a: Run, b: Run) -> FirstDifference | None:
    """The first sweep and block, in the order of Fig. 5, whose digests differ; None if none does."""
    for mine, yours in zip(a.sweeps, b.sweeps, strict=False):
        for letter, (name, _) in BLOCKS.items():
            if mine.digests[letter] != yours.digests[letter]:
                return FirstDifference(mine.index, letter, name, decision_words(letter, mine.data, yours.data))
    if len(a.sweeps) != len(b.sweeps):
        shorter, longer = sorted((len(a.sweeps), len(b.sweeps)))
        which = "A" if len(a.sweeps) == longer else "B"
        return FirstDifference(shorter, "A", BLOCKS["A"][0], f"only {which} has sweep {shorter} and those after it")
    if a.map_digest != b.map_digest:  # the same evidence, on another first map
        return FirstDifference(
            max(0, len(a.sweeps) - 1), "H", BLOCKS["H"][0], "what counts as occupied or free differs"
        )
    return None


def cell_changes(a: Grid, b: Grid) -> CellChanges:
    """What became of each cell from A to B; the maps have the same origin and cell size."""
    boxes = [grid.bounds() for grid in (a, b) if grid.tiles]
    left, bottom = (min((box[k] for box in boxes), default=0) for k in (0, 1))
    width, height = (max((box[k] + box[k + 2] for box in boxes), default=0) - (left, bottom)[k] for k in (0, 1))
    states = [_states(grid, grid.window(left, bottom, width, height)) for grid in (a, b)]
    counts = np.bincount((3 * states[0] + states[1]).reshape(-1), minlength=9).reshape(3, 3)
    counts[0, 0] = 0
    known = int(counts.sum())
    rows = [(int(row[0]), int(row[1]), int(row[2])) for row in counts]
    return CellChanges(tuple(rows), float(known - np.trace(counts)) / known if known else 0.0)


def _states(grid: Grid, cells: Cells) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    return np.where(grid.occupied(cells), 2, np.where(grid.free(cells), 1, 0)).astype(np.int64)


def _path_changes(a: Run, b: Run) -> PathChanges:
    count = min(len(a.sweeps), len(b.sweeps))
    if count == 0:
        return PathChanges(0.0, 0.0, 0.0, 0, (0.0, 0.0))
    mine, yours = path_of(a)[:count], path_of(b)[:count]
    off = np.hypot(mine[:, 0] - yours[:, 0], mine[:, 1] - yours[:, 1])
    turned = np.abs(np.angle(np.exp(1j * (mine[:, 2] - yours[:, 2]))))
    at = int(np.argmax(off))
    place = (float(mine[at, 0]), float(mine[at, 1]))
    return PathChanges(float(off[at]), float(off.mean()), float(np.degrees(turned.max())), at, place)


def _truth(a: Run, b: Run) -> Truth | None:
    mine, yours = score(a), score(b)
    if mine is None or yours is None:
        return None
    off = mine.path.ate_m - yours.path.ate_m
    return Truth(mine.path, yours.path, "" if abs(off) < 1e-3 else "B" if off > 0 else "A")


def _names(a: Run, b: Run) -> tuple[str, str]:
    """What tells the runs apart: their algorithms, else their files."""
    if a.identity.algorithm != b.identity.algorithm:
        return a.identity.algorithm, b.identity.algorithm
    return a.path.name, b.path.name


def _settings(a: Run, b: Run) -> dict[str, tuple[Any, Any]]:
    """What of the runs' identities differs: algorithm, code, and each setting by its full name."""
    mine = {"algorithm": f"{a.identity.algorithm} {a.identity.algorithm_version}", "code": a.identity.code_digest}
    yours = {"algorithm": f"{b.identity.algorithm} {b.identity.algorithm_version}", "code": b.identity.code_digest}
    mine, yours = {**mine, **a.identity.config}, {**yours, **b.identity.config}
    return {key: (mine.get(key), yours.get(key)) for key in (mine | yours) if mine.get(key) != yours.get(key)}
