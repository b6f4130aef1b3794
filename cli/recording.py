"""What `record` and `explore` share: a live view, an interrupted loop that still ends well, and the recorder itself."""

import shlex
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

from cli.live_line import LiveLine
from cli.watching import WINDOW

if TYPE_CHECKING:
    from sonarlog.log import Event
    from sonarlog.recorder import Plan, Status
    from sonarlog.viz.live import LiveView


@contextmanager
def live(viz: str | None, title: str, *, force: bool) -> "Iterator[LiveView | None]":
    """The live view, its viewer opened and Rerun loaded before the port is."""
    if viz is None:
        yield None
        return
    from sonarlog.viz.live import LiveView, live_stage

    view = LiveView(live_stage(title, None if viz == WINDOW else viz, force=force))
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
