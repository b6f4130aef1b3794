"""The tables of a bench as rows of text: plain conditions place by place, the others as one row each, what broke.

Must not know: terminals, Markdown, HTML (who shows a table says how).
"""

from dataclasses import dataclass

from sonarlog.bench.conditions import CONDITIONS, PLAIN
from sonarlog.bench.results import Group, Results, Spread

NONE = "–"
PERFECT, PERFECT_M = "perfect", 0.05
"""There raw odometry errs by nothing, and no ratio to it makes sense; a path is not to be worse than so many metres."""
NO_WORSE = 1.001
"""Of raw odometry: it is not worse than itself for the rounding of a frame."""


@dataclass(frozen=True)
class Table:
    """A title, what the columns are, and the rows; the first `names` columns are names, the others numbers."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    names: int


def tables(results: Results) -> list[Table]:
    """Those that have rows."""
    places = [_places(results, condition) for condition in results.plan.conditions[:1]]
    return [table for table in (*places, _maps(results), _conditions(results)) if table.rows]


def broken(results: Results) -> list[str]:
    """In sentences: who came out worse than raw odometry, where and how often; and who came out with nothing."""
    sentences = []
    for group in results.groups:
        where = f"`{group.label}` in {group.place}, {group.condition}"
        if sentence := _off(group):
            sentences.append(f"{where}: {sentence}")
        errors = [row for row in group.rows if row.measures is None]
        if errors:
            example = f"{case_words((errors[0].case.world, errors[0].case.seed), group)}: {errors[0].error}"
            sentences.append(f"{where}: {len(errors)} of {len(group.rows)} failed, such as {example}")
    return sentences


def _off(group: Group) -> str:
    """How many paths are worse than raw odometry's; where that is perfect, how many are off by more than 5 cm."""
    perfect = group.condition == PERFECT
    name, limit = ("ate_m", PERFECT_M) if perfect else ("ate_m_ratio", NO_WORSE)
    count = group.beyond(name, limit)
    if not count:
        return ""
    spread = group.spreads[name]
    case = case_words((spread.worst_case.world, spread.worst_case.seed), group)
    if perfect:
        return f"{count} of {len(group.rows)} more than 5 cm off, the worst {100 * spread.worst:.1f} cm ({case})"
    return f"{count} of {len(group.rows)} worse than raw odometry, the worst {spread.worst:.2f} × ({case})"


def case_words(case: tuple[str, int], group: Group) -> str:
    """`seed 7`, with the world where that does not go without saying."""
    world, seed = case
    return f"seed {seed}" if world == group.place else f"{world}, seed {seed}"


def _places(results: Results, condition: str) -> Table:
    """How far off the path is, place by place."""
    head = ("place", "algorithm", "runs", "ATE, m", "quartiles", "of raw odometry", "quartiles", "worst", "heading, °",
            "of raw odometry", "ms a sweep")  # fmt: skip
    rows = []
    for group in _ordered(results, condition):
        s = group.spreads
        rows.append(
            (
                group.place,
                group.label,
                _runs(group),
                _number(s.get("ate_m"), "{:.3f}"),
                _quartiles(s.get("ate_m"), "{:.2f}"),
                _number(s.get("ate_m_ratio"), "{:.2f}"),
                _quartiles(s.get("ate_m_ratio"), "{:.2f}"),
                f"{s['ate_m_ratio'].worst:.2f}" if "ate_m_ratio" in s else NONE,
                _number(s.get("heading_rmse_deg"), "{:.2f}"),
                _number(s.get("heading_rmse_deg_ratio"), "{:.2f}"),
                _number(s.get("ms_per_sweep"), "{:.1f}"),
            )
        )
    return Table(f"Path, {condition}: {CONDITIONS[condition].about}", head, tuple(rows), names=2)


def _maps(results: Results) -> Table:
    """How true the maps are, under the first condition."""
    condition = results.plan.conditions[0]
    head = ("place", "algorithm", "occupied true, %", "worst", "surface mapped, %", "worst", "free true, %", "worst",
            "long walls bent by, cm", "worst")  # fmt: skip
    rows = []
    for group in _ordered(results, condition):
        cells = [group.place, group.label]
        for name, scale in (("occupied_true", 100), ("surface_mapped", 100), ("free_true", 100), ("bent_m", 100)):
            spread = group.spreads.get(name)
            cells += [f"{scale * spread.median:.0f}", f"{scale * spread.worst:.0f}"] if spread else [NONE, NONE]
        rows.append(tuple(cells))
    return Table(f"Map, {condition}", head, tuple(rows), names=2)


def _conditions(results: Results) -> Table:
    """Ratio to raw odometry under every other condition, one column a place: median, and the worst in parentheses."""
    head = ("condition", "algorithm", *results.places)
    rows = []
    for condition in results.plan.conditions[1:]:
        for label in results.labels:
            groups = [results.group(place, condition, label) for place in results.places]
            if any(groups):
                rows.append((condition, label, *(_ratio(condition, group) for group in groups)))
    return Table("ATE under other conditions, of raw odometry's: median (worst)", head, tuple(rows), names=2)


def _ordered(results: Results, condition: str) -> list[Group]:
    found = [results.group(place, condition, label) for place in results.places for label in results.labels]
    return [group for group in found if group is not None]


def _ratio(condition: str, group: Group | None) -> str:
    if group is None:
        return NONE
    failed = f", {group.failed} failed" if group.failed else ""
    if "ate_m_ratio" in group.spreads and condition != PERFECT:
        spread = group.spreads["ate_m_ratio"]
        return f"{spread.median:.2f} ({spread.worst:.2f}{failed})"
    if "ate_m" in group.spreads:  # raw odometry errs by nothing: there is no ratio to it
        spread = group.spreads["ate_m"]
        return f"{100 * spread.median:.1f} cm ({100 * spread.worst:.1f}{failed})"
    return f"all {group.failed} failed"


def _runs(group: Group) -> str:
    return f"{len(group.rows)}, {group.failed} failed" if group.failed else str(len(group.rows))


def _number(spread: Spread | None, form: str) -> str:
    return form.format(spread.median) if spread else NONE


def _quartiles(spread: Spread | None, form: str) -> str:
    return f"{form.format(spread.low)}–{form.format(spread.high)}" if spread else NONE


def legend() -> list[str]:
    """What the columns mean."""
    return [
        "Medians over the runs (seeds, or random places and seeds). ATE and heading: root mean square over the sweeps, "
        "path and truth laid on one another at the first sweep only; *of raw odometry*: over that of raw odometry in "
        "the same recording, 1 being no better.",
        "*occupied true*: share of occupied cells within 10 cm of a true surface. *surface mapped*: share of the "
        "surface in sight (3 m) with an occupied cell within 10 cm. *free true*: share of free cells that are free. "
        "*long walls bent by*: the largest distance of a mapped piece of a true wall of 5 m or more from the best line "
        "through all its pieces.",
        "*ms a sweep*: processor time of the whole replay, reading and writing included.",
    ]


def condition_lines(results: Results) -> list[tuple[str, str]]:
    """Name and meaning of every condition of the plan but the plain one."""
    return [(name, CONDITIONS[name].about) for name in results.plan.conditions if name != PLAIN.name]
