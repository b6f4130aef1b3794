"""sonarlog calibrate."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.options import FILE, as_json, force, quiet

if TYPE_CHECKING:
    from sonarlog.calibration.estimate import Found, Parameter

WIDTH = 160  # of a table that goes to a file


@click.command("calibrate")
@click.argument("recordings", metavar="RECORDING...", type=FILE, nargs=-1, required=True)
@click.option("-o", "--output", type=FILE, help="The robot's file to write, NAME.toml.")
@click.option("--robot", metavar="NAME|FILE", help="The robot they are of, if not the one that they say.")
@click.option("--partial", is_flag=True, help="Write what was found, though some of it was not.")
@force
@as_json
@quiet
def command(
    recordings: tuple[Path, ...],
    output: Path | None,
    robot: str | None,
    partial: bool,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Find what a robot's odometry and sonars get wrong, once and for all, from recordings with scans in place.

    `record --route calibration` makes a good one. The file written is a robot for `record --robot` and
    `replay --robot`. What the recordings do not determine is said, with what to record instead; then nothing is
    written without --partial, which leaves those numbers as they were.

    Exit codes: 0 written (or, without -o, all was found), 1 something is not determined, 2 nothing can be found.

    \b
    Example:
      sonarlog record --port /dev/ttyUSB0 --route calibration -o squares.mcap
      sonarlog calibrate squares.mcap -o mine.toml
      sonarlog replay corridor.mcap --robot mine.toml
    """
    from cli.progress import progress
    from sonarlog.calibration.estimate import calibrate
    from sonarlog.calibration.robot_file import check_free, write_robot
    from sonarlog.robot import load_robot

    if output is not None:
        check_free(output, force=force)
    given = load_robot(robot) if robot else None
    with progress("calibrating", quiet=quiet) as advance:
        found = calibrate(recordings, given, advance)
    written = output is not None and (partial or not found.missing)
    if written and output is not None:
        write_robot(found.calibrated, output, force=force)
    if as_json:
        click.echo(json.dumps(found.as_dict() | {"written": str(output) if written else None}, indent=2))
    else:
        _show(found)
    if not quiet and output is not None:
        _say(found, output, written=written)
    return 1 if found.missing and not written else 0


def _say(found: "Found", output: Path, *, written: bool) -> None:
    names = ", ".join(each.name for each in found.missing)
    if not written:
        click.echo(f"{output} is not written, for want of {names}: record what is missing, or give --partial", err=True)
    else:
        click.echo(f"{output}: {found.robot.name}" + (f", without {names}" if names else ""), err=True)


def _show(found: "Found") -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("parameter", "found", "±", "before", "± then", "± needed", "verdict", box=None, pad_edge=False)
    for column in table.columns[1:6]:
        column.justify = "right"
    for each in found.parameters:
        table.add_row(each.name, *_numbers(each), each.verdict)
    Console(width=None if sys.stdout.isatty() else WIDTH).print(table)
    click.echo(f"{found.arcs} arcs of single sonars on walls, {found.sweeps} sweeps, {found.metres:.1f} m")


def _numbers(each: "Parameter") -> list[str]:
    digits = 4 if each.name.endswith("scale") else 2
    return [f"{value:.{digits}f}" for value in (each.value, each.sigma, each.before, each.prior, each.limit)]
