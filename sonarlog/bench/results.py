"""What came of a bench: a row for every replay, and over the seeds medians, quartiles and the worst.

Must not know: how rows are made or shown.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sonarlog.bench.plan import Case, Plan
from sonarlog.bench.work import Measures, Outcome

_SHARES = ("occupied_true", "surface_mapped", "free_true")
MORE_IS_BETTER = (*_SHARES, *(f"aligned_{name}" for name in _SHARES))


@dataclass(frozen=True)
class Row:
    """One replay of one case; `label` says by whom. Either measures, or the sentence that says why there are none."""

    case: Case
    label: str
    measures: Measures | None
    error: str = ""

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        where = {"world": self.case.world, "seed": self.case.seed, "condition": self.case.condition}
        return {**where, "algorithm": self.label, "measures": self.measures, "error": self.error or None}


@dataclass(frozen=True)
class Spread:
    """Of one measure over the seeds: median, quartiles, the worst, and whose that is."""

    median: float
    low: float
    high: float
    worst: float
    worst_case: Case


@dataclass(frozen=True)
class Group:
    """The rows of one place, condition and contender, and the spread of every measure that any of them has."""

    place: str
    condition: str
    label: str
    rows: tuple[Row, ...]
    spreads: dict[str, Spread]

    @property
    def failed(self) -> int:
        """How many have no measures."""
        return sum(row.measures is None for row in self.rows)

    def beyond(self, name: str, limit: float) -> int:
        """How many have more than that of a measure."""
        return sum(row.measures is not None and row.measures.get(name, 0.0) > limit for row in self.rows)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        spreads = {
            name: {"median": s.median, "quartiles": [s.low, s.high], "worst": s.worst,
                   "worst_of": {"world": s.worst_case.world, "seed": s.worst_case.seed}}
            for name, s in self.spreads.items()
        }  # fmt: skip
        where = {"place": self.place, "condition": self.condition, "algorithm": self.label}
        return {**where, "replays": len(self.rows), "failed": self.failed, "measures": spreads}


@dataclass(frozen=True)
class Results:
    """All rows, in the plan's order, and the groups in that of the tables."""

    plan: Plan
    rows: tuple[Row, ...]
    groups: tuple[Group, ...]

    def group(self, place: str, condition: str, label: str) -> Group | None:
        """That group, if it has rows."""
        key = (place, condition, label)
        return next((g for g in self.groups if (g.place, g.condition, g.label) == key), None)

    @property
    def places(self) -> list[str]:
        """In the order of the plan; random places are one."""
        return list(dict.fromkeys(case.place for case in self.plan.cases()))

    @property
    def labels(self) -> list[str]:
        """The contenders' labels, in the order of the plan."""
        return [contender.label for contender in self.plan.contenders]


def results_of(plan: Plan, found: Iterable[tuple[Case, Sequence[Outcome]]]) -> Results:
    """Put in order what was found of each case."""
    outcomes = {(case, outcome.label): outcome for case, several in found for outcome in several}
    rows = [
        Row(case, contender.label, outcome.measures, outcome.error)
        for case in plan.cases()
        for contender in plan.contenders
        if (outcome := outcomes.get((case, contender.label))) is not None
    ]
    together: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        together.setdefault((row.case.place, row.case.condition, row.label), []).append(row)
    groups = [Group(*key, tuple(members), _spreads(members)) for key, members in together.items()]
    return Results(plan, tuple(rows), tuple(groups))


def _spreads(rows: Sequence[Row]) -> dict[str, Spread]:
    names = dict.fromkeys(name for row in rows for name in row.measures or {})
    return {name: _spread(name, rows) for name in names}


def _spread(name: str, rows: Sequence[Row]) -> Spread:
    known = [(row.measures[name], row.case) for row in rows if row.measures and name in row.measures]
    values = [value for value, _ in known]
    low, median, high = np.quantile(values, (0.25, 0.5, 0.75)).tolist()
    pick = min if name in MORE_IS_BETTER else max
    worst, case = pick(known, key=lambda pair: pair[0])
    return Spread(median, low, high, worst, case)
