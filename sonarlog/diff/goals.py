"""Of an exploration replayed in two ways: the first decision that would have led elsewhere.

What the robot saw after it is as it was recorded, whatever would have been decided. Must not know: printing.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sonarlog.runs import Run

ELSEWHERE_M = 0.3
"""Two scans further apart than this are at two places."""

EXPLORED = "decisions"
"""A run of an exploration counts them."""


@dataclass(frozen=True)
class OtherGoal:
    """The sweep after which A and B would not have gone to the same place, and where each would have gone."""

    sweep: int
    decisions: tuple[str, str]


def first_goal(a: Run, b: Run) -> OtherGoal | None:
    """The first decision that differs; None where none does, and for recordings that are of no exploration."""
    if not a.counts.get(EXPLORED) or not b.counts.get(EXPLORED):
        return None
    for mine, yours in zip(a.sweeps, b.sweeps, strict=False):
        ends = _end(mine.data), _end(yours.data)
        if _elsewhere(*ends):
            return OtherGoal(mine.index, (_words(ends[0]), _words(ends[1])))
    return None


def _end(data: Mapping[str, Any]) -> tuple[float, float] | None:
    """Where the way of a step's decision leads."""
    path = data["decision"]["path"]
    return (path[-1][0], path[-1][1]) if path else None


def _elsewhere(a: tuple[float, float] | None, b: tuple[float, float] | None) -> bool:
    if a is None or b is None:
        return (a is None) != (b is None)
    return bool((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 > ELSEWHERE_M**2)


def _words(end: tuple[float, float] | None) -> str:
    return "ends there" if end is None else f"goes to ({end[0]:.2f}, {end[1]:.2f}) m"
