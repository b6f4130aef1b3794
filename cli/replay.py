"""sonarlog replay."""

import json
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.options import FILE, FOLDER, algorithm_settings, as_json, force, quiet, settings_from

if TYPE_CHECKING:
    from cli.progress import Advance
    from slam.geometry import Pose
    from slam.pipeline import Step
    from sonarlog.log import Log
    from sonarlog.viz.rerun_door import Inspection

WINDOW = "window"


@click.command("replay")
@click.argument("recording", type=FILE, required=False)
@click.option("--algorithm", "name", default=None, help="Which algorithm; see `sonarlog algorithms`. Default: paper.")
@algorithm_settings
@click.option(
    "-o",
    "--output",
    type=FILE,
    help="The run to write. Default: NAME.ALGORITHM.run.mcap here; with --viz none.",
)
@click.option("--export", "folder", type=FOLDER, help="Also write map.pgm, map.yaml, trajectory.tum, walls.csv here.")
@click.option(
    "--viz",
    is_flag=False,
    flag_value=WINDOW,
    metavar="[FILE.rrd]",
    help="Inspect sweep by sweep in Rerun's viewer, or save that to a file.",
)
@force
@as_json
@quiet
def command(
    recording: Path | None,
    name: str | None,
    config: Path | None,
    changes: tuple[str, ...],
    output: Path | None,
    folder: Path | None,
    viz: str | None,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Replay a RECORDING through the SLAM pipeline into a run.

    The same recording, algorithm and settings give the same digest on every machine.

    \b
    Example:
      sonarlog replay recordings/corridor.mcap --viz
    """
    if recording is None and viz not in (None, WINDOW) and not str(viz).endswith(".rrd"):
        recording, viz = Path(str(viz)), WINDOW  # `replay --viz RECORDING`
    if recording is None:
        raise click.UsageError("which recording? sonarlog replay RECORDING")
    from cli.progress import progress
    from slam.algorithms import DEFAULT, algorithm
    from sonarlog.replay import replay

    chosen = algorithm(name or DEFAULT).configured(settings_from(config, changes))
    if output is None and (viz is None or folder is not None):
        output = Path(f"{recording.name.removesuffix('.mcap')}.{chosen.name}.run.mcap")
    with progress("replaying", quiet=quiet) as advance:
        watch = _Watch(f"{recording.name} {chosen.name}", viz, advance, force=force)
        with closing(watch):
            result = replay(recording, chosen, output, force=force, watcher=watch)
    if folder is not None and output is not None:
        from sonarlog.export import export
        from sonarlog.runs import read_run

        export(read_run(output), folder, force=force)
    if as_json:
        click.echo(json.dumps({"run": output and str(output), "digest": result.digest, **result.counts}))
        return
    click.echo(f"{result.digest}  {output or recording}  {result.sweeps} sweeps, {chosen.name} {chosen.version}")
    if not quiet:
        click.echo(_told(result.counts), err=True)


class _Watch:
    """Progress, and what --viz asks for: a viewer, or a file for it."""

    def __init__(self, title: str, viz: str | None, advance: "Advance", *, force: bool) -> None:
        self._title, self._viz, self._advance, self._force = title, viz, advance, force
        self._inspection: Inspection | None = None
        self._done = self._count = 0

    def begin(self, log: "Log", sweeps: int) -> None:
        self._count = sweeps
        if self._viz is None:
            return
        from sonarlog.viz.rerun_door import inspect_live, inspect_to_file

        self._inspection = (
            inspect_live(self._title, log)
            if self._viz == WINDOW
            else inspect_to_file(self._title, log, self._viz, force=self._force)
        )

    def step(self, step: "Step", truth: "Pose | None") -> None:
        self._done += 1
        if self._inspection is not None:
            self._inspection.add(step, truth)
        self._advance(self._done, self._count)

    def close(self) -> None:
        if self._inspection is not None:
            self._inspection.finish()


def _told(counts: dict[str, int]) -> str:
    """What of the recording was used and what was left out."""
    return ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in counts.items() if count)
