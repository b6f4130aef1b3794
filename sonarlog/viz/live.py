"""A recording as it is made, drawn by a thread of its own: what the viewer has no time for is left out.

Nobody ever waits for it. Must not know: Rerun, ports, files.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Event as Flag
from threading import Thread
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sonarlog.decode import Reading, Sample
from sonarlog.log import Event
from sonarlog.protocol.packets import Sip
from sonarlog.robot import Robot
from sonarlog.viz.layout import Layout, exploring_layout, live_layout
from sonarlog.viz.shapes import GREY, Dots, Shape, Strips

if TYPE_CHECKING:
    from slam.pipeline import Step
    from sonarlog.viz.native import Viewer
    from sonarlog.viz.rerun_door import Canvas

EVERY_S = 0.2
WAITING = 4096  # samples and events that may wait; then the oldest are left out
A_PIECE = 500  # echoes, or poses, drawn as one thing: only the newest piece is sent again
CLOSE_S = 5.0
RADIANS = 6.283185307179586 / (1 << 20)
BLUE, GREEN = (0, 114, 178), (0, 158, 115)


class Stage(Protocol):
    """Where a live view is shown."""

    def show(self, t_ns: int, shapes: Mapping[str, Shape], numbers: Mapping[str, float]) -> None:
        """What is new at that time."""

    def say(self, event: Event) -> None:
        """An event."""

    def write(self, t_ns: int, text: str) -> None:
        """What was decided, as Markdown."""

    def turn(self, heading: float) -> None:
        """From now on that heading of the map, in rad, points to the right."""

    def finish(self) -> None:
        """Send what is left."""


class Drawing(Protocol):
    """Makes shapes of what is recorded."""

    def samples(self, samples: Sequence[tuple[Sample, Robot]]) -> dict[str, Shape]:
        """Of SIPs, oldest first, what is to be drawn anew."""

    def step(self, step: "Step") -> tuple[dict[str, Shape], str, float | None]:
        """Of a step shapes and words, and a heading that is to point to the right, if that is known only now."""


class CanvasStage:
    """A stage on a canvas."""

    def __init__(self, canvas: "Canvas", layout: Layout) -> None:
        self._canvas, self._layout = canvas, layout
        canvas.lay_out(layout)

    def show(self, t_ns: int, shapes: Mapping[str, Shape], numbers: Mapping[str, float]) -> None:
        """What is new at that time."""
        self._canvas.at(t_ns=t_ns)
        self._canvas.draw(shapes)
        self._canvas.numbers(numbers)

    def say(self, event: Event) -> None:
        """An event."""
        self._canvas.at(t_ns=event.t_ns)
        self._canvas.say("events", event.text, event.level)

    def write(self, t_ns: int, text: str) -> None:
        """What was decided, as Markdown."""
        self._canvas.at(t_ns=t_ns)
        self._canvas.write("decision", text)

    def turn(self, heading: float) -> None:
        """From now on that heading of the map, in rad, points to the right."""
        self._canvas.lay_out(self._layout, heading)

    def finish(self) -> None:
        """Send what is left. Raises CannotSave."""
        self._canvas.finish()


def live_stage(
    title: str,
    path: Path | str | None = None,
    *,
    viewer: "Viewer | None" = None,
    force: bool = False,
    exploring: bool = False,
) -> CanvasStage:
    """To a viewer (None: one in its own window), or to an .rrd file. Raises NoViewer, CannotSave."""
    from sonarlog.viz.rerun_door import canvas

    application = "sonarlog_explore" if exploring else "sonarlog_live"  # a viewer keeps one layout for each
    made = canvas(title, path, viewer=viewer, force=force, application=application)
    return CanvasStage(made, exploring_layout() if exploring else live_layout())


class LiveView:
    """Give it samples, steps, events from any thread; it never waits. `left_out` counts what there was no time for."""

    def __init__(self, stage: Stage, drawing: Drawing | None = None) -> None:
        """`drawing` None: echoes where odometry puts them."""
        self.left_out = 0
        self.failure: Exception | None = None
        self._stage = stage
        self._drawing = drawing or Traces()
        self._waiting: deque[tuple[Sample, Robot] | Event | Step] = deque(maxlen=WAITING)
        self._end = Flag()
        self._thread = Thread(target=self._work, name="live view", daemon=True)
        self._thread.start()

    def show(self, sample: Sample, robot: Robot) -> None:
        """A packet of a known robot."""
        if isinstance(sample.packet, Sip):
            self._offer((sample, robot))

    def tell(self, event: Event) -> None:
        """An event."""
        self._offer(event)

    def watch(self, step: "Step") -> None:
        """A step of the pipeline."""
        self._offer(step)

    def close(self) -> None:
        """Draw what is waiting and end; a viewer that hangs is left alone after some seconds."""
        self._end.set()
        self._thread.join(CLOSE_S)

    def _offer(self, item: "tuple[Sample, Robot] | Event | Step") -> None:
        self.left_out += len(self._waiting) == WAITING
        self._waiting.append(item)

    def _work(self) -> None:
        try:
            while not self._end.wait(EVERY_S):
                self._draw()
            self._draw()
            self._stage.finish()
        except Exception as error:  # a viewer that was closed must not end a recording
            self.failure = error
            self._waiting.clear()

    def _draw(self) -> None:
        samples: list[tuple[Sample, Robot]] = []
        while self._waiting:
            item = self._waiting.popleft()
            if isinstance(item, Event):
                self._stage.say(item)
            elif isinstance(item, tuple):
                samples.append(item)
            else:
                self._draw_samples(samples)
                samples = []
                self._draw_step(item)
        self._draw_samples(samples)

    def _draw_samples(self, samples: list[tuple[Sample, Robot]]) -> None:
        if not samples:
            return
        last = samples[-1][0]
        assert isinstance(last.packet, Sip)
        tenths = last.packet.extra("battery_x10") or last.packet.battery
        self._stage.show(last.t_ns, self._drawing.samples(samples), {"plots/battery/volts": tenths / 10})

    def _draw_step(self, step: "Step") -> None:
        t_ns = int(step.sweep.t_ns[-1])
        shapes, words, heading = self._drawing.step(step)
        if heading is not None:
            self._stage.turn(heading)
        self._stage.show(t_ns, shapes, {})
        self._stage.write(t_ns, words)


class Traces:
    """Echoes where odometry puts them, and the way by it."""

    def __init__(self) -> None:
        self._echoes = _Piecewise()
        self._path = _Piecewise()

    def samples(self, samples: Sequence[tuple[Sample, Robot]]) -> dict[str, Shape]:
        """The robot, and what has been added to way and echoes."""
        for sample, known in samples:
            assert sample.pose is not None
            self._path.add((sample.pose.x_um / 1e6, sample.pose.y_um / 1e6))
            for echo in echoes_of(sample, known):
                self._echoes.add(echo)
        shapes: dict[str, Shape] = {"map/odometry/robot": _outline(*samples[-1])}
        for number, points in self._echoes.changed():
            shapes[f"map/readings/{number}"] = Dots(points, BLUE)
        for number, points in self._path.changed():
            shapes[f"map/odometry/path/{number}"] = Strips([points], [GREY])
        return shapes

    def step(self, step: "Step") -> tuple[dict[str, Shape], str, float | None]:
        """Nothing is made of steps."""
        return {}, "", None


class _Piecewise:
    """A growing list of points, cut into pieces so that only the end has to be sent again."""

    def __init__(self) -> None:
        self._pieces: list[list[tuple[float, float]]] = [[]]
        self._first_changed = 0

    def add(self, point: tuple[float, float]) -> None:
        if len(self._pieces[-1]) >= A_PIECE:
            self._pieces.append([self._pieces[-1][-1]])  # so that a line goes on
        self._pieces[-1].append(point)

    def changed(self) -> list[tuple[int, "np.ndarray[tuple[int, ...], np.dtype[np.float64]]"]]:
        """Number and points of each piece that has changed since this was asked last."""
        begin, self._first_changed = self._first_changed, len(self._pieces) - 1
        found = [(k, np.array(self._pieces[k])) for k in range(begin, len(self._pieces)) if self._pieces[k]]
        self._pieces[: self._first_changed] = [[]] * self._first_changed  # the viewer has them
        return found


def echoes_of(sample: Sample, robot: Robot) -> list[tuple[float, float]]:
    """Where a SIP's echoes lie on their beams' axes, by odometry, metres."""
    return [_echo(robot, reading) for reading in sample.readings if reading.range_mm < robot.max_range_mm]


def _echo(robot: Robot, reading: Reading) -> tuple[float, float]:
    """Where the echo lies on the beam's axis."""
    sonar = robot.sonars[reading.sonar]
    heading = reading.pose.heading * RADIANS
    ray = heading + np.radians(sonar.heading_deg)
    x = sonar.x_mm * np.cos(heading) - sonar.y_mm * np.sin(heading) + reading.range_mm * np.cos(ray)
    y = sonar.x_mm * np.sin(heading) + sonar.y_mm * np.cos(heading) + reading.range_mm * np.sin(ray)
    return reading.pose.x_um / 1e6 + x / 1e3, reading.pose.y_um / 1e6 + y / 1e3


def _outline(sample: Sample, robot: Robot) -> Strips:
    """The robot: a circle, and a line to where it looks."""
    assert sample.pose is not None
    x, y, heading = sample.pose.x_um / 1e6, sample.pose.y_um / 1e6, sample.pose.heading * RADIANS
    angles = heading + np.linspace(0, 2 * np.pi, 25)
    circle = np.stack([x + np.cos(angles) * robot.radius_mm / 1e3, y + np.sin(angles) * robot.radius_mm / 1e3], axis=1)
    return Strips([np.concatenate([[[x, y]], circle])], [GREEN], width=2.5)
