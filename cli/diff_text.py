"""What `sonarlog diff` says on stdout: the headline, a line a level, then the tables.

Words carry every meaning; colours only repeat it, and there are none where stdout is no terminal.
"""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from sonarlog.words import counted

if TYPE_CHECKING:
    from sonarlog.diff import BlockTime, Report
    from sonarlog.diff.outcome import Outcome

COLOURS = {"same": "cyan", "within": "cyan", "changed": "yellow", "failed": "magenta"}
"""Blue-green and orange stay apart for every eye; red and green would not."""
WALLS, CALIBRATION = 12, 4
PLAIN_WIDTH = 200


def _coloured(text: str, colour: str) -> None:
    """In that colour on a terminal, unless the user wants none (https://no-color.org)."""
    click.secho(text, fg=None if os.environ.get("NO_COLOR") else colour)


def tell(outcome: "Outcome", *, verbose: bool = False) -> None:
    """One comparison, headline first; times only where they say something, or asked for."""
    report = outcome.report
    if report is None:
        _coloured(f"Failed: {outcome.failed}", COLOURS["failed"])
        return
    _coloured(report.headline, COLOURS[report.verdict])
    if report.first is not None:
        click.echo(f"\nA is {report.names[0]}, B is {report.names[1]}.")
        click.echo(
            f"Sweep {report.first.sweep}, {report.first.name} (block {report.first.block}): {report.first.words}."
        )
        table(("", "A", "B", "difference"), _levels(report))
        _cells(report)
        if report.changed_walls:
            shown = report.changed_walls[:WALLS]
            table(("walls that changed",), [(change.words,) for change in shown])
            if len(report.changed_walls) > WALLS:
                click.echo(f"… and {len(report.changed_walls) - WALLS} more walls (--json lists all)")
        for key, (mine, yours) in report.settings.items():
            click.echo(f"{key}: {mine} in A, {yours} in B")
    _times(report, verbose=verbose)
    for reason in outcome.reasons:
        _coloured(f"Not kept: {reason}", COLOURS["failed"])


def _times(report: "Report", *, verbose: bool) -> None:
    """What a sweep takes."""
    from sonarlog.times import short

    times = report.times
    if times is None:
        if verbose:
            click.echo("Times: not both runs keep what their blocks took.")
        return
    if verbose or times.telling:
        shown = times.rows if verbose else dict.fromkeys((*times.telling, times.whole))
        rows = [(f"{row.block} {row.name}".strip(), short(row.a_ms), short(row.b_ms), _ratio(row)) for row in shown]
        table(("ms a sweep", "A", "B", "ratio"), rows)
        click.echo(f"Times: {times.words}.")


def _times_in_short(report: "Report | None") -> None:
    """A line, where they say something."""
    times = report.times if report else None
    if times is not None and times.telling:
        rows = ", ".join(f"{row.block or row.name} {_ratio(row)}" for row in times.telling)
        click.echo(f"  Times: {rows}; {times.words}")


def _ratio(row: "BlockTime") -> str:
    return "–" if row.ratio is None else f"× {row.ratio:.2f}"


def tell_many(outcomes: "Sequence[Outcome]") -> None:
    """The sum, a table with a line a recording, then the details of those that are not the same."""
    from sonarlog.diff.outcome import summary

    click.echo(summary(outcomes))
    head = ("recording", "result", "first difference", "path", "cells", "walls", "RMS off the truth")
    table(head, [(outcome.name, outcome.verdict, *_line(outcome)) for outcome in outcomes])
    for outcome in outcomes:
        if outcome.verdict in ("changed", "within", "failed"):
            click.echo(outcome.name)
            said = outcome.report.headline if outcome.report else f"Failed: {outcome.failed}"
            click.echo(f"  {said}")
            _times_in_short(outcome.report)
            for reason in outcome.reasons:
                _coloured(f"  Not kept: {reason}", COLOURS["failed"])


def _line(outcome: "Outcome") -> tuple[str, ...]:
    report = outcome.report
    if report is None:
        return ("–",) * 5
    first = "–" if report.first is None else f"sweep {report.first.sweep}, {report.first.name} ({report.first.block})"
    truth = "–" if report.truth is None else f"{report.truth.a.ate_m:.3f} → {report.truth.b.ate_m:.3f} m"
    cells, walls = f"{100 * report.cells.changed:.1f} %", f"{len(report.changed_walls)} of {len(report.walls)}"
    return first, f"{report.path.largest_m:.3f} m", cells, walls, truth


def _levels(report: "Report") -> list[tuple[str, ...]]:
    """A line a level."""
    path, rooms, none = report.path, report.rooms, ""
    aligned = none if report.alignment.none else f", {100 * report.aligned_cells.changed:.1f} % once aligned"
    left = none if report.alignment.none else f", {path.aligned_largest_m:.3f} m once aligned"
    walls = [f"{counted(n, 'wall')}" for n in (len(report.a.walls), len(report.b.walls))]
    rows: list[tuple[str, ...]] = [
        ("alignment", none, none, report.alignment.words or "none needed"),
        ("cells", none, none, f"{100 * report.cells.changed:.1f} % changed{aligned}"),
        ("walls", *walls, _kinds(report)),
        ("free area", f"{rooms.free_m2[0]:.1f} m²", f"{rooms.free_m2[1]:.1f} m²", _rooms(report)),
        ("path", *(f"{n} sweeps" for n in report.sweeps), f"up to {path.largest_m:.3f} m (sweep {path.sweep}){left}"),
    ]
    known = [(f"calibration, {change.name}", _number(change.a), _number(change.b)) for change in report.calibration]
    rows += [(*row, none) for row in [row for row in known if row[1] != row[2]][:CALIBRATION]]
    if report.truth is not None:
        for metric in report.truth.metrics:
            nearer = f"{metric.nearer} is nearer" if metric.nearer else "as near"
            mine, yours = (f"{value:.2f} {metric.unit}" for value in (metric.a, metric.b))
            rows.append((f"off the truth: {metric.label}" if metric.unit != "%" else metric.label, mine, yours, nearer))
    return rows


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.5f}"


def _kinds(report: "Report") -> str:
    """`9 the same, 1 moved, 2 gone`."""
    from sonarlog.diff.matching import KINDS

    counts = [(sum(not change.kinds for change in report.walls), "the same")]
    words = {kind: kind for kind in KINDS} | {"single": "single again"}
    counts += [(sum(kind in change.kinds for change in report.walls), words[kind]) for kind in KINDS]
    return ", ".join(f"{count} {kind}" for count, kind in counts if count) or "none"


def _rooms(report: "Report") -> str:
    changed = [change.words for change in report.rooms.changes if change.kind]
    return "; ".join(changed[:3]) or f"{counted(report.rooms.rooms[0], 'connected area')} in both"


def _cells(report: "Report") -> None:
    names = ("unknown", "free", "occupied")
    tables = [("cells", report.cells.table)]
    if not report.alignment.none:
        tables.append(("cells once aligned", report.aligned_cells.table))
    for title, counts in tables:
        rows = [(f"A {name}", *map(str, row)) for name, row in zip(names, counts, strict=True)]
        table((title, *(f"B {name}" for name in names)), rows)


def table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> None:
    """Names to the left, numbers to the right; as wide as it must be where stdout is no terminal."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD)
    numbers = all(row[1:] and all(cell.isdecimal() for cell in row[1:]) for row in rows)
    for k, title in enumerate(head):
        made.add_column(title, justify="right" if k and numbers else "left")
    for row in rows:
        made.add_row(*row)
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=PLAIN_WIDTH)
    console.print(made)
