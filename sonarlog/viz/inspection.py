"""A replay as it is inspected: each step, as it comes, onto a canvas.

Must not know: Rerun.
"""

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from slam.geometry import Pose
from slam.pipeline import Step
from sonarlog.log import Log
from sonarlog.viz.layout import replay_layout
from sonarlog.viz.rerun_door import Canvas, canvas
from sonarlog.viz.scene import SERIES, Scene, Shown, extent, reach
from sonarlog.viz.shapes import Strips

if TYPE_CHECKING:
    from sonarlog.viz.native import Viewer


class Inspection:
    """Give it each step as it comes, and end with `finish`, or use it as a context manager."""

    def __init__(self, canvas: Canvas, log: Log, *, following: bool, tab: int = 0) -> None:
        """`tab` is what is seen first: 0 the overview, 1 the blocks, 2 the numbers."""
        self._canvas, self._log, self._following, self._tab = canvas, log, following, tab
        self._scene = Scene(log.robot.ring(), log.robot.radius_mm / 1000, log.surfaces)
        self._start_ns = int(log.odometry.t_ns[0]) if len(log.odometry.t_ns) else 0
        self._count = 0
        canvas.name_numbers(SERIES)

    def add(self, step: Step, truth: Pose | None = None) -> None:
        """Show a step; `truth` is where the robot really was at its reference reading, in the recording's frame."""
        shown = self._scene.show(step, truth)
        if self._count == 0:
            self._begin(step, shown)
        moment = int(step.sweep.t_ns[step.sweep.reference]) - self._start_ns
        self._canvas.at(sweep=self._count, t_ns=moment)
        self._canvas.draw(shown.shapes)
        self._canvas.numbers(shown.numbers)
        self._canvas.look_from(step.pose.x, step.pose.y)
        self._canvas.write("blocks", shown.text)
        self._count += 1

    def _begin(self, first: Step, shown: Shown) -> None:
        """Lay out what is to come, and fix which way is up."""
        walls = shown.always.get("map/true/walls")
        low, high = extent(first, self._log.odometry, walls if isinstance(walls, Strips) else None)
        truth = "plots/error/corrected_cm" in shown.numbers
        layout = replay_layout(low, high, reach(first), truth=truth, following=self._following, tab=self._tab)
        self._canvas.lay_out(layout, first.calibrated.odometry.theta)
        self._canvas.draw(shown.always, always=True)

    def finish(self) -> None:
        """Send what is left and let go of the viewer or file. Raises CannotSave."""
        self._canvas.finish()

    def abandon(self) -> None:
        """Let go of the viewer or file, and remove the file."""
        self._canvas.abandon()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        if kind is None:
            self.finish()
        else:
            self.abandon()


def inspect_live(title: str, log: Log, viewer: "Viewer | None" = None) -> Inspection:
    """Show what comes in a viewer: in one that runs already, else in the native one's own window.

    Raises NoViewer where there is no display.
    """
    return Inspection(canvas(title, viewer=viewer), log, following=True)


def inspect_to_file(title: str, log: Log, path: Path | str, *, force: bool = False, tab: int = 0) -> Inspection:
    """Save what comes to an .rrd file. Raises CannotSave for a file that exists or cannot be made.

    `tab` is what is seen first: 0 the overview, 1 the blocks, 2 the numbers.
    """
    application = f"sonarlog_{tab}" if tab else "sonarlog"  # a viewer keeps one layout for each
    return Inspection(canvas(title, path, force=force, application=application), log, following=False, tab=tab)
