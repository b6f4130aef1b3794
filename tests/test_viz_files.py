"""Recordings and runs open by themselves in the real viewer, without an inspection and without a complaint."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from rerun.experimental import ViewerClient

from sonarlog.viz.native import NoViewer, Viewer, start_viewer
from tests.made_runs import drifting, made_run

RECORDING = Path(__file__).parents[1] / "recordings" / "bend.mcap"


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    try:
        viewer = start_viewer(headless=True)
    except NoViewer as error:
        pytest.skip(f"no viewer here: {error}")
    yield viewer
    viewer.process.kill()
    viewer.process.wait()


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_run(tmp_path_factory.mktemp("files") / "some.paper.run.mcap", "paper", drifting()).path


def test_a_recording_opens_by_itself(viewer: Viewer) -> None:
    assert opened(viewer, RECORDING) >= {"3D", "TextLog", "TimeSeries"}


def test_a_run_opens_by_itself(viewer: Viewer, run: Path) -> None:
    assert opened(viewer, run) >= {"3D", "TextLog"}


def opened(viewer: Viewer, path: Path) -> set[str]:
    """Kinds of views that the viewer makes of a file, none of which complains from its beginning to its end."""
    client = ViewerClient.connect(viewer.url)
    (store,) = client.open(str(path)).store_ids
    kinds: set[str] = set()
    end = time.monotonic() + 15
    while not kinds and time.monotonic() < end:
        client.take_screenshot()
        (recording,) = (each for each in client.get_state().recordings if each.store_id == store)
        line = next(each for each in recording.timelines if each.name == "message_log_time")
        for part in (0.01, 0.5, 1.0):
            assert line.start is not None
            assert line.end is not None
            moment = line.start + part * (line.end - line.start)
            client.set_time(line.name, timestamp=moment / 1e9, play_state="paused")
            client.take_screenshot()
            views = client.get_state().views
            assert [report for view in views for report in view.reports] == []
        kinds = {view.view_class for view in views}
    return kinds
