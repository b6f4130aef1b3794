"""A difference in words: what a person can act on, before any table. Must not know: how differences are found."""

import re
from typing import TYPE_CHECKING

from sonarlog.words import counted

if TYPE_CHECKING:
    from sonarlog.diff.first import FirstDifference
    from sonarlog.diff.report import Report

TOLD = 3
"""So many walls are named; of the others only the number is."""
PATH_M = 0.001
_BRACKETS = re.compile(r" \(d1[^()]*\)")


def headline(report: "Report") -> str:
    """The whole difference in a few sentences."""
    if report.first is None:
        made = f", though made with different {listed(list(report.settings))}" if report.settings else ""
        sweeps = "the one sweep" if report.sweeps[0] == 1 else f"all {report.sweeps[0]} sweeps"
        return f"The same: {sweeps} and the map are identical to the bit{made}."
    told = " ".join([_parting(report.first), *_chaining(report), *_goal(report), *_maps(report), *_nearer(report)])
    if report.tolerance is not None and report.within:
        return f"The same within {report.tolerance.words}, though not identical. {told}"
    return told


def listed(names: list[str]) -> str:
    """`a, b and c`."""
    return ", ".join(names[:-1]) + (" and " if len(names) > 1 else "") + names[-1]


def _parting(first: "FirstDifference") -> str:
    where = "Different from the first sweep on" if first.sweep == 0 else f"Same until sweep {first.sweep}"
    # The numbers behind a decision stand below; here they are in the way.
    decision = _BRACKETS.sub("", first.words)
    if len(decision) > 160:
        decision = decision[:157].rsplit(" ", 1)[0] + " …"
    return f"{where}; there {first.name} (block {first.block}) differs ({decision})."


def _chaining(report: "Report") -> list[str]:
    """Which wall goes where, unless that is how they part."""
    first, found = report.first, report.chaining
    if first is None or found is None or (first.block == "E" and first.decisions == found.decisions):
        return []
    a, b = (_BRACKETS.sub("", said) for said in found.decisions)
    return [f"Walls are chained otherwise from sweep {found.sweep} on (A: {a}; B: {b})."]


def _goal(report: "Report") -> list[str]:
    """Of an exploration: where it would have gone elsewhere first."""
    if report.goal is None:
        return []
    a, b = report.goal.decisions
    return [f"Decision {report.goal.sweep} would have been the first to differ (A: {a}; B: {b})."]


def _maps(report: "Report") -> list[str]:
    """Alignment first: what it explains is not told again."""
    path, walls = report.path, _walls(report)
    if report.alignment.none:
        changed = f"{100 * report.cells.changed:.1f} % of the known cells changed"
        if path.largest_m < PATH_M:
            return [f"The paths are the same within a millimetre; {changed}.", f"{_capital(walls)}."]
        apart = f"The paths are up to {path.largest_m:.2f} m apart (sweep {path.sweep}), {path.mean_m:.2f} m on average"
        return [f"{apart}; {changed}.", f"{_capital(walls)}."]
    left = f"the paths are up to {path.aligned_largest_m:.2f} m apart"
    if path.aligned_largest_m < 0.01:
        left = "the paths are the same within a centimetre"
    changed = f"{100 * report.aligned_cells.changed:.1f} % of the known cells changed"
    shifted = report.alignment.words or "shifted by less than a centimetre"
    return [f"B's map is {shifted}; without that, {left}, {changed}, and {walls}."]


def _walls(report: "Report") -> str:
    changed = report.changed_walls
    if not changed:
        count = len(report.walls)
        return (
            f"all {count} walls are the same"
            if count > 1
            else "the one wall is the same"
            if count
            else "no wall is known"
        )
    more = len(changed) - TOLD
    told = [change.words for change in changed[:TOLD]]
    return "; ".join(told) + (f"; {counted(more, 'more wall')} changed" if more > 0 else "")


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _nearer(report: "Report") -> list[str]:
    """Which is nearer to the truth, and by how much of the other's error; nothing where no truth is known."""
    truth = report.truth
    if truth is None:
        return []
    if not truth.nearer:
        return [f"Both are as near to the truth ({truth.a.ate_m:.2f} m RMS)."]
    near, far = (truth.a, truth.b) if truth.nearer == "A" else (truth.b, truth.a)
    name = report.names[0 if truth.nearer == "A" else 1]
    part = 100 * (1 - near.ate_m / far.ate_m)
    digits = 2 if round(near.ate_m, 2) < round(far.ate_m, 2) else 3
    errors = f"{near.ate_m:.{digits}f} m RMS instead of {far.ate_m:.{digits}f} m"
    return [f"{truth.nearer} ({name}) is nearer to the truth by {part:.0f} %: {errors}."]
