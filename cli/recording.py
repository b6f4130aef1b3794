"""What `record` and `explore` share: options, a live view, an interrupted loop that ends well, the recorder itself."""

import shlex
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

import click

from cli import options
from cli.live_line import LiveLine
from cli.watching import WINDOW

if TYPE_CHECKING:
    from sonarlog.log import Event, Surfaces
    from sonarlog.plan import Plan
    from sonarlog.recorder import Status
    from sonarlog.viz.live import Drawing, LiveView


POSITIVE = click.FloatRange(0, min_open=True)
Command = TypeVar("Command", bound=Callable[..., Any])


def recording_options(command: Command) -> Command:
    """Those of the port, the file, the robot and the talk, in the order of --help; `plan_of` and `record` read them."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


_OPTIONS = (
    click.option(
        "--port", required=True, metavar="URL", help="/dev/ttyUSB0, socket://HOST:PORT or sim://WORLD?seed=1."
    ),
    click.option("-o", "--output", required=True, type=options.FILE, help="The recording to write, NAME.mcap."),
    click.option("--robot", metavar="NAME|FILE", help="Robot parameters, if not those of the type it says it is."),
    click.option("--baud", type=int, default=9600, show_default=True, help="Of a serial line."),
    click.option("--speed", type=POSITIVE, metavar="N", help="The robot at the port is a simulator, N times as fast."),
    click.option("--sim", is_flag=True, help="A simulator is meant: do not refuse one at a serial port."),
    click.option(
        "--give-up",
        type=click.FloatRange(0),
        default=60,
        show_default=True,
        metavar="SECONDS",
        help="How long to try to come back to a robot that is lost.",
    ),
    click.option(
        "--viz",
        is_flag=False,
        flag_value=WINDOW,
        metavar="[FILE.rrd]",
        help="Watch in Rerun's viewer meanwhile, or save that to a file.",
    ),
    click.option("--lean", is_flag=True, help="A fifth of the size: the wire, and little beside it."),
    options.force,
    options.quiet,
    click.option("-v", "--verbose", is_flag=True, help="Tell every event, sweeps too."),
)


def plan_of(settings: dict[str, Any], **who: Any) -> "Plan":
    """The plan by the options above; `who` says who drives, and what else there is to say.

    Raises UsageError where they do not go together, and what loading a robot raises.
    """
    if settings["speed"] is not None and settings["port"].startswith("sim://"):
        raise click.UsageError("the embedded robot's speed stands in its URL: sim://WORLD?speed=N")
    from sonarlog.plan import Plan
    from sonarlog.robot import load_robot

    return Plan(
        robot=load_robot(settings["robot"]) if settings["robot"] else None,
        rate=settings["speed"] or 1.0,
        real="://" not in settings["port"] and not settings["sim"] and settings["speed"] is None,
        surfaces=_surfaces(settings["port"]),
        **who,
    )


def _surfaces(port: str) -> "Surfaces | None":
    """The true ones of a world file at the port. Raises what reading it raises."""
    if not port.startswith("sim://"):
        return None
    from sonarlog.sim.link import parse_url
    from sonarlog.sim.world import load_world

    return load_world(parse_url(port).world).surfaces()


@contextmanager
def live(viz: str | None, title: str, *, force: bool, exploring: bool = False) -> "Iterator[LiveView | None]":
    """The live view, its viewer opened and Rerun loaded before the port is."""
    if viz is None:
        yield None
        return
    from sonarlog.viz.live import LiveView, live_stage

    drawing: Drawing | None = None
    if exploring:
        from sonarlog.viz.growing import Growing

        drawing = Growing()
    path = None if viz == WINDOW else viz
    view = LiveView(live_stage(title, path, force=force, exploring=exploring), drawing)
    try:
        yield view
    finally:
        view.close()
    if view.failure or view.left_out:
        why = f": {view.failure}" if view.failure else ""
        click.echo(f"the live view left out {view.left_out} packets{why}; the recording has them all", err=True)


def record(
    settings: dict[str, Any], plan: "Plan", line: LiveLine, view: "LiveView | None", stop: Callable[[], bool]
) -> "Status":
    """Record by the plan to the file that the settings name, which stand in it; the last status.

    Raises what opening the port, writing the file and `sonarlog.recorder.Recorder.run` raise.
    """
    from sonarlog.connection import Again
    from sonarlog.recorder import Recorder
    from sonarlog.recording import RecordingWriter
    from sonarlog.transport import open_link, stable_name

    started_wall_ns, start_ns = time.time_ns(), time.monotonic_ns()
    with RecordingWriter(
        settings["output"],
        started_wall_ns=started_wall_ns,
        command_line=shlex.join(["sonarlog", *sys.argv[1:]]),
        config=settings,
        lean=settings["lean"],
        force=settings["force"],
    ) as writer:
        recorder: Recorder | None = None
        try:
            port = stable_name(settings["port"])
            call = partial(open_link, port, time.monotonic_ns, rate=plan.rate, baud=settings["baud"], start_ns=start_ns)
            link = call()
            again = None if link.waits else Again(call, time.sleep, settings["give_up"])
            see: dict[str, Any] = {}
            tell = line.tell
            if view is not None:
                see = {"show": view.show}
                tell = partial(_both, line.tell, view.tell)
            recorder = Recorder(
                link, writer, plan, wall_ns=time.monotonic_ns, again=again, report=line.show, tell=tell, **see
            )
            return recorder.run(lambda: stop() or line.lost)
        except Exception:
            if recorder is None or not recorder.heard:
                writer.abandon()  # there is nothing in it
            raise


def _both(first: "Callable[[Event], None]", second: "Callable[[Event], None]", event: "Event") -> None:
    first(event)
    second(event)


@contextmanager
def interrupts() -> Iterator[Callable[[], int]]:
    """Ctrl-C, SIGTERM and a lost terminal only say that it is time to stop, so that the file gets its end.

    Yields how often that was said.
    """
    asked = 0

    def ask(_number: int, _frame: FrameType | None) -> None:
        nonlocal asked
        asked += 1

    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        yield lambda: asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
