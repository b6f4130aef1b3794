"""sonarlog diff."""

import json
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.options import FILE, as_json, force, quiet

if TYPE_CHECKING:
    from sonarlog.diff import Report, Truth

ERRORS = (
    ("position, RMS", "ate_m", "m"),
    ("position, RMS, best alignment", "ate_aligned_m", "m"),
    ("heading, RMS", "heading_rmse_deg", "°"),
    ("position at the end", "end_m", "m"),
)


@click.command("diff")
@click.argument("files", type=FILE, nargs=-1, required=True, metavar="RUN_A RUN_B | RECORDING")
@click.option("--algorithms", metavar="A,B", help="Replay the RECORDING with both, then diff.")
@click.option("--png", type=FILE, help="Also draw both maps side by side, with the true walls if they are known.")
@force
@as_json
@quiet
def command(
    files: tuple[Path, ...], algorithms: str | None, png: Path | None, force: bool, as_json: bool, quiet: bool
) -> int:
    """Say what differs between two runs of one recording.

    Exit code 0: the same, 1: they differ, 2: they cannot be compared.

    \b
    Example:
      sonarlog diff corridor.odometry.run.mcap corridor.paper.run.mcap --png corridor.png
      sonarlog diff recordings/corridor.mcap --algorithms literal,paper
    """
    names = [name.strip() for name in algorithms.split(",")] if algorithms else []
    if algorithms and (len(files) != 1 or len(names) != 2):
        raise click.UsageError("with --algorithms: one recording and two names, such as --algorithms literal,paper")
    if not algorithms and len(files) != 2:
        raise click.UsageError("which runs? two of them, or one recording and --algorithms A,B")
    from sonarlog.diff import diff_runs
    from sonarlog.picture import check_free
    from sonarlog.runs import read_run
    from sonarlog.scores import draw_runs

    if png is not None:
        check_free(png, force=force)
    with ExitStack() as stack:
        paths = _replayed(files[0], names, stack, quiet=quiet) if names else list(files)
        a, b = (read_run(path) for path in paths)
        found = diff_runs(a, b)
        if png is not None:
            draw_runs([(f"A  {found.names[0]}", a), (f"B  {found.names[1]}", b)], png, force=force)
    if as_json:
        click.echo(json.dumps(found.as_dict(), indent=2))
    else:
        _tell(found)
    return 0 if found.same else 1


def _replayed(recording: Path, names: list[str], stack: ExitStack, *, quiet: bool) -> list[Path]:
    """Runs of the recording with these algorithms, in a folder that goes with the stack."""
    from tempfile import TemporaryDirectory

    from cli.progress import progress
    from cli.watching import Watch
    from slam.algorithms import algorithm
    from sonarlog.replay import replay

    chosen = [algorithm(name) for name in names]
    folder = Path(stack.enter_context(TemporaryDirectory(prefix="sonarlog-")))
    paths = []
    for side, each in zip("AB", chosen, strict=True):
        paths.append(folder / f"{side}.{each.name}.run.mcap")
        with progress(f"replaying {each.name}", quiet=quiet) as advance:
            replay(recording, each, paths[-1], watcher=Watch(advance))
    return paths


def _tell(found: "Report") -> None:
    """Headline first, then where they part, and the tables."""
    click.echo(found.headline)
    if found.first is None:
        return
    click.echo(f"\nA is {found.names[0]}, B is {found.names[1]}.")
    click.echo(f"Sweep {found.first.sweep}, {found.first.name} (block {found.first.block}): {found.first.words}.\n")
    names = ("unknown", "free", "occupied")
    rows = [(f"A {name}", *map(str, row)) for name, row in zip(names, found.cells.table, strict=True)]
    _table(("cells", *(f"B {name}" for name in names)), rows)
    if found.truth is not None:
        _table(("off the truth", "A", "B"), [_error(found.truth, *each) for each in ERRORS])
    for key, (mine, yours) in found.settings.items():
        click.echo(f"{key}: {mine} in A, {yours} in B")


def _error(truth: "Truth", label: str, key: str, unit: str) -> tuple[str, str, str]:
    return label, f"{getattr(truth.a, key):.2f} {unit}", f"{getattr(truth.b, key):.2f} {unit}"


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> None:
    """Names to the left, numbers to the right."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD)
    for k, title in enumerate(head):
        table.add_column(title, justify="left" if k == 0 else "right")
    for row in rows:
        table.add_row(*row)
    Console(highlight=False).print(table)
