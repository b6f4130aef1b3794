"""`sonarlog explore`: the robot decides by itself where to go."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cli import options
from cli.live_line import LiveLine
from cli.recording import POSITIVE, interrupts, live, plan_of, record, recording_options

if TYPE_CHECKING:
    from slam.algorithms import Algorithm
    from sonarlog.exploring.explorer import Explorer, Limits
    from sonarlog.robot import Robot

ASKED = "you asked for it"


@click.command("explore")
@recording_options
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
        explorers.append(Explorer(robot, chosen, limits, watch=view.watch if view else None))
        return explorers[-1]

    plan = plan_of(settings, mover=made, recovers=True)
    line = LiveLine(quiet=settings["quiet"], verbose=settings["verbose"], talk=("station", "the exploration"))
    watched = live(settings["viz"], output.name, force=settings["force"], exploring=True)
    with watched as view, interrupts() as asked, line:

        def stop() -> bool:
            """Home first, if that is wanted and nobody insists."""
            if asked() == 1 and limits.come_back and explorers:
                explorers[0].ask_end(ASKED)
                return line.lost
            return asked() > 0 or line.lost

        status = record(settings, plan, line, view, stop)
        why = ASKED if asked() else ""
        line.say(f"{output}: {_summary(explorers, status.t_ns, why)}")
    return 130 if asked() or line.lost else 0


def _limits(settings: dict[str, Any]) -> "Limits":
    from sonarlog.exploring.explorer import Limits
    from sonarlog.plan import SECOND

    return Limits(
        max_time_ns=int(settings["max_time"] * SECOND) if settings["max_time"] else None,
        max_distance_m=settings["max_distance"],
        min_volts=settings["min_volts"],
        come_back=settings["come_back"],
        speed_mm_s=settings["max_speed"],
        turn_deg_s=settings["max_turn"],
    )


def _summary(explorers: "list[Explorer]", t_ns: int, why: str) -> str:
    if not explorers:
        return "no robot was met"
    done = explorers[0]
    why = done.ended or why
    return f"{done.sweeps} scans, {done.metres:.1f} m in {t_ns / 1e9:.0f} s" + (f": {why}" if why else "")
