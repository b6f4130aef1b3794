"""The page as one file: words and tables written here, the drawing done by its script, nothing from anywhere else.

Must not know: how differences are found.
"""

import json
from html import escape
from importlib import resources
from pathlib import Path
from string import Template

from sonarlog.diff import Report
from sonarlog.diff_page import tables
from sonarlog.diff_page.payload import payload
from sonarlog.errors import SonarlogError

SCRIPTS = ("cells.js", "map.js", "legend.js", "plots.js", "page.js")


class CannotWritePage(SonarlogError):
    """A page that cannot be written."""


def check_free(path: Path | str, *, force: bool) -> None:
    """Raise CannotWritePage if a page there would overwrite something and `force` is not given."""
    if Path(path).exists() and not force:
        raise CannotWritePage(f"{path} exists and is not overwritten: name another file, or give --force")


def write_page(report: Report, path: Path | str, *, force: bool = False) -> None:
    """Write the report's page. Raises CannotWritePage for a file that exists or cannot be made."""
    check_free(path, force=force)
    text = page(report)
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise CannotWritePage(f"cannot write the page {path}: {error.strerror}") from None


def page(report: Report) -> str:
    """The whole page. It may load nothing: its own policy forbids it."""
    names = report.names
    return Template(_part("page.html")).substitute(
        title=escape(f"{names[0]} → {names[1]}"),
        style=_part("page.css"),
        script="\n".join(map(_part, SCRIPTS)),
        data=json.dumps(payload(report), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        headline=escape(report.headline),
        verdict=tables.verdict(report),
        sides=tables.sides(report),
        walls=tables.walls(report),
        changed=len(report.changed_walls),
        all=len(report.walls),
        first=tables.first(report),
        truth=tables.truth(report),
        numbers=tables.numbers(report),
        provenance=tables.provenance(report),
    )


def _part(name: str) -> str:
    return (resources.files("sonarlog.diff_page") / name).read_text(encoding="utf-8")
