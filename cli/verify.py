"""sonarlog verify."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from cli.options import FILE, FOLDER, as_json, force, quiet

if TYPE_CHECKING:
    from sonarlog.apart import Apart
    from sonarlog.exploring.reproduction import Reproduced
    from sonarlog.runs import Run
    from sonarlog.verify import Parting, Verified

SHOWN = 5


@click.command("verify")
@click.argument("path", type=FILE, metavar="RUN")
@click.argument("recording", type=FILE, required=False)
@click.option("--code", metavar="git:REV|run", help="Replay with the code of a git revision, or of the run's own.")
@click.option("--jobs", type=click.IntRange(1), default=1, metavar="N", help="Check a run with checkpoints in N parts.")
@click.option("--dump", "folder", type=FOLDER, help="Write the first differing block's inputs and outputs here.")
@force
@as_json
@quiet
def command(
    path: Path,
    recording: Path | None,
    code: str | None,
    jobs: int,
    folder: Path | None,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Replay the recording of a RUN again and say whether everything is the same to the bit.

    Of a run that is not, the first sweep and block that differ, and how far apart. The RECORDING is looked for where
    the run says, and beside it. Exit code 0: identical, 1: it differs, 2: it cannot be checked.

    \b
    Example:
      sonarlog verify corridor.paper.run.mcap
      sonarlog verify corridor.paper.run.mcap --code run --dump apart
    """
    from sonarlog.runs import read_run
    from sonarlog.verify import Verified, compare, dump, find_recording

    run = read_run(path)
    revision = _revision(run, code)
    _warn(run, revision)
    recording = find_recording(run, recording)
    if jobs > 1 and revision is None and _same_in_parts(run, recording, jobs):
        same = Verified((len(run.sweeps), len(run.sweeps)), (run.digest, run.digest), None, 0.0, 0.0, 0)
        _say(same, as_json=as_json)
        return 0
    with _again(run, recording, revision, quiet=quiet) as (again, explored):
        found = compare(run, again)
    if folder is not None and found.first is not None:
        written = dump(found.first, folder, force=force)
        click.echo(f"written: {', '.join(map(str, written))}", err=True)
    _say(found, explored, as_json=as_json)
    return 0 if found.same and (explored is None or explored.same) else 1


def _say(found: "Verified", explored: "Reproduced | None" = None, *, as_json: bool) -> None:
    if as_json:
        told_of = {} if explored is None else {"decisions": {"same": explored.same, **vars(explored)}}
        click.echo(json.dumps(found.as_dict() | told_of, indent=2))
        return
    _tell(found)
    if explored is not None:
        click.echo(f"decisions: {explored.told()}")


def _same_in_parts(run: "Run", recording: Path, jobs: int) -> bool:
    """Whether every stretch between the run's checkpoints comes out the same, each in a process of its own.

    What differs somewhere is then found by a replay of the whole.
    """
    from concurrent.futures import ProcessPoolExecutor
    from itertools import repeat
    from multiprocessing import get_context

    from slam.algorithms import algorithm
    from sonarlog.checkpoints import stretch_is_same, stretches
    from sonarlog.runs import identify

    count = len(stretches(run))
    if count == 1:
        click.echo(f"sonarlog: {run.path} keeps no checkpoints: checked in one part", err=True)
        return False
    chosen = algorithm(run.identity.algorithm).configured(run.identity.config)
    if identify(run.identity.recording_digest, chosen, run.identity.given_robot).asked() != run.identity.asked():
        return False
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        parts = pool.map(stretch_is_same, repeat(recording), repeat(chosen), repeat(run.path), range(count))
        return all(parts)


def _revision(run: "Run", code: str | None) -> str | None:
    """The git revision that --code asks for; None for the code at hand."""
    if code is None:
        return None
    if code == "run":
        commit = run.machine.get("git_commit")
        if not commit:
            raise click.UsageError(f"{run.path} does not say which commit made it; give --code git:REV")
        return commit
    kind, _, revision = code.partition(":")
    if kind != "git" or not revision:
        raise click.UsageError(f"--code takes git:REV or run, not {code!r}")
    return revision


def _warn(run: "Run", revision: str | None) -> None:
    from sonarlog.provenance import code_digest

    if revision is None and run.identity.code_digest != code_digest():
        hint = " (--code run replays with it)" if run.machine.get("git_commit") else ""
        click.echo(f"sonarlog: warning: {run.path} was made by other code than this{hint}", err=True)
    if revision is not None and revision == run.machine.get("git_commit") and run.machine.get("git_dirty") == "true":
        click.echo(f"sonarlog: warning: slam/ had been changed after commit {revision[:12]}", err=True)


@contextmanager
def _again(
    run: "Run", recording: Path, revision: str | None, *, quiet: bool
) -> "Iterator[tuple[Run, Reproduced | None]]":
    """The run made anew, and, of an exploration, whether it decides as it did."""
    from cli.progress import progress
    from cli.watching import Watch
    from slam.algorithms import algorithm
    from sonarlog.replay import replay
    from sonarlog.revision import code_of, replay_with
    from sonarlog.runs import read_run

    asked = run.identity
    explored = None
    with TemporaryDirectory(prefix="sonarlog-") as folder, progress("replaying", quiet=quiet) as advance:
        output = Path(folder) / "again.run.mcap"
        if revision is None:
            chosen = algorithm(asked.algorithm).configured(asked.config)
            replayed = replay(recording, chosen, output, watcher=Watch(advance), robot=asked.given_robot)
            explored = replayed.reproduced
        elif asked.robot is not None:
            raise click.UsageError(f"{run.path} is of a robot given to it, which --code cannot tell: leave --code out")
        else:
            with code_of(revision) as code:
                unknown = replay_with(code, recording, asked.algorithm, asked.config, output)
            if unknown:
                click.echo(f"sonarlog: warning: that revision knows no {', '.join(unknown)}", err=True)
        yield read_run(output), explored


def _tell(found: "Verified") -> None:
    first = found.first
    if first is None:
        click.echo(f"identical: {found.sweeps[0]} sweeps, digest {found.digests[0]}")
        return
    if first.block:
        letter = f" (block {first.block})" if first.block.isupper() else ""
        click.echo(f"differs first at sweep {first.sweep}, {first.name}{letter}: {first.words}")
    else:
        click.echo(f"differs in {first.name}: {first.words}")
    _tell_values(first)
    click.echo(
        f"by the end: poses up to {found.position_mm:.3g} mm and {found.heading_deg:.3g}° apart, "
        f"{found.cells} cells of the map differ"
    )


def _tell_values(first: "Parting") -> None:
    if first.outputs[0] is None:
        click.echo("  the run keeps no values of it")
        return
    by = f", floats by up to {first.ulps} ulp" if first.ulps is not None else ""
    count = len(first.differences)
    click.echo(f"  {count} {'value differs' if count == 1 else 'values differ'}{by}")
    for each in first.differences[:SHOWN]:
        click.echo(f"  {_value(each)}")
    if count > SHOWN:
        click.echo(f"  … and {count - SHOWN} more")


def _value(each: "Apart") -> str:
    ulps = f" ({each.ulps} ulp)" if each.ulps is not None else ""
    return f"{each.where}: {each.a!r} in the run, {each.b!r} in the replay{ulps}"
