"""`sonarlog bench`: every algorithm in every place, and how near to the truth it comes."""

import json
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.options import FILE, FOLDER, quiet, value_of

if TYPE_CHECKING:
    from sonarlog.bench.conduct import Bench
    from sonarlog.bench.results import Results
    from sonarlog.bench.tables import Table

MOST_AT_ONCE = 64


@click.command("bench")
@click.option(
    "--worlds",
    default="corridor,bend,loop,office,clutter",
    show_default=True,
    help="Names, files, or random places: random:1-20.",
)
@click.option("--seeds", default="1-5", show_default=True, help="Such as 1-20 or 3,5,8.")
@click.option("--algorithms", metavar="A,B+BLOCK.KEY=VALUE", help="All by default; a plus changes a setting.")
@click.option("--conditions", default="plain", show_default=True, help="Names, or all; --list names them.")
@click.option("--list", "list_conditions", is_flag=True, help="Name the conditions and what they are.")
@click.option("--jobs", type=click.IntRange(1, MOST_AT_ONCE), metavar="N", help="Processes. Default: one a processor.")
@click.option(
    "--folder",
    type=FOLDER,
    default=Path("out/bench"),
    show_default=True,
    help="Keeps recordings and results; what is there is not done again.",
)
@click.option("--only-table", is_flag=True, help="Do nothing new: tables of what is in the folder.")
@click.option("--json", "json_file", type=FILE, help="Write every result and every spread there.")
@click.option("--html", type=FILE, help="Write a page with pictures there.")
@click.option("--write", type=FILE, help="Put the tables into a Markdown page, such as docs/accuracy.md.")
@quiet
def command(
    worlds: str,
    seeds: str,
    algorithms: str | None,
    conditions: str,
    list_conditions: bool,
    jobs: int | None,
    folder: Path,
    only_table: bool,
    json_file: Path | None,
    html: Path | None,
    write: Path | None,
    quiet: bool,
) -> int:
    """Measure every algorithm in every world: medians and spread over seeds, as ratios to raw odometry.

    Recordings of the embedded robot are made and replayed in parallel. It goes on where it was interrupted, and does
    again only what other code, settings or worlds would give otherwise. Exit code 1: some replay failed.

    \b
    Example:
      sonarlog bench --worlds corridor,random:1-20 --seeds 1-3 --html bench.html
    """
    if list_conditions:
        _list()
        return 0
    from cli.progress import progress
    from slam.algorithms import ALGORITHMS
    from sonarlog.bench.conditions import conditions_named
    from sonarlog.bench.conduct import Bench
    from sonarlog.bench.plan import Plan, contender, numbers_of, parts_of, worlds_of
    from sonarlog.bench.report import write_into

    names = parts_of("algorithms", algorithms) if algorithms else list(ALGORITHMS)
    plan = Plan(
        worlds_of(worlds),
        numbers_of("seeds", seeds),
        tuple(condition.name for condition in conditions_named(parts_of("conditions", conditions))),
        tuple(contender(name, value_of) for name in names),
    )
    bench = Bench(plan, folder, jobs or os.cpu_count() or 1)
    with progress("bench", quiet=quiet) as advance:
        results = bench.results(advance, only_known=only_table)
    asked = shlex.join(["sonarlog", *_without_outputs(sys.argv[1:])])
    _tell(results)
    if json_file is not None:
        _write_json(json_file, results, asked)
    if write is not None:
        write_into(write, results, asked)
    if html is not None:
        _write_page(html, bench, results, asked, quiet=quiet)
    return 1 if any(group.failed for group in results.groups) else 0


def _write_json(path: Path, results: "Results", asked: str) -> None:
    from sonarlog.bench.report import as_dict, write

    write(path, json.dumps(as_dict(results, asked), indent=1) + "\n")


def _write_page(path: Path, bench: "Bench", results: "Results", asked: str, *, quiet: bool) -> None:
    from cli.progress import progress
    from sonarlog.bench.page import page
    from sonarlog.bench.report import write

    with progress("drawing", quiet=quiet) as advance:
        pictures = bench.pictures(results, advance)
    write(path, page(results, pictures, asked))


def _without_outputs(arguments: Sequence[str]) -> list[str]:
    """The command line that gives the same numbers: how many processes, and where to, says nothing of them."""
    told: list[str] = []
    skip = False
    for argument in arguments:
        name = argument.partition("=")[0]
        if skip or name in ("-q", "--quiet", "--only-table"):
            skip = False
        elif name in ("--jobs", "--folder", "--json", "--html", "--write"):
            skip = "=" not in argument
        else:
            told.append(argument)
    return told


def _list() -> None:
    from sonarlog.bench.conditions import CONDITIONS

    for condition in CONDITIONS.values():
        click.echo(f"{condition.name:22}{condition.about}")


def _tell(results: "Results") -> None:
    from sonarlog.bench.tables import broken, tables

    for table in tables(results):
        click.echo(f"\n{table.title}")
        _show(table)
    if not results.rows:
        click.echo("nothing is known yet: leave --only-table out", err=True)
    for sentence in broken(results):
        click.echo(sentence.replace("`", ""))


def _show(table: "Table") -> None:
    """Names to the left, numbers to the right, a line between places."""
    from rich import box
    from rich.console import Console
    from rich.table import Table as RichTable

    shown = RichTable(box=box.SIMPLE_HEAD, pad_edge=False)
    for n, title in enumerate(table.head):
        shown.add_column(title, justify="left" if n < table.names else "right", overflow="fold")
    for n, row in enumerate(table.rows):
        last = n + 1 == len(table.rows) or table.rows[n + 1][0] != row[0]
        shown.add_row(*row, end_section=last)
    width = None if sys.stdout.isatty() else 200
    Console(width=width).print(shown)
