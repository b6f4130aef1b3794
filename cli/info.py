"""sonarlog info."""

import json
from pathlib import Path

import click

from cli.options import FILE, as_json


@click.command("info")
@click.argument("file", type=FILE)
@as_json
def command(file: Path, as_json: bool) -> None:
    """Say what is in a FILE: a recording, a run, or any ROS 2 bag with Range, Odometry and static TF.

    \b
    Example:
      sonarlog info recordings/corridor.mcap
    """
    from sonarlog.info import info

    found = info(file)
    if as_json:
        click.echo(json.dumps(found.as_dict(), indent=2))
        return
    for label, text in found.facts():
        click.echo(f"{label:<10}  {text}")
