"""Which of two runs is nearer to the truth, metric by metric, where one is known. Must not know: how runs differ."""

from dataclasses import dataclass

from sonarlog.metrics import PathErrors
from sonarlog.runs import Run
from sonarlog.scores import Scores, score

PATH = {
    "ate": ("ate_m", "position, RMS", "m"),
    "ate_aligned": ("ate_aligned_m", "position, RMS, best alignment", "m"),
    "heading": ("heading_rmse_deg", "heading, RMS", "°"),
    "end": ("end_m", "position at the end", "m"),
}
MAP = {
    "map.occupied_true": ("occupied_true", "occupied cells at a true surface", "%"),
    "map.surface_mapped": ("surface_mapped", "true surface that is mapped", "%"),
    "map.free_true": ("free_true", "free cells truly free", "%"),
}
ALIKE = 1e-3
"""Errors within a millimetre or a thousandth of a degree, and shares within a thousandth, are told as equal."""


@dataclass(frozen=True)
class TruthMetric:
    """One metric of both runs, with its name, its label and its unit; `nearer` is "A", "B" or "" for no difference."""

    name: str
    label: str
    unit: str
    a: float
    b: float
    nearer: str

    def mirrored(self) -> "TruthMetric":
        """From B to A."""
        return TruthMetric(self.name, self.label, self.unit, self.b, self.a, _other(self.nearer))


@dataclass(frozen=True)
class Truth:
    """Errors of both paths, every metric of path and map, and which is `nearer` by position: "A", "B" or ""."""

    a: PathErrors
    b: PathErrors
    nearer: str
    metrics: tuple[TruthMetric, ...]

    def mirrored(self) -> "Truth":
        """From B to A."""
        return Truth(self.b, self.a, _other(self.nearer), tuple(metric.mirrored() for metric in self.metrics))


def truth_of(a: Run, b: Run) -> Truth | None:
    """Both runs against the truth; None unless it is known at every sweep of both."""
    mine = score(a)
    yours = mine if a is b else score(b)
    if mine is None or yours is None:
        return None
    metrics = (*_path_metrics(mine, yours), *_map_metrics(mine, yours))
    return Truth(mine.path, yours.path, metrics[0].nearer, metrics)


def _path_metrics(a: Scores, b: Scores) -> list[TruthMetric]:
    rows = []
    for name, (key, label, unit) in PATH.items():
        mine, yours = float(getattr(a.path, key)), float(getattr(b.path, key))
        rows.append(TruthMetric(name, label, unit, mine, yours, _nearer(mine, yours)))
    return rows


def _map_metrics(a: Scores, b: Scores) -> list[TruthMetric]:
    rows = []
    for name, (key, label, unit) in MAP.items():
        mine, yours = getattr(a.map, key, None), getattr(b.map, key, None)
        if mine is not None and yours is not None:
            rows.append(TruthMetric(name, label, unit, 100 * mine, 100 * yours, _nearer(-mine, -yours)))
    return rows


def _nearer(a: float, b: float) -> str:
    """Which error is the smaller."""
    return "" if abs(a - b) < ALIKE else "B" if a > b else "A"


def _other(side: str) -> str:
    return {"A": "B", "B": "A"}.get(side, "")
