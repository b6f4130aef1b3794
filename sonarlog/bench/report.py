"""The bench as Markdown, put between two marks of a page whose other text stays, and as JSON.

Must not know: how results are made.
"""

from pathlib import Path
from typing import Any

from sonarlog.bench.results import Results
from sonarlog.bench.tables import Table, broken, condition_lines, legend, tables
from sonarlog.bench.work import judges_digest
from sonarlog.errors import SonarlogError
from sonarlog.provenance import code_digest, machine_facts

BEGIN, END = "<!-- bench: written by sonarlog bench --write -->", "<!-- end of bench -->"


class NoPlace(SonarlogError):
    """A page without the marks between which the tables go."""

    def __init__(self, path: Path) -> None:
        super().__init__(f"{path} has no lines {BEGIN!r} and {END!r}: the tables go between them")


def write_into(path: Path, results: Results, command: str) -> None:
    """Put the tables between the marks of that page; a page that is not there is made. Raises NoPlace, CannotWrite."""
    text = _read(path) if path.exists() else f"# Accuracy\n\n{BEGIN}\n{END}\n"
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise NoPlace(path)
    write(path, f"{before}{BEGIN}\n\n{markdown(results, command)}\n{END}{after}")


def write(path: Path, text: str) -> None:
    """Write a text. Raises CannotWriteReport."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise CannotWriteReport(path, error.strerror or str(error)) from None


class CannotWriteReport(SonarlogError):
    """A report that cannot be written or read."""

    def __init__(self, path: Path, why: str) -> None:
        super().__init__(f"{path}: {why}; name another file for the report")


def markdown(results: Results, command: str) -> str:
    """All tables, what they mean, and what broke."""
    facts = machine_facts()
    parts = [f"```sh\n{command}\n```", f"Of sonarlog {facts['sonarlog']}, code of `slam/` {code_digest()[:12]}."]
    for table in tables(results):
        parts += [f"## {table.title}", _markdown(table)]
    if lines := condition_lines(results):
        parts.append("\n".join(f"- `{name}`: {about}" for name, about in lines))
    parts += legend()
    parts.append("## Where it breaks")
    found = broken(results)
    parts.append(
        "\n".join(f"- {sentence}" for sentence in found) if found else "Nowhere: no run was worse than raw odometry."
    )
    return "\n\n".join(parts) + "\n"


def as_dict(results: Results, command: str) -> dict[str, Any]:
    """For JSON: every row and every group."""
    return {
        "command": command,
        "machine": machine_facts(),
        "slam_digest": code_digest(),
        "judges_digest": judges_digest(),
        "groups": [group.as_dict() for group in results.groups],
        "rows": [row.as_dict() for row in results.rows],
        "broken": broken(results),
    }


def _markdown(table: Table) -> str:
    rule = "|".join(["---"] * table.names + ["---:"] * (len(table.head) - table.names))
    lines = [f"| {' | '.join(table.head)} |", f"|{rule}|"]
    lines += [f"| {' | '.join(row)} |" for row in table.rows]
    return "\n".join(lines)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise CannotWriteReport(path, str(error)) from None
