"""sonarlog demo."""

import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from cli.options import FOLDER

PATIENCE_S = 10.0


@click.command("demo")
@click.option("-o", "--output", "folder", type=FOLDER, default=Path("out/demo"), show_default=True, help="Where to.")
@click.option("--world", default="corridor", show_default=True, help="Where the embedded robot drives.")
@click.option("--speed", default=25, show_default=True, type=click.IntRange(1, 100), help="Times real time.")
def command(folder: Path, world: str, speed: int) -> int:
    """Run the main job end to end on the embedded robot: record, replay, diff, inspect.

    The robot is a process of its own on a pseudo terminal, recorded over its real protocol.
    """
    from slam.algorithms import DEFAULT

    folder.mkdir(parents=True, exist_ok=True)
    recording, picture, inspection = (folder / f"{world}{end}" for end in (".mcap", ".png", ".rrd"))
    runs = {name: folder / f"{world}.{name}.run.mcap" for name in ("odometry", DEFAULT)}
    with _robot(world, speed) as port:
        _run("record", "--port", port, "--speed", str(speed), "-o", str(recording), "--force")
    _run("replay", str(recording), "--algorithm", "odometry", "-o", str(runs["odometry"]), "--force")
    _run("replay", str(recording), "-o", str(runs[DEFAULT]), "--viz", str(inspection), "--force")
    _run("diff", *map(str, runs.values()), "--png", str(picture), "--force", well=(0, 1))
    click.echo()
    for what, path in (
        ("the recording", recording),
        ("what raw odometry makes of it", runs["odometry"]),
        ("what SLAM makes of it", runs[DEFAULT]),
        ("both maps and the true walls", picture),
        ("the replay sweep by sweep (rerun FILE)", inspection),
    ):
        click.echo(f"{path}  {what}")
    return 0


@contextmanager
def _robot(world: str, speed: int) -> Iterator[str]:
    """The simulator in a process of its own; yields the pseudo terminal it listens on, and stops it at the end."""
    command = [sys.executable, "-m", "cli", "sim", "--world", world, "--pty", "--speed", str(speed)]
    click.echo(f"$ sonarlog {shlex.join(command[3:])}", err=True)
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as robot:
        try:
            port = robot.stdout.readline().strip() if robot.stdout else ""
            if not port:
                raise click.ClickException("the simulated robot did not start; its own message stands above")
            yield port
        finally:
            robot.terminate()
            robot.wait(PATIENCE_S)


def _run(*arguments: str, well: tuple[int, ...] = (0,)) -> None:
    """Run a command of ours as a user would, and stop the demo where it fails."""
    click.echo(f"$ sonarlog {shlex.join(arguments)}", err=True)
    code = subprocess.run([sys.executable, "-m", "cli", *arguments], check=False).returncode
    if code not in well:
        raise click.ClickException(f"sonarlog {arguments[0]} ended with exit code {code}")
