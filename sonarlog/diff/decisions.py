"""What a block decided in A and in B, in words, from the values that both sides keep of it.

Must not know: how the first difference was found, printing.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from sonarlog.apart import Apart
from sonarlog.words import block_lines, counted, pose, wall_line

Values = Mapping[str, Any]
Said = tuple[str, str]
Teller = Callable[[Any, Any], Said | None]
NATURES = ("a wall or a point", "a wall", "a point")


def decided(
    block: str, steps: tuple[Values, Values], outputs: tuple[Any, Any], found: tuple[Apart, ...], cell_m: float
) -> Said:
    """What the block made of the sweep in A and in B, where they differ.

    `steps` are the steps' plain values, `outputs` the block's canonical values in plain terms (None where a run keeps
    none), `found` what differs in these; `cell_m` is the size of the map's cells. Runs of two versions of the code may
    have other values: then by name.
    """
    tellers: list[tuple[Teller, tuple[Any, Any]]] = []
    if block in _OF_STEPS:
        tellers.append((_OF_STEPS[block], steps))
    if block in _TOLD and outputs[0] is not None and outputs[1] is not None:
        tellers.append((_TOLD[block], outputs))
    if block == "H" and outputs[0] is not None and outputs[1] is not None:
        tellers.append((lambda a, b: _evidence(a, b, cell_m), outputs))
    if block == "E":
        tellers.append((_distances, steps))
    tellers.append((lambda a, b: _lines(block, a, b), steps))
    for tell, values in tellers:
        try:
            said = tell(*values)
        except (KeyError, TypeError, IndexError, ValueError, AttributeError):
            continue
        if said is not None:
            return said
    return _values(found)


def _lines(block: str, a: Values, b: Values) -> Said | None:
    mine, yours = (block_lines(step)[block] for step in (a, b))
    return (mine, yours) if mine != yours else None


def _values(found: tuple[Apart, ...]) -> Said:
    """By name and number, where no words fit."""
    if not found:
        return ("has other values", "has other values")
    alike = [each for each in found if type(each.a) is type(each.b)]
    first, more = (alike or found)[0], len(found) - 1
    rest = f" (and {counted(more, 'value')} more)" if more else ""
    if not alike:  # results of two kinds, as different algorithms have them
        return _given(first.where, first.a, rest), _given(first.where, first.b, "")
    return f"{first.where} is {first.a!r}{rest}", f"{first.where} is {first.b!r}"


def _given(where: str, value: Any, rest: str) -> str:
    return f"gives {'no ' if value is None else ''}{where}{rest}"


def _readings(a: Values, b: Values) -> Said | None:
    """A: which readings only one has."""
    names = ("t_ns", "sonar", "range_mm")
    mine, yours = (dict.fromkeys(zip(*(each[name].tolist() for name in names), strict=True)) for each in (a, b))
    only_a, only_b = [row for row in mine if row not in yours], [row for row in yours if row not in mine]
    if not only_a and not only_b:
        return None
    return _has(len(mine), only_a), _has(len(yours), only_b)


def _has(count: int, only: list[tuple[int, ...]]) -> str:
    if not only:
        return f"has {counted(count, 'reading')}, none of its own"
    t_ns, sonar, mm = only[0]
    more = f" and {len(only) - 1} more" if len(only) > 1 else ""
    return f"has {counted(count, 'reading')}, alone that of sonar {sonar} at {t_ns / 1e9:.2f} s ({mm} mm){more}"


def _predicted(a: Values, b: Values) -> Said | None:
    """B: where each takes the robot to be, if they think the same of it otherwise."""
    mine, yours = (f"predicts {pose(each['predicted'])}" for each in (a, b))
    return (mine, yours) if a["calibration"] == b["calibration"] and mine != yours else None


def _rcds(a: Values, b: Values) -> Said | None:
    """C: the first RCD that the other does not see so."""
    mine, yours = ([_rcd(rcd) for rcd in each["rcds"]] for each in (a, b))
    return _lists(mine, yours, "RCD")


def _rcd(rcd: Values) -> str:
    strength = "strong" if rcd["strong"] else "weak"
    return f"at {np.degrees(rcd['bearing']):.1f}°, {rcd['distance']:.3f} m, {strength}, of {rcd['sonars']} sonars"


def _features(a: Values, b: Values) -> Said | None:
    """D: the first RCD that is a wall to the one and something else to the other."""
    mine, yours = ({**_kinds(each)} for each in (a, b))
    for rcd in sorted(mine | yours):
        if mine.get(rcd) != yours.get(rcd):
            one, other = (f"takes RCD {rcd} for {each.get(rcd, 'nothing')}" for each in (mine, yours))
            return one, other
    return None


def _kinds(features: Values) -> dict[int, str]:
    walls = {wall["rcd"]: "a wall" for wall in features["walls"]}
    corners = {corner["rcd"]: "a corner" for corner in features["corners"]}
    return {**walls, **corners, **dict.fromkeys(features["narrow"], "a narrow thing")}


def chained(a: Values, b: Values) -> Said | None:
    """E: the first wall of a sweep that joins another chain, or none; of steps' plain values. None if none does."""
    for k, (mine, yours) in enumerate(zip(a["walls"], b["walls"], strict=False)):
        if (mine["chain"], mine["joined"] is None) != (yours["chain"], yours["joined"] is None):
            return wall_line(k, mine), wall_line(k, yours)
    return None


def _natures(a: Values, b: Values) -> Said | None:
    """E: the first wall whose nature is told otherwise."""
    mine, yours = ({link["wall"]: link for link in each.get("links", ())} for each in (a, b))
    for wall in sorted(set(mine) & set(yours)):
        one, other = (links[wall].get("nature", 0) for links in (mine, yours))
        if one != other:
            return f"takes wall {wall} for {_nature(one)}", f"takes wall {wall} for {_nature(other)}"
    return None


def _distances(a: Values, b: Values) -> Said | None:
    """E: the first wall that lies otherwise to the chain which it joins in both."""
    for k, (mine, yours) in enumerate(zip(a["walls"], b["walls"], strict=False)):
        if None not in (mine["joined"], yours["joined"]) and _distance(k, mine) != _distance(k, yours):
            return _distance(k, mine), _distance(k, yours)
    return None


def _distance(number: int, wall: Values) -> str:
    off = f"d1 {100 * wall['d1']:.1f} cm, a1 {np.degrees(wall['a1']):.1f}°"
    return f"finds wall {number} off chain {wall['chain']} by {off}"


def _nature(number: int) -> str:
    return NATURES[number] if 0 <= number < len(NATURES) else f"nature {number}"


def _merged(a: Values, b: Values) -> Said | None:
    """F: which chains turned out to be one."""
    mine, yours = (_pairs(each["merged"]) for each in (a, b))
    return (mine, yours) if mine != yours else None


def _pairs(merged: list[list[int]]) -> str:
    found = ", ".join(f"chain {gone} is chain {kept}" for kept, gone in merged)
    return f"finds that {found}" if found else "merges no chains"


def _evidence(a: Values, b: Values, cell_m: float) -> Said | None:
    """H: how many cells get other evidence, and where it differs most."""
    left, bottom = (min(each[key] for each in (a, b)) for key in ("left", "bottom"))
    right = max(each["left"] + each["delta"].shape[1] for each in (a, b))
    top = max(each["bottom"] + each["delta"].shape[0] for each in (a, b))
    laid = []
    for each in (a, b):
        whole = np.zeros((top - bottom, right - left), dtype=np.int64)
        (rows, columns), y, x = each["delta"].shape, each["bottom"] - bottom, each["left"] - left
        whole[y : y + rows, x : x + columns] = each["delta"]
        laid.append(whole)
    off = np.abs(laid[0] - laid[1])
    count = int(np.count_nonzero(off))
    if not count:
        return None
    row, column = (int(k) for k in np.unravel_index(int(np.argmax(off)), off.shape))
    cells = f"one of {counted(count, 'cell')} that differ" if count > 1 else "the one cell that differs"
    x, y = (cell_m * (k + 0.5) for k in (left + column, bottom + row))
    mine, yours = (f"adds {int(whole[row, column]):+d} at ({x:.2f}, {y:.2f}) m, {cells}" for whole in laid)
    return mine, yours


def _goals(a: Values, b: Values) -> Said | None:
    """I: the frontier that each goes to."""
    mine, yours = (_goal(each) for each in (a, b))
    return (mine, yours) if mine != yours else None


def _goal(decision: Values) -> str:
    if decision["chosen"] is None:
        return "has nowhere to go"
    region = decision["regions"][decision["chosen"]]
    x, y = region["centre"]
    return f"goes to the frontier of {region['cells']} cells at ({x:.2f}, {y:.2f}) m"


def _lists(mine: list[str], yours: list[str], noun: str) -> Said | None:
    only_a, only_b = _only(mine, yours), _only(yours, mine)
    if only_a is None and only_b is None:
        return None
    return _sees(len(mine), noun, only_a), _sees(len(yours), noun, only_b)


def _only(these: list[str], others: Iterable[str]) -> str | None:
    known = set(others)
    return next((each for each in these if each not in known), None)


def _sees(count: int, noun: str, only: str | None) -> str:
    return f"sees {counted(count, noun)}{f', alone one {only}' if only else ', none of its own'}"


_OF_STEPS: dict[str, Teller] = {"B": _predicted, "E": chained}
_TOLD: dict[str, Teller] = {
    "A": _readings,
    "C": _rcds,
    "D": _features,
    "E": _natures,
    "F": _merged,
    "I": _goals,
}
