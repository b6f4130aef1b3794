"""The page's words and tables, as HTML. Must not know: how differences are found, what the script draws."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from sonarlog.diff import FirstDifference, Report, Side, TimeChanges, WallChange
from sonarlog.diff.cells import STATES
from sonarlog.digest import BLOCKS
from sonarlog.times import short
from sonarlog.words import block_lines

SHOWN = 40
"""So many differing values of a block are listed, and so many items of a long list."""
SIGNS = {"gone": "−", "appeared": "+", "doubled": "‖", "single": "|", "split": "⊣", "merged": "⊢", "moved": "↔",
         "turned": "↻", "shorter": "⇤", "longer": "⇥"}  # fmt: skip
VERDICTS = {"same": "the same", "within": "within the tolerance", "changed": "changed"}
Row = Sequence[str]


def verdict(report: Report) -> str:
    """A badge."""
    return f'<span class="badge {report.verdict}">{VERDICTS[report.verdict]}</span>'


def sides(report: Report) -> str:
    """Which run is which."""
    told = [
        f'<span class="side {key}"><b>{key.upper()}</b> {escape(name)}, {count} sweeps</span>'
        for key, name, count in zip("ab", report.names, report.sweeps, strict=True)
    ]
    return " ".join(told)


def walls(report: Report) -> str:
    """The walls' table: changed ones first; rows are numbered as in the drawing."""
    if not report.walls:
        return "<p>No wall is known.</p>"
    place = {id(change): k for k, change in enumerate(report.walls)}
    order = [*report.changed_walls, *(change for change in report.walls if not change.kinds)]
    rows = "".join(_wall_row(place[id(change)], change) for change in order)
    head = "<thead><tr><th>wall</th><th>what became of it</th><th>moved</th><th>turned</th><th>longer</th></tr></thead>"
    return f'<table class="walls">{head}<tbody>{rows}</tbody></table>'


def _wall_row(number: int, change: WallChange) -> str:
    pair = bool(change.a and change.b)
    numbers = [f"{100 * change.moved_m:+.0f} cm", f"{change.turned_deg:+.1f}°", f"{change.longer_m:+.2f} m"]
    cells = "".join(f'<td class="number">{value if pair else ""}</td>' for value in numbers)
    signs = "".join(f'<span class="sign">{SIGNS[kind]}</span>' for kind in change.kinds)
    said = change.words.removeprefix(change.wall.name).strip()
    kind = " same" if not change.kinds else ""
    return (
        f'<tr class="wall{kind}" data-wall="{number}" tabindex="0"><td>{escape(change.wall.name)}</td>'
        f"<td>{signs} {escape(said)}</td>{cells}</tr>"
    )


def first(report: Report) -> str:
    """The first difference: both decisions, what the block took, and what differs in what it made."""
    found = report.first
    if found is None:
        return "<p>There is none: every block of every sweep came out the same to the bit.</p>"
    words = (
        f"<p>Sweep <b>{found.sweep}</b>, block <b>{found.block}</b>, <b>{escape(found.name)}</b>. "
        "Everything before it is the same in A and in B.</p>"
    )
    said = [part for part in found.decisions if part]
    decided = "".join(
        f'<div class="side {key}"><b>{key.upper()}</b> {escape(text)}</div>'
        for key, text in zip("ab", said, strict=False)
    )
    if len(said) == 1:
        decided = f"<div>{escape(said[0])}</div>"
    return f'{words}<div class="decisions">{decided}</div>{_sweep(report, found)}{_values(found)}{_inputs(found)}'


def _sweep(report: Report, found: FirstDifference) -> str:
    """What every block made of that sweep, on both sides."""
    if found.sweep >= min(report.sweeps):
        return ""
    mine, yours = (block_lines(side.run.sweeps[found.sweep].data) for side in (report.a, report.b))
    rows = []
    for letter, (name, _) in BLOCKS.items():
        same = mine[letter] == yours[letter]
        mark = ' class="first"' if letter == found.block else ' class="same"' if same else ""
        told = f"<td colspan=2>{escape(mine[letter])}</td>"
        if not same:
            told = f'<td class="a">{escape(mine[letter])}</td><td class="b">{escape(yours[letter])}</td>'
        rows.append(f"<tr{mark}><th>{letter} {escape(name)}</th>{told}</tr>")
    head = "<thead><tr><th>block</th><th>A</th><th>B</th></tr></thead>"
    return f"<h3>That sweep, block by block</h3><table>{head}<tbody>{''.join(rows)}</tbody></table>"


def _values(found: FirstDifference) -> str:
    if not found.differences:
        return "<p>The runs keep no values of this block to hold against one another.</p>"
    rows = [
        (f"<code>{escape(each.where)}</code>", _short(each.a), _short(each.b),
         "" if each.ulps is None else f"{each.ulps:.3g}")
        for each in found.differences[:SHOWN]
    ]  # fmt: skip
    count = len(found.differences)
    more = f", the first {SHOWN} of {count}" if count > SHOWN else ""
    return _folded(
        f"Values of block {found.block} that differ{more}", _table(("value", "A", "B", "units in the last place"), rows)
    )


def _inputs(found: FirstDifference) -> str:
    parts = [
        _folded(f"What it took: {name}, the same in A and B", f"<pre>{escape(_tree(value))}</pre>")
        for name, value in found.inputs.items()
    ]
    for key, value in zip("AB", found.outputs, strict=True):
        if value is not None:
            parts.append(_folded(f"What it made in {key}", f"<pre>{escape(_tree(value))}</pre>"))
    return "".join(parts)


def truth(report: Report) -> str:
    """Errors of both sides, and which is nearer."""
    if report.truth is None:
        return "<p>No truth is known for this recording.</p>"
    rows = []
    for metric in report.truth.metrics:
        told = [f"{value:.2f} {metric.unit}" for value in (metric.a, metric.b)]
        rows.append((escape(metric.label), *told, {"A": "A", "B": "B"}.get(metric.nearer, "the same")))
    return _table(("", "A", "B", "nearer to the truth"), rows)


def numbers(report: Report) -> str:
    """Cells, free areas, calibration and times."""
    parts = []
    tables = [("Cells as the maps lie", report.cells)]
    if not report.alignment.none:
        tables.append(("Cells after alignment", report.aligned_cells))
    for title, cells in tables:
        rows = [(f"{name} in A", *map(str, row)) for name, row in zip(STATES, cells.table, strict=True)]
        said = f"<h3>{title}: {100 * cells.changed:.1f} % of the known ones changed</h3>"
        parts.append(said + _table(("", *(f"{name} in B" for name in STATES)), rows))
    rooms = [escape(change.words) for change in report.rooms.changes if change.kind]
    free = " m² in A, ".join(f"{value:.1f}" for value in report.rooms.free_m2)
    parts.append(f"<h3>Free space: {free} m² in B</h3>" + (_list(rooms) if rooms else "<p>Its areas are the same.</p>"))
    calibration = [
        (f"<code>{escape(change.name)}</code>", _short(change.a), _short(change.b))
        for change in report.calibration
        if change.changed
    ]
    if calibration:
        parts.append("<h3>What they think of the robot in the end</h3>" + _table(("", "A", "B"), calibration))
    if report.times is not None:
        parts.append(_times(report.times))
    return "".join(f"<div>{part}</div>" for part in parts)


def _times(times: TimeChanges) -> str:
    """What a sweep takes, block by block, and what the numbers are worth."""
    rows = []
    for row in times.rows:
        ratio = "–" if row.ratio is None else f"× {row.ratio:.2f}"
        told = f"<b>{ratio}</b>" if row in times.telling else ratio
        rows.append((f"{row.block} {escape(row.name)}", short(row.a_ms), short(row.b_ms), told))
    table = _table(("median of the sweeps", "A, ms", "B, ms", "ratio"), rows)
    return f"<h3>Time a sweep</h3>{table}<p>Times: {escape(times.words)}.</p>"


def provenance(report: Report) -> str:
    """Where both sides come from, and what was asked differently."""
    asked = [(f"<code>{escape(key)}</code>", _short(a), _short(b)) for key, (a, b) in report.settings.items()]
    different = _table(("asked differently", "A", "B"), asked) if asked else "<p>Both were asked the same.</p>"
    mine, yours = (_origin(side) for side in (report.a, report.b))
    rows = [
        (escape(key), _code(mine.get(key, "")), _code(yours.get(key, "")))
        for key in mine | yours
        if mine.get(key) or yours.get(key)
    ]
    return f'<div>{different}</div><div class="wide">{_table(("", "A", "B"), rows)}</div>'


def _origin(side: Side) -> dict[str, str]:
    run, identity = side.run, side.run.identity
    return {
        "asked for": side.asked,
        "run": run.path.name,
        "run's digest": run.digest,
        "map's digest": run.map_digest,
        "algorithm": f"{identity.algorithm} {identity.algorithm_version}",
        "recording's digest": identity.recording_digest,
        "code's digest": identity.code_digest,
        **{key: str(value) for key, value in run.machine.items()},
    }


def _code(text: str) -> str:
    return f"<code>{escape(text)}</code>" if text else ""


def _folded(title: str, inside: str) -> str:
    return f"<details><summary>{escape(title)}</summary>{inside}</details>"


def _list(items: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{item}</li>' for item in items)}</ul>"


def _table(head: Row, rows: Iterable[Row]) -> str:
    titles = "".join(f"<th>{title}</th>" for title in head)
    body = "".join(f"<tr><th>{row[0]}</th>{''.join(f'<td>{cell}</td>' for cell in row[1:])}</tr>" for row in rows)
    return f"<table><thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table>"


def _short(value: Any) -> str:
    """A value in few letters, as HTML."""
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.6g}"
    text = str(value)
    return escape(text if len(text) <= 60 else text[:57] + "…")


def _tree(value: Any, indent: str = "") -> str:
    """Plain values as indented lines; of long lists and arrays the beginning."""
    if isinstance(value, Mapping) and value:
        return "".join(f"\n{indent}{key}: {_tree(item, indent + '  ').lstrip()}" for key, item in value.items())
    if isinstance(value, np.ndarray):
        shape = " × ".join(map(str, value.shape))
        few = ", ".join(f"{item:.6g}" for item in value.reshape(-1)[:6].tolist())
        return f"[{few}{', …' if value.size > 6 else ''}]  ({shape})"
    if isinstance(value, list) and any(isinstance(item, Mapping | list | np.ndarray) for item in value):
        lines = [f"\n{indent}- {_tree(item, indent + '  ').lstrip()}" for item in value[:SHOWN]]
        return "".join(lines) + (f"\n{indent}- … {len(value) - SHOWN} more" if len(value) > SHOWN else "")
    if isinstance(value, float):
        return f"{value:.9g}"
    return str(value)
