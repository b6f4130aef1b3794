"""sonarlog bisect."""

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cli.options import FILE

if TYPE_CHECKING:
    from sonarlog.bisect import Judge
    from sonarlog.cache import RunCache
    from sonarlog.diff import Report
    from sonarlog.diff.gate import Condition
    from sonarlog.sides import Version

LETTERS = "ABCDEFGHI"


@click.command("bisect")
@click.argument("recording", type=FILE)
@click.argument("revisions", metavar="GOOD..BAD")
@click.argument("options", nargs=-1, type=click.UNPROCESSED, metavar="[-- DIFF OPTIONS]")
@click.option("--block", type=click.Choice(list(LETTERS)), help="Bad: this block's results are not those of GOOD.")
@click.option("--algorithm", metavar="NAME", help="Which algorithm; default: each revision's own.")
def command(recording: Path, revisions: str, options: tuple[str, ...], block: str | None, algorithm: str | None) -> int:
    """Find the first git revision after GOOD, up to BAD, that gives another result, and say what differs there.

    Bad is what differs from GOOD's run: in any block, in one (--block), by more than a --tolerance, or by a --fail-on
    condition; both go behind `--` with the other options of `sonarlog diff`, which tells the result. Revisions that do
    not run are skipped, those that leave slam/ and sonarlog/ alone are not tried. Runs are kept (`sonarlog cache`).

    \b
    Example:
      sonarlog bisect recordings/corridor.mcap v0.1..HEAD --block E
      sonarlog bisect recordings/corridor.mcap v0.1..HEAD -- --fail-on "ate>+5%" --png worse.png
    """
    from cli import diff
    from sonarlog.bisect import bisect
    from sonarlog.cache import RunCache
    from sonarlog.revision import repository, subject
    from sonarlog.revision import revisions as between
    from sonarlog.sides import Version

    good, dots, bad = revisions.partition("..")
    if not good or not dots or not bad or bad.startswith("."):
        raise click.UsageError(f"revisions are written GOOD..BAD, not {revisions!r}")
    asked = _diff_options(diff.command, options)
    if block and (asked["conditions"] or asked["tolerance"]):
        raise click.UsageError("a revision is bad by --block, or by what stands behind --, not by both")
    where = repository()
    listed = between(good, bad, where)
    judge = _judge(Version(recording, algorithm), good, block, asked, RunCache.of(os.environ))
    found = bisect(good, listed, judge)
    sides = [
        f"{recording}@git:{revision}{f':{algorithm}' if algorithm else ''}" for revision in (found.good, found.bad)
    ]
    # With --json stdout is the diff's alone.
    click.echo(f"first bad revision: {subject(found.bad, where)}", err=bool(asked["as_json"]))
    if found.between:
        names = ", ".join(revision[:12] for revision in found.between)
        click.echo(f"or one of these, which do not run: {names}", err=True)
    click.echo(f"{found.tried} of {len(listed)} revisions tried; the last good one is {found.good[:12]}", err=True)
    with diff.command.make_context("diff", [*sides, *options]) as context:
        diff.command.invoke(context)
    return 0


def _diff_options(diff: click.Command, options: tuple[str, ...]) -> dict[str, Any]:
    """What stands behind `--`, read as `sonarlog diff` reads it. Raises UsageError."""
    with diff.make_context("diff", ["A", "B", *options]) as context:
        return context.params


def _judge(version: "Version", good: str, block: str | None, asked: dict[str, Any], cache: "RunCache") -> "Judge":
    """What says of a revision whether it is bad, against GOOD's run, and tells on stderr what it found."""
    from slam.errors import SlamError
    from sonarlog.diff import Tolerance, diff_runs
    from sonarlog.diff.gate import BadCondition, Condition, is_condition
    from sonarlog.errors import SonarlogError
    from sonarlog.making import run_of

    words = [*asked["conditions"], *(side for side in asked["sides"] if asked["conditions"] and is_condition(side))]
    gate = [Condition.parse(word) for word in words]
    tolerance = Tolerance.parse(asked["tolerance"]) if asked["tolerance"] else None
    reference = run_of(version.at(good), cache, None, time.thread_time_ns)
    letters = block or LETTERS

    def judge(revision: str) -> bool | None:
        try:
            run = run_of(version.at(revision), cache, None, time.thread_time_ns)
            if gate or tolerance:
                report = diff_runs(reference, run, tolerance=tolerance)
                bad = _too_much(gate, report)
            else:
                mine, yours = ([[s.digests[x] for x in letters] for s in each.sweeps] for each in (reference, run))
                bad = mine != yours or (block is None and reference.map_digest != run.map_digest)
        except BadCondition:
            raise
        except (SonarlogError, SlamError) as error:
            click.echo(f"{revision[:12]}  skipped: {error}", err=True)
            return None
        click.echo(f"{revision[:12]}  {'bad' if bad else 'good'}", err=True)
        return bad

    return judge


def _too_much(gate: "list[Condition]", report: "Report") -> bool:
    if gate:
        return any(condition.reason(report) for condition in gate)
    return report.verdict == "changed"
