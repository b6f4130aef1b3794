"""The inspection, shown by the real viewer without a screen, and read back from its file."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from PIL import Image
from rerun.chunk import RrdReader
from rerun.experimental import ViewerClient

from cli.main import run as run_command
from slam import pipeline
from slam.algorithms import algorithm
from slam.pipeline import Step
from sonarlog.log import Log, Odometry, Readings, Truth
from sonarlog.robot import load_robot
from sonarlog.viz.native import NoViewer, Viewer, require_display, start_viewer
from sonarlog.viz.rerun_door import CannotSave, inspect_live, inspect_to_file
from sonarlog.viz.scene import Scene
from sonarlog.viz.shapes import Dots, Raster, Strips
from tests.made_runs import SURFACES, TRUE, drifting
from tests.synthetic import RING

EVERYWHERE = {
    "/map/grid", "/map/patch", "/map/odometry/path", "/map/odometry/robot", "/map/corrected/path",
    "/map/corrected/robot", "/map/predicted/robot", "/map/readings/in_rcd", "/map/readings/near_rcd",
    "/map/readings/alone", "/map/sweep/rcds", "/map/sweep/walls", "/map/chains/walls", "/map/chains/roots",
    "/map/frontier/cells", "/map/goal/path", "/map/true/walls", "/map/true/path", "/blocks",
    "/plots/turn/turn_deg", "/plots/d1/after_cm", "/plots/error/corrected_cm",
}  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def steps() -> list[Step]:
    return list(pipeline.run(drifting(), RING, algorithm("paper")))


@pytest.fixture(scope="module")
def log(steps: list[Step]) -> Log:
    """As much of a log as an inspection looks at."""
    none = np.zeros(0, dtype=np.int64)
    t_ns, x_um, y_um, heading = (
        np.concatenate([getattr(s.sweep, name) for s in steps]) for name in ("t_ns", "x_um", "y_um", "heading")
    )
    return Log(
        robot=load_robot("amigo-sh"),
        odometry=Odometry(t_ns, x_um, y_um, heading, np.zeros_like(t_ns)),
        readings=Readings(none, none, none, none, none, none, none),
        truth=Truth(none, np.zeros((0, 3))),
        surfaces=SURFACES,
    )


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory, log: Log, steps: list[Step]) -> Path:
    path = tmp_path_factory.mktemp("viz") / "corridor.rrd"
    with inspect_to_file("synthetic corridor", log, path) as inspection:
        for step, true in zip(steps, TRUE, strict=True):
            inspection.add(step, true)
    return path


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    try:
        viewer = start_viewer(headless=True)
    except NoViewer as error:
        pytest.skip(f"no viewer here: {error}")
    yield viewer
    viewer.process.kill()
    viewer.process.wait()


def test_the_file_holds_every_entity_at_every_sweep(saved: Path, steps: list[Step]) -> None:
    store = RrdReader(saved).store()
    entities, sweeps = set(), set()
    for chunk in store.stream():
        entities.add(str(chunk.entity_path))
        table = chunk.to_record_batch()
        if "sweep" in table.schema.names:
            sweeps |= set(table.column("sweep").to_pylist())
    assert entities >= EVERYWHERE
    assert sweeps == set(range(len(steps)))


def test_the_viewer_shows_every_sweep_without_a_complaint(viewer: Viewer, saved: Path, tmp_path: Path) -> None:
    client = ViewerClient.connect(viewer.url)
    client.open(str(saved))
    for sweep in (0, 4):
        client.set_time("sweep", sequence=sweep, play_state="paused")
        client.save_screenshot(str(tmp_path / f"{sweep}.png"))
        views = client.get_state().views
        assert len(views) == 9
        assert [report for view in views for report in view.reports] == []
    first, last = (np.asarray(Image.open(tmp_path / f"{sweep}.png").convert("L")) for sweep in (0, 4))
    assert np.count_nonzero(first != last) > 1000


def test_a_running_viewer_follows_the_replay(viewer: Viewer, log: Log, steps: list[Step]) -> None:
    client = ViewerClient.connect(viewer.url)
    known = {recording.store_id for recording in client.get_state().recordings}
    with inspect_live("followed", log, viewer) as inspection:
        for step in steps[:3]:
            inspection.add(step)
    end = time.monotonic() + 10
    arrived: list[int | None] = []
    while arrived != [2] and time.monotonic() < end:
        time.sleep(0.1)
        new = [r for r in client.get_state().recordings if r.store_id not in known]
        arrived = [line.end for r in new for line in r.timelines if line.name == "sweep"]
    assert arrived == [2]


def test_the_map_lies_where_its_cells_are(steps: list[Step]) -> None:
    shapes = Scene(0.15, None).show(steps[0]).shapes
    raster = shapes["map/grid"]
    assert isinstance(raster, Raster)
    rows, columns = np.nonzero(raster.pixels == 0)
    y, x = raster.y + (rows + 0.5) * raster.cell_m, raster.x + (columns + 0.5) * raster.cell_m
    walls = np.abs(np.abs(y[np.abs(x) < 0.3]) - 1.0)
    assert len(walls) > 4
    assert float(walls.max()) < 0.06


def test_readings_are_shown_by_class_and_roots_apart(steps: list[Step]) -> None:
    scene = Scene(0.15, None)
    shown = [scene.show(step) for step in steps]
    last, step = shown[-1].shapes, steps[-1]
    in_rcd, roots, walls = last["map/readings/in_rcd"], last["map/chains/roots"], last["map/chains/walls"]
    assert isinstance(in_rcd, Dots)
    assert len(in_rcd.points) == sum(len(rcd.readings) for rcd in step.reliability.rcds)
    assert isinstance(roots, Strips)
    assert isinstance(walls, Strips)
    assert len(roots.lines) == len(step.state.chains.roots)
    assert roots.width > walls.width
    assert "map/true/path" not in last


def test_the_text_says_what_each_block_decided(steps: list[Step]) -> None:
    scene = Scene(0.15, None)
    text = [scene.show(step).text for step in steps][2]
    assert [f"**{letter}**" in text for letter in "ABCDEFGHI"] == [True] * 9
    assert "joins chain 0" in text
    assert "turned -3°" in text


@pytest.mark.parametrize(("environment", "platform"), [({"DISPLAY": ":0"}, "linux"), ({}, "darwin")])
def test_where_there_is_a_display_a_window_may_open(environment: dict[str, str], platform: str) -> None:
    require_display(environment, platform)


def test_without_a_display_it_says_how_to_save() -> None:
    with pytest.raises(NoViewer, match=r"no display .* save with --viz FILE\.rrd"):
        require_display({"DISPLAY": ""}, "linux")


def test_a_file_is_not_overwritten_unasked(tmp_path: Path, log: Log) -> None:
    (tmp_path / "mine.rrd").write_bytes(b"mine")
    with pytest.raises(CannotSave, match="exists and is not overwritten"):
        inspect_to_file("t", log, tmp_path / "mine.rrd")
    with pytest.raises(CannotSave, match="its folder is not there"):
        inspect_to_file("t", log, tmp_path / "nowhere" / "mine.rrd")
    assert (tmp_path / "mine.rrd").read_bytes() == b"mine"


def test_the_command_help_is_there_without_rerun() -> None:
    assert run_command(["replay", "--help"]) == 0
