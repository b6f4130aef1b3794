"""The one door to Rerun: shapes to its archetypes, the layout, and where an inspection goes, viewer or file."""

import os
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from slam.geometry import Pose
from slam.pipeline import Step
from sonarlog.errors import SonarlogError
from sonarlog.log import Event, Floats, Log
from sonarlog.picture import BLUE, GREEN, PURPLE, UNKNOWN, VERMILLION
from sonarlog.viz.native import Viewer, start_viewer
from sonarlog.viz.scene import GREY, Scene, Shown, extent
from sonarlog.viz.shapes import Colour, Dots, Raster, Shape, Strips

SWEEP, TIME = "sweep", "time"
"""Timelines: the number of the sweep, and the time since the recording began."""

HERE = "map/here"
NEAR_M = 3.2
LAYERS = ("map/grid", "map/patch", "map/true", "map/chains", "map/frontier", "map/sweep", "map/readings", "map/goal",
          "map/odometry", "map/predicted", "map/corrected")  # fmt: skip
"""From the bottom to the top."""

SERIES: dict[str, tuple[str, Colour]] = {
    "plots/turn/turn_deg": ("turn, °", BLUE),
    "plots/shift/shift_cm": ("shift, cm", VERMILLION),
    "plots/d1/before_cm": ("before, cm", GREY),
    "plots/d1/after_cm": ("after, cm", GREEN),
    "plots/calibration/rotation_scale_percent": ("rotation scale, %", PURPLE),
    "plots/error/odometry_cm": ("raw odometry, cm", GREY),
    "plots/error/corrected_cm": ("corrected, cm", GREEN),
    "plots/heading_error/odometry_deg": ("raw odometry, °", GREY),
    "plots/heading_error/corrected_deg": ("corrected, °", GREEN),
}


class CannotSave(SonarlogError):
    """The inspection cannot be written."""


class Inspection:
    """A replay as it is shown: give it each step as it comes, and end with `finish`, or use it as a context manager."""

    def __init__(
        self, stream: rr.RecordingStream, title: str, log: Log, *, following: bool, path: Path | None = None
    ) -> None:
        """`path` is the file that it goes to, if it goes to one."""
        self._stream, self._log, self._following, self._path = stream, log, following, path
        self._scene = Scene(log.robot.radius_mm / 1000, log.surfaces)
        self._start_ns = int(log.odometry.t_ns[0]) if len(log.odometry.t_ns) else 0
        self._count = 0
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        stream.send_recording_name(title)
        for series, (name, colour) in SERIES.items():
            marks = rr.SeriesPoints(colors=colour, names=name, marker_sizes=3.0)
            stream.log(series, rr.SeriesLines(colors=colour, names=name, widths=1.5), marks, static=True)

    def add(self, step: Step, truth: Pose | None = None) -> None:
        """Show a step; `truth` is where the robot really was at its reference reading, in the recording's frame."""
        shown = self._scene.show(step, truth)
        if self._count == 0:
            self._begin(step, shown)
        moment = int(step.sweep.t_ns[step.sweep.reference]) - self._start_ns
        self._stream.set_time(SWEEP, sequence=self._count)
        self._stream.set_time(TIME, duration=np.timedelta64(moment, "ns"))
        for path, shape in shown.shapes.items():
            self._stream.log(path, *_archetypes(path, shape))
        for path, number in shown.numbers.items():
            self._stream.log(path, rr.Scalars(number))
        self._stream.log(HERE, rr.Transform3D(translation=[step.pose.x, step.pose.y, 0.0]))
        self._stream.log("blocks", rr.TextDocument(shown.text, media_type=rr.MediaType.MARKDOWN))
        self._count += 1

    def _begin(self, first: Step, shown: Shown) -> None:
        """Lay out what is to come, and fix which way is up in the map and in the view that follows the robot."""
        walls = shown.shapes.get("map/true/walls")
        low, high = extent(first, self._log.odometry, walls if isinstance(walls, Strips) else None)
        truth = "map/true/path" in shown.shapes
        self._stream.send_blueprint(_blueprint(low, high, truth=truth, following=self._following))
        upright = _upright(first.calibrated.odometry.theta)
        self._stream.log("map", rr.Transform3D(mat3x3=upright), static=True)
        self._stream.log(f"{HERE}/view", rr.Transform3D(mat3x3=upright.T), static=True)

    def finish(self) -> None:
        """Send what is left and let go of the viewer or file; a file that is incomplete is removed."""
        try:
            self._stream.flush()
        except RuntimeError as error:
            self.abandon()
            if self._path is None:
                raise CannotSave(f"the viewer was closed before it was shown everything ({error})") from None
            raise CannotSave(f"cannot write {self._path}: the disk is full, or refuses it ({error})") from None
        self._stream.disconnect()

    def abandon(self) -> None:
        """Let go of the viewer or file, and remove the file."""
        self._stream.disconnect()
        if self._path is not None:
            self._path.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        if kind is None:
            self.finish()
        else:
            self.abandon()


def inspect_live(title: str, log: Log, viewer: Viewer | None = None) -> Inspection:
    """Show what comes in a viewer: in one that runs already, else in the native one's own window.

    Raises NoViewer where there is no display.
    """
    viewer = viewer or start_viewer()
    stream = rr.RecordingStream("sonarlog")
    stream.connect_grpc(viewer.url)
    return Inspection(stream, title, log, following=True)


def inspect_to_file(title: str, log: Log, path: Path | str, *, force: bool = False) -> Inspection:
    """Save what comes to an .rrd file. Raises CannotSave for a file that exists or cannot be made."""
    _check_free(path, force=force)
    stream = rr.RecordingStream("sonarlog")
    stream.save(path)
    return Inspection(stream, title, log, following=False, path=Path(path))


def _check_free(path: Path | str, *, force: bool) -> None:
    if Path(path).exists() and not force:
        raise CannotSave(f"{path} exists and is not overwritten: name another file, or give --force")
    if not Path(path).resolve().parent.is_dir() or not os.access(Path(path).resolve().parent, os.W_OK):
        raise CannotSave(f"cannot write {path}: its folder is not there or not yours to write in")


class LiveStage:
    """A recording while it is made (a `sonarlog.viz.live.Stage`)."""

    def __init__(self, stream: rr.RecordingStream, title: str) -> None:
        self._stream = stream
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        stream.send_recording_name(title)
        stream.send_blueprint(_live_blueprint())
        stream.log("map", rr.Transform3D(mat3x3=_upright(0.0)), static=True)

    def show(self, t_ns: int, shapes: Mapping[str, Shape], numbers: Mapping[str, float]) -> None:
        """What is new at that time."""
        self._stream.set_time(TIME, duration=np.timedelta64(t_ns, "ns"))
        for path, shape in shapes.items():
            self._stream.log(path, *_archetypes(path, shape))
        for path, number in numbers.items():
            self._stream.log(path, rr.Scalars(number))

    def say(self, event: Event) -> None:
        """An event."""
        self._stream.set_time(TIME, duration=np.timedelta64(event.t_ns, "ns"))
        self._stream.log("events", rr.TextLog(event.text, level=event.level.upper()))

    def finish(self) -> None:
        """Send what is left."""
        try:
            self._stream.flush()
        finally:
            self._stream.disconnect()


def live_stage(
    title: str, path: Path | str | None = None, *, viewer: Viewer | None = None, force: bool = False
) -> LiveStage:
    """To a viewer (None: one in its own window), or to an .rrd file. Raises NoViewer, CannotSave."""
    stream = rr.RecordingStream("sonarlog_live")
    if path is None:
        stream.connect_grpc((viewer or start_viewer()).url)
    else:
        _check_free(path, force=force)
        stream.save(path)
    return LiveStage(stream, title)


def _live_blueprint() -> rrb.Blueprint:
    background = [UNKNOWN, UNKNOWN, UNKNOWN]
    the_map = rrb.Spatial2DView(
        origin="/", contents=["/map/**"], name="Echoes where odometry puts them", background=background
    )
    side = rrb.Vertical(rrb.TextLogView(origin="/events", name="Events"), _plot("battery", "Battery, V"))
    return rrb.Blueprint(
        rrb.Horizontal(the_map, side, column_shares=[3, 1]),
        rrb.TimePanel(timeline=TIME, state="collapsed", play_state="following"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def _upright(heading: float) -> Floats:
    """The turn (3, 3) from the map to a view: x where odometry's x axis points, y upwards.

    Rerun's 2D views have y down; a map's x axis is the robot's heading in the middle of its first turn.
    """
    sine, cosine = np.sin(heading), np.cos(heading)
    return np.array([[cosine, -sine, 0.0], [-sine, -cosine, 0.0], [0.0, 0.0, 1.0]])


def _archetypes(path: str, shape: Shape) -> list[rr.AsComponents]:
    layer = next(10.0 * k for k, name in enumerate(LAYERS) if path.startswith(name))
    if isinstance(shape, Raster):
        # Rows go up from the lower left corner, as y does: no flip.
        place = rr.Transform3D(translation=[shape.x, shape.y, 0.0], scale=shape.cell_m)
        model = rr.ColorModel.L if shape.pixels.ndim == 2 else rr.ColorModel.RGBA
        return [place, rr.Image(shape.pixels, model, draw_order=layer, magnification_filter="Nearest")]
    radius = rr.Radius.ui_points
    if isinstance(shape, Dots):
        return [
            rr.Points2D(
                shape.points, colors=shape.colour, radii=radius(shape.size), labels=shape.labels or None,
                show_labels=bool(shape.labels), draw_order=layer,
            )
        ]  # fmt: skip
    colours = list(shape.colours) if shape.lines else []
    return [
        rr.LineStrips2D(
            [np.asarray(line) for line in shape.lines], colors=colours, radii=radius(shape.width / 2),
            labels=shape.labels or None, show_labels=bool(shape.labels), draw_order=layer,
        )
    ]  # fmt: skip


def _blueprint(low: Floats, high: Floats, *, truth: bool, following: bool) -> rrb.Blueprint:
    """The layout: the map from `low` to `high` (x, y) m, the sweep around the robot, the blocks' texts, the plots."""
    background = [UNKNOWN, UNKNOWN, UNKNOWN]
    the_map = rrb.Spatial2DView(
        origin="/",
        contents=["/map/**", "- /map/sweep/**", "- /map/predicted/**", "- /map/chains/names", "- /map/patch"],
        name="Map: green corrected, grey odometry, red true; walls by chain, roots thick; frontier orange",
        background=background,
        visual_bounds=rrb.VisualBounds2D(x_range=[low[0], high[0]], y_range=[-high[1], -low[1]]),
    )  # fmt: skip
    near = rrb.Spatial2DView(
        origin=f"{HERE}/view",
        contents=["/map/**", "- /map/frontier/regions"],
        name="This sweep: blue readings in an RCD, orange near one, purple alone",
        background=background,
        visual_bounds=rrb.VisualBounds2D(x_range=[-NEAR_M, NEAR_M], y_range=[-NEAR_M, NEAR_M]),
    )
    blocks = rrb.TextDocumentView(origin="/blocks", name="What each block made of it")
    plots = [
        _plot("turn", "F: turn found"),
        _plot("shift", "F: shift found"),
        _plot("d1", "F: mean distance to the roots"),
        _plot("calibration", "B: rotation scale"),
    ]
    if truth:
        plots += [
            _plot("error", "Distance from the truth"),
            _plot("heading_error", "Heading off the truth", rrb.Corner2D.LeftBottom),
        ]
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(the_map, near, column_shares=[5, 3]),
            rrb.Horizontal(blocks, rrb.Grid(*plots, grid_columns=len(plots) // 2), column_shares=[3, 5]),
            row_shares=[3, 2],
        ),
        rrb.TimePanel(
            timeline=SWEEP,
            state="collapsed",
            fps=4.0,
            play_state="following" if following else "paused",
        ),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def _plot(name: str, title: str, legend: rrb.Corner2D = rrb.Corner2D.LeftTop) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(origin=f"/plots/{name}", name=title, plot_legend=legend)
