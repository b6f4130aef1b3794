"""sonarlog eval."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.options import FILE, as_json, quiet

if TYPE_CHECKING:
    from cli.progress import Advance
    from slam.geometry import Pose
    from sonarlog.evaluation import Evaluation
    from sonarlog.map_metrics import TruePlace
    from sonarlog.metrics import PathErrors
    from sonarlog.truth import Reference

ERRORS = (  # label, field of PathErrors, unit, decimals
    ("position, RMS (ATE)", "ate_m", "m", 3),
    ("position, RMS, best alignment", "ate_aligned_m", "m", 3),
    ("heading, RMS", "heading_rmse_deg", "°", 2),
    ("position at the end", "end_m", "m", 3),
    ("position over 1 m", "over_1m_m", "m", 3),
    ("heading over 1 m", "over_1m_deg", "°", 2),
    ("position over 5 m", "over_5m_m", "m", 3),
    ("heading over 5 m", "over_5m_deg", "°", 2),
)
MAP = (
    ("occupied cells within 10 cm of a wall", "occupied_true"),
    ("wall in sight that is in the map", "surface_mapped"),
    ("free cells truly free", "free_true"),
)


@click.command("eval")
@click.argument("files", type=FILE, nargs=-1, required=True, metavar="RUN…")
@click.option("--truth", "truth", type=FILE, help="True poses: a TUM file, or a recording that holds /truth.")
@click.option("--truth-map", "sheet", type=FILE, metavar="MAP.yaml", help="The true map, as ROS map_server has it.")
@click.option(
    "--truth-offset", "offset_s", type=float, default=0.0, metavar="SECONDS", help="To add to the times of --truth."
)
@click.option("--start", metavar="X,Y,DEG", help="Where in --truth-map the path starts, if no true poses are known.")
@as_json
@quiet
def command(
    files: tuple[Path, ...],
    truth: Path | None,
    sheet: Path | None,
    offset_s: float,
    start: str | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Hold runs against the truth: errors of path and map, also as ratios to raw odometry.

    The truth is the run's own unless --truth names another. A RUN may also be a TUM file of any program's making; then
    --truth is needed, and only the path is judged. docs/evaluation.md says what each number means.

    \b
    Example:
      sonarlog eval corridor.odometry.run.mcap corridor.graph.run.mcap
      sonarlog eval real.graph.run.mcap --truth mocap.tum --truth-map floor.yaml --json
      sonarlog eval other-slam.tum --truth recordings/corridor.mcap
    """
    from cli.progress import progress
    from sonarlog.evaluation import SCHEMA
    from sonarlog.true_map import read_true_map

    place = _place(start)
    with progress("reading the truth, kB", quiet=quiet) as advance:
        given = _reference(truth, offset_s, advance) if truth else None
    true_map = read_true_map(sheet) if sheet else None
    found = []
    with progress("judging", quiet=quiet) as advance:
        for number, file in enumerate(files):
            advance(number, len(files))
            found.append(_judged(file, given, true_map, place))
    if as_json:
        data = {"schema": SCHEMA, "truth": truth and str(truth), "truth_map": sheet and str(sheet)}
        click.echo(json.dumps({**data, "runs": [each.as_dict() for each in found]}, indent=2, allow_nan=False))
    else:
        _tell(found)


def _judged(file: Path, given: "Reference | None", true_map: "TruePlace | None", place: "Pose | None") -> "Evaluation":
    from sonarlog.evaluation import evaluate, reference_of_run, track_of_run, track_of_tum
    from sonarlog.runs import read_run
    from sonarlog.truth import NoTruth, read_tum

    if file.suffix != ".tum":
        run = read_run(file)
        return evaluate(track_of_run(run), given or reference_of_run(run), true_map, place)
    if given is None:
        raise NoTruth(f"{file} is a path alone: name its truth with --truth FILE.tum or --truth RECORDING.mcap")
    return evaluate(track_of_tum(str(file), read_tum(file)), given, true_map)


def _reference(path: Path, offset_s: float, advance: "Advance") -> "Reference":
    """True poses by the file's name: a recording or TUM lines."""
    from sonarlog.recording import read_log
    from sonarlog.truth import Reference, read_tum, reference_of_log

    if path.suffix == ".mcap":
        log = read_log(path, watch=lambda done, size: advance(done // 1000, size // 1000))
        found = reference_of_log(path, log)
    else:
        found = Reference(str(path), read_tum(path))
    return found.shifted(round(offset_s * 1e9))


def _place(text: str | None) -> "Pose | None":
    from math import radians

    from slam.geometry import Pose

    if text is None:
        return None
    try:
        x, y, degrees = (float(word) for word in text.split(","))
    except ValueError:
        raise click.UsageError(f"--start takes X,Y,DEG in metres and degrees, not {text!r}") from None
    return Pose(x, y, radians(degrees))


def _tell(found: "list[Evaluation]") -> None:
    """A column a run; rows that no run has are left out, and so are paths as found online that stayed as they were."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("")
    for title in _titles(found):
        table.add_column(title, justify="right", overflow="fold")
    if any(each.path for each in found):
        table.add_row("poses judged", *(f"{each.judged} of {each.poses}" if each.path else "–" for each in found))
    _path_rows(table.add_row, found, "path")
    if any(each.corrected_later for each in found):
        table.add_section()
        _path_rows(table.add_row, found, "online")
    table.add_section()
    _map_rows(table.add_row, found)
    if any(each.walls for each in found):
        table.add_row("long walls bent by up to", *(_bent(each) for each in found))
    width = None if sys.stdout.isatty() else 1000  # a file has room for every column
    Console(highlight=False, width=width).print(table)
    if any(each.ratio for each in found):
        click.echo("In parentheses: as a part of raw odometry's error in the same recording.", err=True)


def _titles(found: "list[Evaluation]") -> list[str]:
    """The files' names, as short as tells them apart."""
    paths = [Path(each.name) for each in found]
    short = [path.name.removesuffix(".run.mcap") for path in paths]
    return short if len(set(short)) == len(short) else [str(path) for path in paths]


def _path_rows(add: Callable[..., None], found: "list[Evaluation]", which: str) -> None:
    for label, key, unit, decimals in ERRORS:
        cells = [_cell(each, which, key, unit, decimals) for each in found]
        if any(cells):
            add(label if which == "path" else f"{label}, as found online", *(cell or "–" for cell in cells))


def _map_rows(add: Callable[..., None], found: "list[Evaluation]") -> None:
    for name, key in MAP:
        for label, maps in ((name, [e.map for e in found]), ("   best alignment", [e.map_aligned for e in found])):
            shares = [getattr(each, key) if each else None for each in maps]
            if any(share is not None for share in shares):
                add(label, *("–" if share is None else f"{100 * share:.1f} %" for share in shares))


def _cell(found: "Evaluation", which: str, key: str, unit: str, decimals: int) -> str:
    errors: PathErrors | None = found.path if which == "path" else found.online
    ratios = found.ratio if which == "path" else found.online_ratio
    value = getattr(errors, key) if errors else None
    if value is None:
        return ""
    ratio = ratios.get(key) if ratios else None
    gap = "" if unit == "°" else " "
    return f"{value:.{decimals}f}{gap}{unit}" + (f" ({ratio:.2f})" if ratio is not None else "")


def _bent(found: "Evaluation") -> str:
    if not found.walls:
        return "–"
    worst = max(found.walls, key=lambda wall: wall.deviation_m)
    return f"{100 * worst.deviation_m:.1f} cm over {worst.length_m:.0f} m"
