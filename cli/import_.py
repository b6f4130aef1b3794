"""sonarlog import."""

import sys
from pathlib import Path

import click

from cli.options import FILE, force

output = click.option("-o", "--output", type=FILE, required=True, help="The recording to write.")


@click.group("import")
def command() -> None:
    """Bring other people's sonar logs in, as recordings that replay like any other."""


@command.command("udacity")
@click.argument("measurement", type=FILE)
@click.argument("poses", type=FILE)
@output
@force
def udacity(measurement: Path, poses: Path, output: Path, force: bool) -> None:
    """The RoboND corridor: MEASUREMENT (t_ms z0 … z7) and POSES (t_ms x_mm y_mm theta).

    \b
    Example:
      sonarlog import udacity measurement.txt poses.txt -o corridor.mcap
    """
    from sonarlog.imports import udacity as form
    from sonarlog.imports.rows import write_rows

    config = {"form": "udacity", "measurement": measurement.name, "poses": poses.name}
    rows = form.rows(measurement, poses)
    count = write_rows(
        output, rows, form.robot(), source=measurement, command_line=_typed(), config=config, force=force
    )
    click.echo(f"{output}: {count} rows", err=True)


@command.command("csv")
@click.argument("file", type=FILE)
@output
@force
def csv(file: Path, output: Path, force: bool) -> None:
    """A plain FILE.csv with the sonars' mountings in comment lines; docs/recording.md says how.

    \b
    Example of FILE.csv:
      # half_beam_deg: 12.5
      # max_range_mm: 5000
      # sonar: 70 100 90
      # sonar: 70 -100 -90
      t_s,x_m,y_m,theta_deg,r0_m,r1_m
      0.0,0.000,0.000,0.0,1.204,nan
    """
    from sonarlog.imports import csv as form
    from sonarlog.imports.rows import write_rows

    table = form.read(file)
    config = {"form": "csv", "file": file.name}
    count = write_rows(
        output, form.rows(table), table.robot, source=file, command_line=_typed(), config=config, force=force
    )
    click.echo(f"{output}: {count} rows", err=True)


def _typed() -> str:
    return " ".join(["sonarlog", *sys.argv[1:]])
