"""sonarlog diff."""

import json
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.diff_files import Files
from cli.options import FILE, as_json, force, quiet
from cli.watching import WINDOW

if TYPE_CHECKING:
    from sonarlog.cache import RunCache
    from sonarlog.diff import Tolerance
    from sonarlog.diff.gate import Condition
    from sonarlog.diff.outcome import Outcome
    from sonarlog.runs import Run
    from sonarlog.sides import RunFile, Version

    Pair = tuple[str, RunFile | Version, RunFile | Version]


@click.command("diff")
@click.argument("sides", nargs=-1, required=True, metavar="A B | RECORDING…")
@click.option(
    "--against", metavar="REV", help="Diff each RECORDING's run by git revision REV (A) with one made now (B)."
)
@click.option("--algorithms", metavar="A,B", help="Replay the RECORDING with both, then diff.")
@click.option("--algorithm", metavar="NAME", help="With --against: which algorithm; default: each revision's own.")
@click.option("--robot", metavar="NAME|FILE", help="Take the replayed RECORDING for this robot, not for its own.")
@click.option("--tolerance", metavar="5mm,0.1deg,20cells", help="Count what differs by no more than this as the same.")
@click.option(
    "--fail-on", "conditions", multiple=True, metavar="COND…", help="Exit with 1 only if this holds, as 'ate>+5%'."
)
@click.option("--png", type=FILE, help="Also draw A, B laid on A, and the difference.")
@click.option("--html", type=FILE, help="Also write a page with maps, walls, plots and the first difference in full.")
@click.option(
    "--viz",
    is_flag=False,
    flag_value=WINDOW,
    metavar="[FILE.rrd]",
    help="Also show A, B and the difference in Rerun's viewer, or save that to a file.",
)
@click.option("--junit", type=FILE, help="Also write the result as JUnit XML, for CI; overwrites.")
@force
@as_json
@quiet
@click.option("-v", "--verbose", is_flag=True, help="Also what each block took, where both runs keep it.")
def command(
    sides: tuple[str, ...],
    against: str | None,
    algorithms: str | None,
    algorithm: str | None,
    robot: str | None,
    tolerance: str | None,
    conditions: tuple[str, ...],
    png: Path | None,
    html: Path | None,
    viz: str | None,
    junit: Path | None,
    force: bool,
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Say what differs between two runs of one recording.

    A side is a run, or RECORDING@ALGORITHM[:key=value,…], or RECORDING@git:REV[:ALGORITHM]; git:WORKTREE is the files
    as they are now. What is replayed on the way is kept (`sonarlog cache`).

    Exit code 0: the same, 1: they differ, 2: they cannot be compared. With --fail-on: 1 only if a condition holds.

    \b
    Example:
      sonarlog diff corridor.odometry.run.mcap corridor.paper.run.mcap --png corridor.png
      sonarlog diff recordings/corridor.mcap@paper recordings/corridor.mcap@git:HEAD~3:paper
      sonarlog diff recordings/corridor.mcap --algorithms literal,paper
      sonarlog diff recordings/*.mcap --against main --fail-on "ate>+5%" "walls.gone>0"
    """
    from sonarlog.cache import RunCache
    from sonarlog.diff import Tolerance
    from sonarlog.diff.gate import Condition, is_condition

    if viz not in (None, WINDOW) and not str(viz).endswith(".rrd"):
        sides, viz = (str(viz), *sides), WINDOW  # `diff --viz A B`
    # `--fail-on A B C`: click gives an option one word; the others come as sides.
    files = [side for side in sides if not (conditions and is_condition(side))]
    words = [*conditions, *(side for side in sides if side not in files)]
    gate = [Condition.parse(word) for word in words]
    near = Tolerance.parse(tolerance) if tolerance else None
    pairs = _of_robot(_pairs(files, against, algorithms, algorithm), robot)
    written = Files(png, html, viz, junit, force)
    written.check(len(pairs))
    cache = RunCache.of(os.environ)
    many = against is not None and len(pairs) > 1
    outcomes = []
    for k, pair in enumerate(pairs):
        if many and not quiet:
            click.echo(f"{k + 1} of {len(pairs)}: {pair[0]}", err=True)
        outcomes.append(compared(pair, cache, gate, near, many=many, quiet=quiet))
    written.write(outcomes)
    _say(outcomes, many=many, as_json=as_json, verbose=verbose)
    return 1 if any(outcome.bad for outcome in outcomes) else 0


def _pairs(files: Sequence[str], against: str | None, algorithms: str | None, algorithm: str | None) -> "list[Pair]":
    """What is held against what. Raises UsageError, BadSide."""
    from sonarlog.sides import RunFile, parse_side, version

    if against is not None:
        if algorithms or not files:
            raise click.UsageError("with --against: recordings and one revision, such as --against main")
        parsed = [parse_side(file) for file in files]
        sides = [version(side.path, algorithm or "") if isinstance(side, RunFile) else side for side in parsed]
        return [(file, side.at(against), side) for file, side in zip(files, sides, strict=True)]
    if algorithm:
        raise click.UsageError("--algorithm goes with --against; a side names its own: RECORDING@ALGORITHM")
    if algorithms:
        names = [name.strip() for name in algorithms.split(",")]
        if len(files) != 1 or len(names) != 2:
            raise click.UsageError("with --algorithms: one recording and two names, such as --algorithms literal,paper")
        return [(files[0], version(Path(files[0]), names[0]), version(Path(files[0]), names[1]))]
    if len(files) != 2:
        raise click.UsageError("which runs? two, or recordings with --against REV, or one with --algorithms A,B")
    return [(f"{files[0]} {files[1]}", parse_side(files[0]), parse_side(files[1]))]


def _of_robot(pairs: "list[Pair]", robot: str | None) -> "list[Pair]":
    """The same, of a robot given. Raises UsageError for runs, which have been replayed as some robot already."""
    from dataclasses import replace

    from sonarlog.sides import RunFile

    if robot is None:
        return pairs
    given: list[Pair] = []
    for name, a, b in pairs:
        if isinstance(a, RunFile) or isinstance(b, RunFile):
            raise click.UsageError("--robot goes with sides that are replayed: RECORDING@ALGORITHM, --against, …")
        given.append((name, replace(a, robot=robot), replace(b, robot=robot)))
    return given


def compared(
    pair: "Pair",
    cache: "RunCache",
    gate: "Sequence[Condition]",
    tolerance: "Tolerance | None",
    *,
    many: bool = False,
    quiet: bool = False,
) -> "Outcome":
    """Both runs, made where they must be, and what differs. Of many, one that fails does not stop the rest."""
    from slam.errors import SlamError
    from sonarlog.diff import diff_runs
    from sonarlog.diff.gate import BadCondition
    from sonarlog.diff.outcome import Outcome, judged
    from sonarlog.errors import SonarlogError
    from sonarlog.sides import Version

    name, *sides = pair
    asked = (str(sides[0]), str(sides[1]))
    labels = (sides[0].label, sides[1].label) if sides[0].label != sides[1].label else asked
    names = labels if any(isinstance(side, Version) for side in sides) and labels[0] != labels[1] else None
    try:
        a, b = _both(sides[0], sides[1], cache, quiet=quiet)
        now = cache.made(a.path), cache.made(b.path)
        report = diff_runs(a, b, names=names, asked=asked, now=now, tolerance=tolerance)
        return judged(name, report, gate)
    except BadCondition:
        raise
    except (SonarlogError, SlamError) as error:
        if not many:
            raise
        return Outcome(name, None, str(error))


def _both(a: "RunFile | Version", b: "RunFile | Version", cache: "RunCache", *, quiet: bool) -> "tuple[Run, Run]":
    """Both runs; what another revision replays in a process of its own does not keep the other side waiting."""
    from concurrent.futures import ThreadPoolExecutor

    from sonarlog.making import run_of
    from sonarlog.sides import Version

    if a == b:
        run = _run(a, cache, quiet=quiet)
        return run, run
    if isinstance(a, Version) and a.revision and isinstance(b, Version):
        with ThreadPoolExecutor(1) as pool:
            soon = pool.submit(run_of, a, cache, None, time.thread_time_ns)
            made = _run(b, cache, quiet=quiet)
            return soon.result(), made
    return _run(a, cache, quiet=quiet), _run(b, cache, quiet=quiet)


def _run(side: "RunFile | Version", cache: "RunCache", *, quiet: bool) -> "Run":
    from cli.progress import progress
    from cli.watching import Watch
    from sonarlog.making import run_of

    with progress(f"replaying {side}", quiet=quiet) as advance:
        return run_of(side, cache, Watch(advance), time.thread_time_ns)


def _say(outcomes: "Sequence[Outcome]", *, many: bool, as_json: bool, verbose: bool) -> None:
    from cli.diff_text import tell, tell_many
    from sonarlog.diff.outcome import summary

    if as_json and many:
        click.echo(json.dumps({"summary": summary(outcomes), "outcomes": [o.as_dict() for o in outcomes]}, indent=2))
    elif as_json:
        report = outcomes[0].report
        data = report.as_dict() if report else {}
        click.echo(json.dumps({**data, "reasons": list(outcomes[0].reasons)}, indent=2))
    elif many:
        tell_many(outcomes)
    else:
        tell(outcomes[0], verbose=verbose)
