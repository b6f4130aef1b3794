"""`sonarlog record`: drive a robot and record it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cli.live_line import LiveLine
from cli.recording import POSITIVE, interrupts, live, plan_of, record, recording_options

if TYPE_CHECKING:
    from sonarlog.plan import Plan
    from sonarlog.recorder import Status


@click.command("record")
@recording_options
@click.option("--route", metavar="TEXT|FILE", help="What to drive; see above.")
@click.option("--drive", type=click.Choice(["route", "none"]), default="route", help="none: record without moving.")
@click.option("--max-stations", type=click.IntRange(1), default=40, show_default=True, help="Scans without --route.")
@click.option(
    "--spacing", type=click.FloatRange(0.1, 5), default=0.8, show_default=True, help="Metres from scan to scan."
)
@click.option("--time", "limit", type=POSITIVE, metavar="SECONDS", help="End after so long.")
def command(**given: Any) -> int:
    """Drive the robot at a port and record its sweeps to an MCAP file.

    A route is text, or a file of it: steps separated by `;`.

    \b
      scan            turn on the spot by a full circle
      go METRES       straight on by odometry (backwards if negative)
      turn DEGREES    on the spot by odometry, counter-clockwise
      follow METRES   onwards in the middle of what the sonars see
      repeat N (…)    the steps in parentheses N times
      calibration M   squares of M metres (1) about here, both ways: for `sonarlog calibrate`

    `go` and `follow` stop before what the sonars see; inside a `repeat`, a way that is closed ends it. Without a
    route: scan, and follow what is open to the next scan, until the way ahead is closed.

    Ctrl-C finishes the file, stops the robot and closes it.

    \b
    Example:
      sonarlog record --port /dev/ttyUSB0 -o corridor.mcap
      sonarlog record --port sim://corridor?seed=3 -o sim.mcap --route "repeat 5 (scan; follow 0.8)"
    """
    settings = given | {"output": str(given["output"])}
    plan = _plan(settings)
    line = LiveLine(quiet=given["quiet"], verbose=given["verbose"])
    with live(given["viz"], given["output"].name, force=given["force"]) as view, interrupts() as asked, line:
        status = record(settings, plan, line, view, lambda: asked() > 0)
        line.say(f"{given['output']}: {_summary(status)}")
    return 130 if asked() or line.lost else 0


def _plan(settings: dict[str, Any]) -> "Plan":
    from sonarlog.plan import SECOND
    from sonarlog.route import default_route, parse_route

    route = None
    if settings["drive"] == "route":
        text = settings["route"]
        route = parse_route(_text(text)) if text else default_route(settings["spacing"], settings["max_stations"])
    elif settings["route"]:
        raise click.UsageError("--route says where to drive and --drive none not to: give one of them")
    limit_ns = int(settings["limit"] * SECOND) if settings["limit"] else None
    return plan_of(settings, route=route, limit_ns=limit_ns)


def _text(route: str) -> str:
    """The route itself, or what is in the file of that name."""
    path = Path(route)
    try:
        return path.read_text(encoding="utf-8") if len(route) < 256 and path.is_file() else route
    except (OSError, UnicodeDecodeError) as error:
        raise click.UsageError(f"cannot read the route in {route}: {error}") from None


def _summary(status: "Status") -> str:
    return (
        f"{status.sweeps} sweeps, {status.readings} readings, {status.sips} SIPs and {status.bad_packets} bad packets "
        f"in {status.t_ns / 1e9:.1f} s"
    )
