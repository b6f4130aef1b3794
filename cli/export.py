"""sonarlog export."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click

from cli.options import FILE, force, quiet

if TYPE_CHECKING:
    from sonarlog.exports.tum import WhichPath


@click.command("export")
@click.argument("file", type=FILE, metavar="RECORDING|RUN")
@click.option(
    "--format",
    "form",
    required=True,
    type=click.Choice(["csv", "tum", "carmen", "map", "png", "walls", "json"]),
    help="docs/export.md says what each holds.",
)
@click.option(
    "--path",
    "which",
    type=click.Choice(["final", "online", "odometry", "truth"]),
    help="With tum: which path. Default: final of a run, odometry of a recording.",
)
@click.option(
    "-o", "--output", type=FILE, help="Where to; - is stdout. Default: by the file's name, in the working folder."
)
@force
@quiet
def command(file: Path, form: str, which: "WhichPath | None", output: Path | None, force: bool, quiet: bool) -> None:
    """Write a RECORDING or a RUN as plain files for other programs.

    \b
    of a recording: csv (`import csv` reads it back), carmen, tum, json, map (the true one)
    of a run:       tum, csv (poses), walls, map, png, json

    \b
    Example:
      sonarlog export recordings/corridor.mcap --format carmen
      sonarlog export corridor.graph.run.mcap --format map -o corridor.yaml
      sonarlog export recordings/corridor.mcap --format tum --path truth -o - | head
    """
    from cli.progress import progress
    from sonarlog.export import Asked, export_file

    where: Path | TextIO | None = sys.stdout if output == Path("-") else output
    asked = Asked(file, form, which, where, force)
    try:
        with progress("exporting, %", quiet=quiet or output == Path("-")) as advance:
            missing = export_file(asked, advance)
        sys.stdout.flush()
    except BrokenPipeError:  # whoever read has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return
    for sentence in missing:
        click.echo(sentence, err=True)
    if asked.made:
        click.echo(", ".join(map(str, asked.made)), err=True)
