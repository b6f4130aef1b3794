"""Following a replay: progress, and what --viz asks for."""

from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Self

from cli.progress import Advance

if TYPE_CHECKING:
    from slam.geometry import Pose
    from slam.pipeline import Step
    from sonarlog.log import Log
    from sonarlog.viz.inspection import Inspection
    from sonarlog.viz.native import Viewer

WINDOW = "window"
"""The value of --viz that asks for the viewer's own window; any other is a file."""


class Watch:
    """A `sonarlog.replay.Watcher` that advances a progress bar, and shows or saves the inspection if there is one.

    The viewer is started before the recording is read, and comes up meanwhile.
    """

    def __init__(self, advance: Advance, viz: str | None = None, title: str = "", *, force: bool = False) -> None:
        self._advance, self._viz, self._title, self._force = advance, viz, title, force
        self._inspection: Inspection | None = None
        self._viewer: Future[Viewer] | None = None
        self._done = self._count = 0

    def begin(self, log: "Log", sweeps: int) -> None:
        """Open the viewer or file, before anything is computed."""
        self._count = sweeps
        if self._viz is None:
            return
        from sonarlog.viz.inspection import inspect_live, inspect_to_file

        if self._viz == WINDOW:
            self._inspection = inspect_live(self._title, log, self._viewer.result() if self._viewer else None)
        else:
            self._inspection = inspect_to_file(self._title, log, self._viz, force=self._force)

    def step(self, step: "Step", truth: "Pose | None") -> None:
        """Show it, count it."""
        if self._inspection is not None:
            self._inspection.add(step, truth)
        self._done += 1
        self._advance(self._done, self._count)

    def __enter__(self) -> Self:
        if self._viz == WINDOW:
            self._viewer = viewer_soon()
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        """Send what is left to the viewer or file; half an inspection is not kept, nor a window with nothing in it."""
        if self._inspection is None:
            if self._viewer is not None and self._viewer.exception() is None:
                self._viewer.result().process.terminate()
        elif kind is None:
            self._inspection.finish()
        else:
            self._inspection.abandon()


def viewer_soon() -> "Future[Viewer]":
    """A viewer, started while something else is done. Raises NoViewer at once where there is no display."""
    from sonarlog.viz.native import require_display, start_viewer

    require_display()
    pool = ThreadPoolExecutor(1, "viewer")
    viewer = pool.submit(start_viewer)
    pool.submit(_load)
    pool.shutdown(wait=False)
    return viewer


def _load() -> None:
    """Rerun takes a second to load."""
    import sonarlog.viz.inspection  # noqa: F401
