"""`sonarlog check`: is this recording sound, and what of it is usable."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.options import FILE, as_json

if TYPE_CHECKING:
    from sonarlog.check import Report


@click.command("check")
@click.argument("file", type=FILE)
@as_json
def command(file: Path, as_json: bool) -> int:
    """Check a recording: its structure and checksums, every byte of its wire, times, odometry, sonars and sweeps.

    Exit codes: 0 sound, 1 something is wrong, 2 it is no recording.

    \b
    Example:
      sonarlog check corridor.mcap
    """
    from sonarlog.check import check

    report = check(file)
    if as_json:
        click.echo(json.dumps(report.as_dict(), indent=2))
    else:
        _show(report)
    return 0 if report.sound else 1


def _show(report: "Report") -> None:
    lines = [("recording", report.path)]
    if report.received and report.sent:
        lines += [("received", report.received.text()), ("sent", report.sent.text())]
    if report.timing:
        t = report.timing
        text = f"{t.sips} SIPs, one every {t.cycle_ms:.1f} ms ({t.drift_ppm:+d} ppm), 99 % within {t.p99_ms:.0f} ms"
        lines.append(("time", f"{text}, longest wait {t.longest_ms:.0f} ms, {t.missed} missed, {t.bursts} in bursts"))
    lines.append(("odometry", f"{report.sessions} sessions, {report.wraps} wraps"))
    for sonar in report.sonars:
        text = f"{sonar.readings} readings, {100 * sonar.echo_rate:.0f} % with echo, median {sonar.median_mm} mm"
        lines.append((f"sonar {sonar.number}", text))
    lines += [(f"sweep {number}", sweep.text()) for number, sweep in enumerate(report.sweeps)]
    lines += [(finding.level, f"{finding.part}: {finding.text}") for finding in report.findings]
    usable = sum(sweep.usable for sweep in report.sweeps)
    verdict = "sound" if report.sound else "something is wrong"
    lines.append(("verdict", f"{verdict}; {usable} of {len(report.sweeps)} sweeps usable"))
    for label, text in lines:
        click.echo(f"{label:<10}  {text}")
