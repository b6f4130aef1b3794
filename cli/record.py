"""`sonarlog record`: drive a robot and record it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cli import options
from cli.live_line import LiveLine
from cli.recording import interrupts, live, record
from cli.watching import WINDOW

if TYPE_CHECKING:
    from sonarlog.recorder import Plan, Status


@click.command("record")
@click.option("--port", required=True, metavar="URL", help="/dev/ttyUSB0, socket://HOST:PORT or sim://WORLD?seed=1.")
@click.option("-o", "--output", required=True, type=options.FILE, help="The recording to write, NAME.mcap.")
@click.option("--route", metavar="TEXT|FILE", help="What to drive; see above.")
@click.option("--drive", type=click.Choice(["route", "none"]), default="route", help="none: record without moving.")
@click.option("--max-stations", type=click.IntRange(1), default=40, show_default=True, help="Scans without --route.")
@click.option(
    "--spacing", type=click.FloatRange(0.1, 5), default=0.8, show_default=True, help="Metres from scan to scan."
)
@click.option("--time", "limit", type=click.FloatRange(0, min_open=True), metavar="SECONDS", help="End after so long.")
@click.option("--robot", metavar="NAME|FILE", help="Robot parameters, if not those of the type it says it is.")
@click.option("--baud", type=int, default=9600, show_default=True, help="Of a serial line.")
@click.option(
    "--speed",
    type=click.FloatRange(0, min_open=True),
    metavar="N",
    help="The robot at the port is a simulator that runs N times faster than real time.",
)
@click.option("--sim", is_flag=True, help="A simulator is meant: do not refuse one at a serial port.")
@click.option(
    "--give-up",
    type=click.FloatRange(0),
    default=60,
    show_default=True,
    metavar="SECONDS",
    help="How long to try to come back to a robot that is lost.",
)
@click.option(
    "--viz",
    is_flag=False,
    flag_value=WINDOW,
    metavar="[FILE.rrd]",
    help="Watch in Rerun's viewer while it is recorded, or save that to a file.",
)
@click.option("--lean", is_flag=True, help="A fifth of the size: the wire, and little beside it.")
@options.force
@options.quiet
@click.option("-v", "--verbose", is_flag=True, help="Tell every event, sweeps too.")
def command(
    port: str,
    output: Path,
    route: str | None,
    drive: str,
    max_stations: int,
    spacing: float,
    limit: float | None,
    robot: str | None,
    baud: int,
    speed: float | None,
    sim: bool,
    give_up: float,
    viz: str | None,
    lean: bool,
    force: bool,
    quiet: bool,
    verbose: bool,
) -> int:
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
    if speed is not None and port.startswith("sim://"):
        raise click.UsageError("the embedded robot's speed stands in its URL: sim://WORLD?speed=N")
    settings = dict(click.get_current_context().params, output=str(output))
    plan = _plan(settings)
    line = LiveLine(quiet=quiet, verbose=verbose)
    with live(viz, output.name, force=force) as view, interrupts() as asked, line:
        status = record(settings, plan, line, view, lambda: asked() > 0)
        line.say(f"{output}: {_summary(status)}")
    return 130 if asked() or line.lost else 0


def _plan(settings: dict[str, Any]) -> "Plan":
    from sonarlog.recorder import SECOND, Plan
    from sonarlog.robot import load_robot
    from sonarlog.route import default_route, parse_route

    route = None
    if settings["drive"] == "route":
        text = settings["route"]
        route = parse_route(_text(text)) if text else default_route(settings["spacing"], settings["max_stations"])
    elif settings["route"]:
        raise click.UsageError("--route says where to drive and --drive none not to: give one of them")
    return Plan(
        route,
        load_robot(settings["robot"]) if settings["robot"] else None,
        limit_ns=int(settings["limit"] * SECOND) if settings["limit"] else None,
        rate=settings["speed"] or 1.0,
        real="://" not in settings["port"] and not settings["sim"] and settings["speed"] is None,
    )


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
