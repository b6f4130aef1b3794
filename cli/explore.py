"""`sonarlog explore`: the robot decides by itself where to go."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cli import options
from cli.live_line import LiveLine
from cli.recording import interrupts, live, record
from cli.watching import WINDOW

if TYPE_CHECKING:
    from slam.algorithms import Algorithm
    from sonarlog.exploring.explorer import Explorer, Limits
    from sonarlog.recorder import Plan
    from sonarlog.robot import Robot

POSITIVE = click.FloatRange(0, min_open=True)


@click.command("explore")
@click.option("--port", required=True, metavar="URL", help="/dev/ttyUSB0, socket://HOST:PORT or sim://WORLD?seed=1.")
@click.option("-o", "--output", required=True, type=options.FILE, help="The recording to write, NAME.mcap.")
@click.option("--algorithm", "name", help="By which it maps and decides; see `sonarlog algorithms`. Default: graph.")
@options.algorithm_settings
@click.option("--return", "come_back", is_flag=True, help="Drive back to the start at the end.")
@click.option("--max-time", type=POSITIVE, metavar="SECONDS", help="End the exploration after so long.")
@click.option("--max-distance", type=POSITIVE, metavar="METRES", help="End the exploration after so far a way.")
@click.option(
    "--min-volts",
    type=click.FloatRange(0),
    default=11.0,
    show_default=True,
    help="End the exploration when the battery has no more.",
)
@click.option("--max-speed", type=POSITIVE, default=300, show_default=True, metavar="MM/S", help="Forwards, at most.")
@click.option("--max-turn", type=POSITIVE, default=45, show_default=True, metavar="DEG/S", help="On the spot, at most.")
@click.option("--robot", metavar="NAME|FILE", help="Robot parameters, if not those of the type it says it is.")
@click.option("--baud", type=int, default=9600, show_default=True, help="Of a serial line.")
@click.option("--speed", type=POSITIVE, metavar="N", help="The robot at the port is a simulator, N times as fast.")
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
    help="Watch in Rerun's viewer while it explores, or save that to a file.",
)
@click.option("--lean", is_flag=True, help="A fifth of the size: the wire, and little beside it.")
@options.force
@options.quiet
@click.option("-v", "--verbose", is_flag=True, help="Tell every event, sweeps too.")
def command(**given: Any) -> int:
    """Let the robot at a port explore: scan, map, decide, drive to where it sees most that is new, and scan again.

    It ends by itself when nothing that it can reach is unknown. All is recorded as `record` does, the decisions too;
    `sonarlog replay` of the recording makes every one of them again, to the bit. Ctrl-C ends it; with --return the
    first one sends the robot home, the second one stops it there.

    \b
    Example:
      sonarlog explore --port sim://office?seed=1 -o office.mcap --viz
      sonarlog explore --port /dev/ttyUSB0 -o floor.mcap --return --max-time 1800
    """
    if given["speed"] is not None and given["port"].startswith("sim://"):
        raise click.UsageError("the embedded robot's speed stands in its URL: sim://WORLD?speed=N")
    from slam.algorithms import DEFAULT, algorithm

    config, changes = given.pop("config"), given.pop("changes")
    chosen = algorithm(given["name"] or DEFAULT).configured(options.settings_from(config, changes))
    settings = given | {"output": str(given["output"]), "algorithm": chosen.name, "changes": list(changes)}
    return _explore(settings, chosen)


def _explore(settings: dict[str, Any], chosen: "Algorithm") -> int:
    from sonarlog.exploring.explorer import Explorer

    output: Path = Path(settings["output"])
    limits = _limits(settings)
    explorers: list[Explorer] = []

    def made(robot: "Robot") -> Explorer:
        explorers.append(Explorer(robot, chosen, limits))
        return explorers[-1]

    line = LiveLine(quiet=settings["quiet"], verbose=settings["verbose"], talk=("station", "the exploration"))
    with live(settings["viz"], output.name, force=settings["force"]) as view, interrupts() as asked, line:

        def stop() -> bool:
            """Home first, if that is wanted and nobody insists."""
            if asked() == 1 and limits.come_back and explorers:
                explorers[0].ask_end("you asked for it")
                return line.lost
            return asked() > 0 or line.lost

        status = record(settings, _plan(settings, made), line, view, stop)
        line.say(f"{output}: {_summary(explorers, status.t_ns)}")
    return 130 if asked() or line.lost else 0


def _limits(settings: dict[str, Any]) -> "Limits":
    from sonarlog.exploring.explorer import Limits
    from sonarlog.recorder import SECOND

    return Limits(
        max_time_ns=int(settings["max_time"] * SECOND) if settings["max_time"] else None,
        max_distance_m=settings["max_distance"],
        min_volts=settings["min_volts"],
        come_back=settings["come_back"],
        speed_mm_s=settings["max_speed"],
        turn_deg_s=settings["max_turn"],
    )


def _plan(settings: dict[str, Any], made: Any) -> "Plan":
    from sonarlog.recorder import Plan
    from sonarlog.robot import load_robot

    return Plan(
        robot=load_robot(settings["robot"]) if settings["robot"] else None,
        mover=made,
        recovers=True,
        rate=settings["speed"] or 1.0,
        real="://" not in settings["port"] and not settings["sim"] and settings["speed"] is None,
    )


def _summary(explorers: "list[Explorer]", t_ns: int) -> str:
    if not explorers:
        return "no robot was met"
    done = explorers[0]
    why = f": {done.ended}" if done.ended else ""
    return f"{done.sweeps} scans, {done.metres:.1f} m in {t_ns / 1e9:.0f} s{why}"
