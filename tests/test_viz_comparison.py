"""Two runs as layers on one timeline, shown by the real viewer without a screen."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import rerun as rr
from rerun.chunk import RrdReader
from rerun.experimental import ViewerClient

from sonarlog.diff import Report, diff_runs
from sonarlog.viz.comparison import compare_live, compare_to_file
from sonarlog.viz.native import NoViewer, start_viewer
from sonarlog.viz.rerun_door import CannotSave
from tests.made_runs import drifting, made_run


@pytest.fixture(scope="module", autouse=True)
def strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    """They part at the third sweep, where odometry was turned by 3°."""
    folder = tmp_path_factory.mktemp("comparison")
    settings = {"self_calibration.fit": False}
    runs = [
        made_run(folder / f"{name}.run.mcap", "paper", drifting(turn), settings) for name, turn in (("a", 3), ("b", 4))
    ]
    return diff_runs(*runs)


def test_a_b_and_the_difference_are_there_at_every_sweep(report: Report, tmp_path: Path) -> None:
    compare_to_file(report, tmp_path / "diff.rrd")
    entities, sweeps = set(), set()
    for chunk in RrdReader(tmp_path / "diff.rrd").store().stream():
        entities.add(str(chunk.entity_path))
        table = chunk.to_record_batch()
        if "sweep" in table.schema.names:
            sweeps |= set(table.column("sweep").to_pylist())
    sides = {f"/map/{side}/{what}" for side in "AB" for what in ("grid", "walls", "path/0", "robot", "seen")}
    assert entities >= sides | {
        "/map/difference/grid",
        "/map/first/ring",
        "/blocks",
        "/report",
        "/plots/apart/aligned_cm",
    }
    assert sweeps == set(range(5))
    with pytest.raises(CannotSave, match="not overwritten"):
        compare_to_file(report, tmp_path / "diff.rrd")


def test_the_viewer_stands_at_the_first_difference_and_complains_of_nothing(report: Report) -> None:
    assert report.first
    try:
        viewer = start_viewer(headless=True)
    except NoViewer as error:
        pytest.skip(f"no viewer here: {error}")
    try:
        compare_live(report, viewer)
        client = ViewerClient.connect(viewer.url)
        client.take_screenshot()
        end = time.monotonic() + 10
        views = client.get_state().views
        while len(views) < 8 and time.monotonic() < end:
            time.sleep(0.1)
            views = client.get_state().views
        assert [report for view in views for report in view.reports] == []
        assert len(views) == 8
        assert [recording.current_time for recording in client.get_state().recordings] == [report.first.sweep]
    finally:
        viewer.process.kill()
        viewer.process.wait()
