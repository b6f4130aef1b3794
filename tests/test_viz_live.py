"""The live view: what is recorded is shown, and no viewer, however slow or broken, delays or ends a recording."""

import threading
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import pytest
from rerun.chunk import RrdReader

from cli.main import run
from sonarlog.decode import Pose, Reading, Sample
from sonarlog.log import Event
from sonarlog.protocol.packets import Sip
from sonarlog.recording import read_log, recording_digest
from sonarlog.robot import load_robot
from sonarlog.viz import live
from sonarlog.viz.live import LiveView, live_stage
from sonarlog.viz.native import NoViewer, start_viewer
from sonarlog.viz.shapes import Dots, Shape, Strips

ROBOT = load_robot("amigo-sh")


def sample(k: int) -> Sample:
    pose = Pose(10_000 * k, 0, 0)
    return Sample(100_000_000 * k, Sip(battery=125), 0, pose, (Reading(0, 0, 900, pose), Reading(0, 5, 5000, pose)))


class Kept:
    """A stage that keeps what it is shown."""

    def __init__(self) -> None:
        self.shapes: dict[str, Shape] = {}
        self.said: list[str] = []
        self.finished = False
        self.gate: threading.Event | None = None

    def show(self, t_ns: int, shapes: Mapping[str, Shape], numbers: Mapping[str, float]) -> None:
        if self.gate:
            self.gate.wait(20)
        self.shapes |= shapes
        assert numbers == {"plots/battery/volts": 12.5}

    def say(self, event: Event) -> None:
        self.said.append(event.text)

    def write(self, t_ns: int, text: str) -> None:
        raise AssertionError(text)

    def turn(self, heading: float) -> None:
        raise AssertionError(heading)

    def finish(self) -> None:
        self.finished = True


def test_echoes_path_and_events_are_drawn_piece_by_piece() -> None:
    stage = Kept()
    view = LiveView(stage)
    for k in range(1200):
        view.show(sample(k), ROBOT)
        if k % 400 == 0:
            view.tell(Event(k, "info", f"event {k}"))
            time.sleep(0.25)
    view.close()
    assert stage.finished
    assert stage.said == ["event 0", "event 400", "event 800"]
    echoes = [shape for path, shape in stage.shapes.items() if path.startswith("map/readings")]
    assert [len(dots.points) for dots in echoes if isinstance(dots, Dots)] == [500, 500, 202]
    first = stage.shapes["map/readings/0"]
    assert isinstance(first, Dots)
    assert first.points[1].tolist() == pytest.approx([0.01 + 0.07, 0.1 + 0.9])  # sonar 0 looks left
    assert isinstance(stage.shapes["map/odometry/path/2"], Strips)


def test_a_viewer_that_hangs_delays_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live, "CLOSE_S", 0.2)
    stage = Kept()
    stage.gate = threading.Event()
    view = LiveView(stage)
    begin = time.monotonic()
    for k in range(20_000):
        view.show(sample(0), ROBOT)
        if k == 0:
            time.sleep(0.3)
    view.close()
    assert time.monotonic() - begin < 2
    assert view.left_out > 10_000
    stage.gate.set()


def test_a_viewer_that_is_closed_ends_the_view_only() -> None:
    view = LiveView(object())  # type: ignore[arg-type]  # the first thing it is asked for fails
    view.show(sample(0), ROBOT)
    view.close()
    assert isinstance(view.failure, AttributeError)


def test_a_recording_is_the_same_whether_it_is_watched_or_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--port", "sim://corridor?speed=40", "--route", "scan", "-q"]
    saved = tmp_path / "live.rrd"
    assert run(["record", *arguments, "-o", str(tmp_path / "a.mcap"), "--viz", str(saved)]) == 0
    assert run(["record", *arguments, "-o", str(tmp_path / "b.mcap")]) == 0
    assert recording_digest(tmp_path / "a.mcap") == recording_digest(tmp_path / "b.mcap")
    assert run(["record", *arguments, "-o", str(tmp_path / "c.mcap"), "--viz", str(saved)]) == 2
    assert "not overwritten" in capsys.readouterr().err
    paths = {str(chunk.entity_path) for chunk in RrdReader(saved).stream()}
    assert {"/map/readings/0", "/map/odometry/path/0", "/map/odometry/robot", "/events"} <= paths


def test_an_exploration_is_shown_as_it_goes_on_and_is_the_same_unwatched(tmp_path: Path) -> None:
    hall = Path(__file__).parent / "data" / "hall.toml"
    arguments = ["explore", "--port", f"sim://{hall}?seed=1", "--max-time", "100", "-q", "--lean"]
    saved = tmp_path / "live.rrd"
    assert run([*arguments, "-o", str(tmp_path / "a.mcap"), "--viz", str(saved)]) == 0
    assert run([*arguments, "-o", str(tmp_path / "b.mcap")]) == 0
    assert recording_digest(tmp_path / "a.mcap") == recording_digest(tmp_path / "b.mcap")
    rows: dict[str, int] = Counter()
    for chunk in RrdReader(saved).stream():
        rows[str(chunk.entity_path)] += chunk.num_rows
    stations = len(read_log(tmp_path / "a.mcap").decisions)
    assert stations >= 2
    assert rows["/decision"] == rows["/map/stations"] == rows["/map/I_decision/path"] == stations
    assert {"/events", "/map/I_decision/goal", "/map/I_decision/regions", "/map/path/corrected/0"} <= rows.keys()
    assert {"/map/live/robot", "/map/live/way", "/map/live/echoes", "/plots/battery/volts"} <= rows.keys()
    tiles = [path for path in rows if path.startswith("/map/H_extension/grid/")]
    frontier = [path for path in rows if path.startswith("/map/I_decision/frontier/")]
    assert tiles
    assert frontier
    assert max(rows[path] for path in tiles) >= 2  # it grows


def test_the_native_viewer_takes_it() -> None:
    try:
        viewer = start_viewer(headless=True)
    except NoViewer as error:
        pytest.skip(f"no viewer here: {error}")
    try:
        view = LiveView(live_stage("test", viewer=viewer))
        for k in range(20):
            view.show(sample(k), ROBOT)
        view.close()
        assert view.failure is None
    finally:
        viewer.process.kill()
        viewer.process.wait()
