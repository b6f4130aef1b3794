"""A difference in words: what a person can act on, before any table. Must not know: how differences are found."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from sonarlog.words import block_lines, wall_line

if TYPE_CHECKING:
    from sonarlog.diff import Diff, FirstDifference


def headline(diff: "Diff") -> str:
    """The whole difference in a sentence or two."""
    if diff.first is None:
        made = f", though made with different {_listed(list(diff.settings))}" if diff.settings else ""
        return f"The same: all {diff.sweeps[0]} sweeps and the map are identical to the bit{made}."
    return " ".join([_parting(diff.first), _apart(diff), *_nearer(diff)])


def decision_words(block: str, a: Mapping[str, Any], b: Mapping[str, Any], names: tuple[str, str] = ("A", "B")) -> str:
    """What a block made of one sweep in A and in B, where they differ; `a` and `b` are the steps' plain values."""
    this, that = names
    if block == "E":
        for k, (mine, yours) in enumerate(zip(a["walls"], b["walls"], strict=False)):
            if (mine["chain"], mine["joined"]) != (yours["chain"], yours["joined"]):
                return f"{this}: {wall_line(k, mine)}; {that}: {wall_line(k, yours)}"
    mine, yours = block_lines(a)[block], block_lines(b)[block]
    if mine == yours:
        return f"in both {mine}; what differs is not in this line"
    return f"{this}: {mine}; {that}: {yours}"


def _parting(first: "FirstDifference") -> str:
    where = "Different from the first sweep on" if first.sweep == 0 else f"Same until sweep {first.sweep}"
    return f"{where}; there {first.name} (block {first.block}) differs."


def _apart(diff: "Diff") -> str:
    path, changed = diff.path, 100 * diff.cells.changed
    if path.largest_m < 0.001:
        walked = "The paths are the same within a millimetre"
    else:
        walked = (
            f"The paths are up to {path.largest_m:.2f} m apart (sweep {path.sweep}), {path.mean_m:.2f} m on average"
        )
    return f"{walked}; {changed:.1f} % of the known cells changed."


def _nearer(diff: "Diff") -> list[str]:
    """Which is nearer to the truth, and by how much of the other's error; nothing where no truth is known."""
    truth = diff.truth
    if truth is None:
        return []
    if not truth.nearer:
        return [f"Both are as near to the truth ({truth.a.ate_m:.2f} m RMS)."]
    near, far = (truth.a, truth.b) if truth.nearer == "A" else (truth.b, truth.a)
    name = diff.names[0 if truth.nearer == "A" else 1]
    part = 100 * (1 - near.ate_m / far.ate_m)
    return [
        f"{truth.nearer} ({name}) is nearer to the truth by {part:.0f} %: "
        f"{near.ate_m:.2f} m RMS instead of {far.ate_m:.2f} m."
    ]


def _listed(names: list[str]) -> str:
    return ", ".join(names[:-1]) + (" and " if len(names) > 1 else "") + names[-1]
