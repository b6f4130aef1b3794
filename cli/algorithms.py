"""sonarlog algorithms."""

import json

import click

from cli.options import as_json


@click.command("algorithms")
@click.argument("name", required=False)
@as_json
def command(name: str | None, as_json: bool) -> None:
    """List the algorithms, or all settings of the one called NAME.

    \b
    Example:
      sonarlog algorithms paper
    """
    from slam.algorithms import ALGORITHMS, DEFAULT, algorithm
    from slam.config import settings

    chosen = [algorithm(name)] if name else list(ALGORITHMS.values())
    if as_json:
        rows = {
            a.name: {"version": a.version, "about": a.about, "default": a.name == DEFAULT, "config": settings(a.config)}
            for a in chosen
        }
        click.echo(json.dumps(rows, indent=2))
        return
    for a in chosen:
        default = " (default)" if a.name == DEFAULT else ""
        click.echo(f"{a.name} {a.version}{default}: {a.about}")
    if name:
        for key, value in settings(chosen[0].config).items():
            click.echo(f"  {key} = {json.dumps(value)}")
