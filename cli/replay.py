"""sonarlog replay."""

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.options import FILE, FOLDER, algorithm_settings, as_json, force, quiet, settings_from
from cli.watching import WINDOW, Watch

if TYPE_CHECKING:
    from slam.algorithms import Algorithm
    from sonarlog.replay import Replayed
    from sonarlog.robot import Robot


@click.command("replay")
@click.argument("recording", type=FILE, required=False)
@click.option("--algorithm", "name", default=None, help="Which algorithm; see `sonarlog algorithms`. Default: graph.")
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
@click.option(
    "--checkpoint-every",
    type=click.IntRange(1),
    default=None,
    metavar="N",
    help="Keep the whole state in the run after every N sweeps.",
)
@click.option(
    "--from",
    "start",
    type=click.IntRange(0),
    metavar="SWEEP",
    help="Go on from the last checkpoint before it in the run (-o); the run is only read.",
)
@click.option(
    "--perturb",
    metavar="1ulp|1mm|drop=1%",
    help="How far poses and map move when the input moves by so little; no run is written.",
)
@click.option("--robot", metavar="NAME|FILE", help="Take it for this robot, such as calibrated, not for its own.")
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
    checkpoint_every: int | None,
    start: int | None,
    perturb: str | None,
    robot: str | None,
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
    from slam.algorithms import DEFAULT, algorithm
    from sonarlog.robot import load_robot

    given = load_robot(robot) if robot else None
    chosen = algorithm(name or DEFAULT).configured(settings_from(config, changes))
    if perturb is not None:
        _perturbed(recording, chosen, perturb, given, as_json=as_json, quiet=quiet)
        return
    if output is None and (viz is None or folder is not None):
        output = Path(f"{recording.name.removesuffix('.mcap')}.{chosen.name}.run.mcap")
    if start is not None and given is not None:
        raise click.UsageError("--from goes on with the run's own robot: leave --robot out")
    if start is not None and output is not None:
        _resumed(recording, chosen, output, start, as_json=as_json, quiet=quiet)
        return
    result = _replayed(recording, chosen, output, folder, viz, checkpoint_every or 0, given, force=force, quiet=quiet)
    _tell(result, output or recording, f"{chosen.name} {chosen.version}", output, as_json=as_json, quiet=quiet)


def _replayed(
    recording: Path,
    chosen: "Algorithm",
    output: Path | None,
    folder: Path | None,
    viz: str | None,
    every: int,
    robot: "Robot | None",
    *,
    force: bool,
    quiet: bool,
) -> "Replayed":
    """The whole of it into a run, shown and exported as is wanted."""
    from cli.progress import progress
    from sonarlog.replay import replay

    if folder is not None:
        from sonarlog.exports.folder import check_folder_free, export_folder

        check_folder_free(folder, force=force)
    title = f"{recording.name} {chosen.name}"
    with progress("replaying", quiet=quiet) as advance, Watch(advance, viz, title, force=force) as watch:
        result = replay(
            recording,
            chosen,
            output,
            force=force,
            watcher=watch,
            checkpoint_every=every,
            robot=robot,
            clock=time.thread_time_ns,
        )
    if folder is not None and output is not None:
        from sonarlog.runs import read_run

        export_folder(read_run(output), folder, force=force)
    for sentence in result.missing:
        click.echo(sentence, err=True)
    return result


def _tell(result: "Replayed", path: Path, algorithm: str, run: Path | None, *, as_json: bool, quiet: bool) -> None:
    from sonarlog.accounting import told

    explored = result.reproduced
    if as_json:
        told_of = {} if explored is None else {"decisions": vars(explored)}
        click.echo(json.dumps({"run": run and str(run), "digest": result.digest, **result.counts, **told_of}))
        return
    click.echo(f"{result.digest}  {path}  {result.sweeps} sweeps, {algorithm}")
    if explored is not None:
        click.echo(f"decisions: {explored.told()}", err=True)
    if not quiet:
        for line in told(result.counts):
            click.echo(line, err=True)


def _resumed(recording: Path, chosen: "Algorithm", run: Path, start: int, *, as_json: bool, quiet: bool) -> None:
    from cli.progress import progress
    from sonarlog.checkpoints import resume

    with progress("replaying", quiet=quiet) as advance, Watch(advance) as watch:
        result, begin = resume(recording, chosen, run, start, watch)
    if as_json:
        click.echo(json.dumps({"run": str(run), "from": begin, "digest": result.digest, **result.counts}))
    else:
        click.echo(f"{result.digest}  from sweep {begin} of {result.sweeps} of {run}, {chosen.name} {chosen.version}")


def _perturbed(
    recording: Path, chosen: "Algorithm", text: str, robot: "Robot | None", *, as_json: bool, quiet: bool
) -> None:
    from cli.progress import progress
    from sonarlog.perturb import Perturbation, sensitivity

    perturbation = Perturbation.parse(text)
    with progress("replaying twice", quiet=quiet) as advance, Watch(advance) as watch:
        found = sensitivity(recording, chosen, perturbation, watch, robot)
    if as_json:
        click.echo(json.dumps(vars(found)))
        return
    chained = "its walls chained as before"
    if found.parted is not None:
        chained = f"its walls chained otherwise from sweep {found.parted} on"
    click.echo(
        f"moved by {found.text}: poses by up to {found.largest_mm:.3g} mm (sweep {found.sweep}) and "
        f"{found.largest_deg:.2g}°, {found.end_mm:.3g} mm at the end; {found.cells} of {found.known} known cells; "
        f"{chained}"
    )
    if found.sweeps[0] != found.sweeps[1]:
        click.echo(f"{found.sweeps[0]} sweeps became {found.sweeps[1]}")
