"""The one door to Rerun: shapes to its archetypes, layouts to its blueprints, and where they go, viewer or file."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from sonarlog.errors import SonarlogError
from sonarlog.viz.layout import Group, Layout, Page, Part, Plane, Plot
from sonarlog.viz.native import start_viewer
from sonarlog.viz.shapes import Colour, Dots, Labels, Raster, Shape

if TYPE_CHECKING:
    from sonarlog.viz.native import Viewer

SWEEP, TIME = "sweep", "time"
"""Timelines: the number of the sweep, and the time since the recording began."""

LAYERS = ("grid", "patch", "difference", "true", "chains/walls", "chains/roots", "frontier", "path", "live", "rays",
          "no_echo", "beams", "raw", "moved", "before", "robot", "roots", "members")  # fmt: skip
"""Parts of entity paths from the bottom to the top; everything else lies above, and names above all."""
A_CHUNK = 4 << 20
UNSEEN = rr.Radius.ui_points(0.01)


class CannotSave(SonarlogError):
    """The inspection cannot be written."""


class Canvas:
    """A recording of Rerun's, shown in a viewer or written to a file; nothing is drawn twice that did not change."""

    def __init__(self, stream: rr.RecordingStream, title: str, viewer: "Viewer | None", path: Path | None) -> None:
        self._stream, self._viewer, self._path = stream, viewer, path
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        stream.send_recording_name(title)

    def lay_out(self, layout: Layout, heading: float = 0.0) -> None:
        """Send the layout; `heading` rad of the map points right. Rerun's planes have y down, a map's goes up."""
        self._stream.send_blueprint(_blueprint(layout))
        sine, cosine = np.sin(heading), np.cos(heading)
        self._upright = np.array([[cosine, -sine, 0.0], [-sine, -cosine, 0.0], [0.0, 0.0, 1.0]])
        self._stream.log("map", rr.Transform3D(mat3x3=self._upright), static=True)

    def name_numbers(self, series: Mapping[str, tuple[str, Colour]]) -> None:
        """Names and colours of what `numbers` will bring."""
        for path, (name, colour) in series.items():
            marks = rr.SeriesPoints(colors=colour, names=name, marker_sizes=3.0)
            self._stream.log(path, rr.SeriesLines(colors=colour, names=name, widths=1.5), marks, static=True)

    def at(self, *, sweep: int | None = None, t_ns: int | None = None) -> None:
        """When what comes next happened."""
        if sweep is not None:
            self._stream.set_time(SWEEP, sequence=sweep)
        if t_ns is not None:
            self._stream.set_time(TIME, duration=np.timedelta64(t_ns, "ns"))

    def draw(self, shapes: Mapping[str, Shape], *, always: bool = False) -> None:
        """Shapes by entity path; with `always` they are there at any time."""
        for path, shape in shapes.items():
            self._stream.log(path, *_archetypes(path, shape), static=always)

    def numbers(self, numbers: Mapping[str, float]) -> None:
        """Numbers by entity path."""
        for path, number in numbers.items():
            self._stream.log(path, rr.Scalars(number))

    def look_from(self, x: float, y: float) -> None:
        """Where, in the map, views that go with the robot have their middle."""
        self._stream.log("map/here", rr.Transform3D(translation=[x, y, 0.0]))
        self._stream.log("map/here/view", rr.Transform3D(mat3x3=self._upright.T), static=True)

    def write(self, path: str, text: str, *, always: bool = False) -> None:
        """Markdown; with `always` it is there at any time."""
        self._stream.log(path, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=always)

    def say(self, path: str, text: str, level: str) -> None:
        """A line in a list of events."""
        self._stream.log(path, rr.TextLog(text, level=level.upper()))

    def finish(self, look_at: int | None = None) -> None:
        """Send what is left, put a viewer's cursor on the sweep `look_at`, and let go of viewer or file.

        Raises CannotSave; a file that is incomplete is removed.
        """
        try:
            self._stream.flush()
        except RuntimeError as error:
            self.abandon()
            if self._path is None:
                raise CannotSave(f"the viewer was closed before it was shown everything ({error})") from None
            raise CannotSave(f"cannot write {self._path}: the disk is full, or refuses it ({error})") from None
        if look_at is not None and self._viewer is not None:
            from rerun.experimental import ViewerClient

            ViewerClient.connect(self._viewer.url).set_time(SWEEP, sequence=look_at, play_state="paused")
        self._stream.disconnect()

    def abandon(self) -> None:
        """Let go of the viewer or file, and remove the file."""
        self._stream.disconnect()
        if self._path is not None:
            self._path.unlink(missing_ok=True)


def canvas(
    title: str, path: Path | str | None = None, *, viewer: "Viewer | None" = None, force: bool = False,
    application: str = "sonarlog",
) -> Canvas:  # fmt: skip
    """To an .rrd file, or to a viewer (None: one in its own window).

    Raises NoViewer where there is no display, CannotSave for a file that exists or cannot be made.
    """
    if path is None:
        viewer = viewer or start_viewer()
        stream = rr.RecordingStream(application)
        stream.connect_grpc(viewer.url)
        return Canvas(stream, title, viewer, None)
    if Path(path).exists() and not force:
        raise CannotSave(f"{path} exists and is not overwritten: name another file, or give --force")
    if not Path(path).resolve().parent.is_dir() or not os.access(Path(path).resolve().parent, os.W_OK):
        raise CannotSave(f"cannot write {path}: its folder is not there or not yours to write in")
    # Few large chunks: a file of many small ones takes twice the space, and seconds to open.
    batches = rr.ChunkBatcherConfig(flush_tick=3600.0, flush_num_bytes=A_CHUNK, flush_num_rows=1 << 20)
    stream = rr.RecordingStream(application, batcher_config=batches)
    stream.save(path)
    return Canvas(stream, title, None, Path(path))


def _layer(path: str) -> float:
    return 10.0 * next((k for k, name in enumerate(LAYERS) if f"/{name}" in path), len(LAYERS))


def _archetypes(path: str, shape: Shape) -> list[rr.AsComponents]:
    layer = _layer(path)
    if isinstance(shape, Raster):
        # Rows go up from the lower left corner, as y does: no flip.
        place = rr.Transform3D(translation=[shape.x, shape.y, 0.0], scale=shape.cell_m)
        model = rr.ColorModel.L if shape.pixels.ndim == 2 else rr.ColorModel.RGBA
        return [place, rr.Image(shape.pixels, model, draw_order=layer, magnification_filter="Nearest")]
    if isinstance(shape, Labels):
        return [
            rr.Points2D(
                shape.points, colors=[255, 255, 255], radii=UNSEEN, labels=list(shape.words),
                show_labels=True, draw_order=layer + 1000.0,
            )
        ]  # fmt: skip
    radius = rr.Radius.ui_points
    if isinstance(shape, Dots):
        return [rr.Points2D(shape.points, colors=shape.colour, radii=radius(shape.size), draw_order=layer)]
    lines = [np.asarray(line) for line in shape.lines]
    style: dict[str, Any] = {
        "colors": list(shape.colours) if lines else [], "radii": radius(shape.width / 2), "draw_order": layer,
    }  # fmt: skip
    if len({len(line) for line in lines}) == 1:  # an array is taken in a quarter of the time of a list
        return [rr.LineStrips2D(np.stack(lines).astype(np.float32), **style)]
    return [rr.LineStrips2D(lines, **style)]


def _blueprint(layout: Layout) -> rrb.Blueprint:
    marked = layout.selection and rrb.components.AbsoluteTimeRange(*layout.selection)
    return rrb.Blueprint(
        _part(layout.whole, [layout.background] * 3),
        rrb.TimePanel(
            timeline=layout.timeline,
            time_selection=marked,
            state="collapsed",
            fps=4.0,
            play_state="following" if layout.following else "paused",
        ),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def _part(part: Part, background: list[int]) -> rrb.View | rrb.Container:
    if isinstance(part, Plane):
        bounds = None
        if part.low is not None and part.high is not None:
            bounds = rrb.VisualBounds2D(x_range=[part.low[0], part.high[0]], y_range=[-part.high[1], -part.low[1]])
        return rrb.Spatial2DView(
            origin=f"/{part.origin}", contents=list(part.contents), name=part.title, background=background,
            visual_bounds=bounds,
        )  # fmt: skip
    if isinstance(part, Plot):
        corner = rrb.Corner2D.LeftBottom if part.legend_below else rrb.Corner2D.LeftTop
        return rrb.TimeSeriesView(origin=f"/{part.origin}", name=part.title, plot_legend=corner)
    if isinstance(part, Page):
        kind = rrb.TextLogView if part.events else rrb.TextDocumentView
        return kind(origin=f"/{part.origin}", name=part.title)
    return _group(part, [_part(inner, background) for inner in part.parts])


def _group(group: Group, parts: "list[rrb.View | rrb.Container]") -> rrb.Container:
    name, shares = group.title or None, list(group.shares) or None
    if group.kind == "row":
        return rrb.Horizontal(*parts, column_shares=shares, name=name)
    if group.kind == "column":
        return rrb.Vertical(*parts, row_shares=shares, name=name)
    if group.kind == "grid":
        return rrb.Grid(*parts, grid_columns=group.columns, name=name)
    return rrb.Tabs(*parts, active_tab=group.active, name=name)
