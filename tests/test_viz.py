"""The inspection, shown by the real viewer without a screen, and read back from its file."""

import time
from collections.abc import Iterator
from dataclasses import replace
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
from slam.geometry import Pose
from slam.grid import Grid
from slam.pipeline import Step
from sonarlog.log import Log, Odometry, Readings, Truth
from sonarlog.robot import load_robot
from sonarlog.viz.inspection import inspect_live, inspect_to_file
from sonarlog.viz.native import NoViewer, Viewer, require_display, start_viewer
from sonarlog.viz.pieces import A_PIECE, Pieces, Tiles, frontier_cells, merged
from sonarlog.viz.rerun_door import CannotSave
from sonarlog.viz.scene import Scene
from sonarlog.viz.shapes import Dots, Labels, Raster, Shape, Strips
from tests.made_runs import AT_ONCE, SURFACES, TRUE, drifting
from tests.synthetic import RING

EVERYWHERE = {
    "/map/A_sensing/echoes", "/map/A_sensing/no_echo", "/map/B_calibration/raw", "/map/B_calibration/calibrated",
    "/map/C_reliability/in_rcd", "/map/C_reliability/alone", "/map/C_reliability/rcds", "/map/D_features/walls",
    "/map/E_association/links", "/map/E_association/names", "/map/F_localisation/before", "/map/F_localisation/after",
    "/map/F_localisation/correction_x10", "/map/G_recomputed/after", "/map/H_extension/patch",
    "/map/H_extension/grid/x0_y0", "/map/I_decision/path", "/map/I_decision/frontier/x0_y0",
    "/map/path/corrected/0", "/map/path/odometry/0", "/map/path/true/0", "/map/robot/corrected", "/map/true/walls",
    "/map/chains/walls/0", "/map/chains/roots/0", "/blocks",
    "/plots/turn/turn_deg", "/plots/d1/after_cm", "/plots/error/corrected_cm",
}  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def steps() -> list[Step]:
    return list(pipeline.run(drifting(), RING, algorithm("paper").configured(AT_ONCE)))


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


@pytest.mark.parametrize("tab", [0, 1, 2])
def test_the_viewer_shows_every_sweep_without_a_complaint(
    viewer: Viewer, log: Log, steps: list[Step], tmp_path: Path, tab: int
) -> None:
    with inspect_to_file("synthetic corridor", log, tmp_path / "tab.rrd", tab=tab) as inspection:
        for step, true in zip(steps, TRUE, strict=True):
            inspection.add(step, true)
    client = ViewerClient.connect(viewer.url)
    client.open(str(tmp_path / "tab.rrd"))
    pictures = []
    for sweep in (0, 4):
        client.set_time("sweep", sequence=sweep, play_state="paused")
        pictures.append(picture(client, tmp_path))
        views = client.get_state().views
        assert len(views) == 5 + 10 + 7
        assert [report for view in views for report in view.reports] == []
    assert np.count_nonzero(pictures[0] != pictures[1]) > 1000


def picture(client: ViewerClient, folder: Path) -> "np.ndarray[tuple[int, ...], np.dtype[np.uint8]]":
    client.save_screenshot(str(folder / "shot.png"))
    return np.asarray(Image.open(folder / "shot.png").convert("L"))


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


def shown(steps: list[Step]) -> list[dict[str, Shape]]:
    scene = Scene(RING, 0.15, None)
    return [scene.show(step).shapes for step in steps]


def test_the_map_lies_where_its_cells_are(steps: list[Step]) -> None:
    rasters = [shape for path, shape in shown(steps[:1])[0].items() if "/grid/" in path]
    walls: list[float] = []
    for raster in rasters:
        assert isinstance(raster, Raster)
        rows, columns = np.nonzero(raster.pixels == 0)
        y, x = raster.y + (rows + 0.5) * raster.cell_m, raster.x + (columns + 0.5) * raster.cell_m
        walls += np.abs(np.abs(y[np.abs(x) < 0.3]) - 1.0).tolist()
    assert len(walls) > 4
    assert max(walls) < 0.06


def test_readings_are_shown_by_class_and_roots_apart(steps: list[Step]) -> None:
    drawn, step = shown(steps), steps[-1]
    last = merged(drawn)
    in_rcd, roots, walls = (
        last[f"map/{name}"] for name in ("C_reliability/in_rcd", "chains/roots/0", "chains/walls/0")
    )
    assert isinstance(in_rcd, Dots)
    assert len(in_rcd.points) == sum(len(rcd.readings) for rcd in step.reliability.rcds)
    assert isinstance(roots, Strips)
    assert isinstance(walls, Strips)
    assert len(roots.lines) == len(step.state.chains.roots)
    assert roots.width > walls.width
    assert "map/path/true/0" not in last


def test_links_and_correction_are_shown_and_said(steps: list[Step]) -> None:
    turned = shown(steps)[2]
    names, arrow = turned["map/E_association/names"], turned["map/F_localisation/correction_x10"]
    assert isinstance(names, Labels)
    assert "wall 0 → chain 0: d1" in " ".join(names.words)
    said = turned["map/F_localisation/name"]
    assert isinstance(said, Labels)
    assert said.words[0].endswith(("-3.0°", "-3.1°"))
    assert isinstance(arrow, Strips)


def test_raw_echoes_lie_where_calibrated_ones_do_if_there_is_nothing_to_calibrate(steps: list[Step]) -> None:
    first = shown(steps)[0]
    raw, calibrated = first["map/B_calibration/raw"], first["map/B_calibration/calibrated"]
    assert isinstance(raw, Dots)
    assert isinstance(calibrated, Dots)
    off = np.hypot(*(np.asarray(raw.points) - np.asarray(calibrated.points)).T)
    assert float(np.median(off)) < 0.05


def test_the_frontier_shown_is_the_one_that_was_decided_on(steps: list[Step]) -> None:
    step = steps[2]
    grid = step.state.grid
    shown = sum(len(frontier_cells(grid, *at)) for at in grid.tiles)
    assert shown == pytest.approx(step.decision.frontier_cells, abs=4)  # where the map ends the two may differ


def test_poses_that_move_and_loops_that_close_are_shown(steps: list[Step]) -> None:
    scene = Scene(RING, 0.15, None)
    for step in steps[:-1]:
        scene.show(step)
    last, away = steps[-1], Pose(0.8, 0.1, 0.0)
    poses = (last.state.poses[0], away, *last.state.poses[2:])
    found = replace(last.localisation, moved=((1, away),), merged=((0, 3),))
    moved = replace(last, localisation=found, state=replace(last.state, track=replace(last.state.track, poses=poses)))
    shapes = scene.show(moved).shapes
    arrows, names = (shapes[f"map/F_localisation/{name}"] for name in ("moved_x10", "loop_names"))
    assert isinstance(arrows, Strips)
    assert arrows.lines[0][1].tolist() == pytest.approx([0.8, 1.0], abs=0.3)  # ten times as far as it went
    assert isinstance(names, Labels)
    assert names.words == ("sweep 4: chain 3 is chain 0",)
    assert {"map/path/corrected/0", "map/path/as_found/0"} <= shapes.keys()


def test_only_what_changed_is_drawn_again() -> None:
    pieces = Pieces("p", lambda _, rows: Strips([rows], [(0, 0, 0)]), joined=True)
    rows = np.arange(20.0 * A_PIECE).reshape(-1, 2)
    assert list(pieces.changed(rows[:-1])) == [f"p/{k}" for k in range(10)]
    assert list(pieces.changed(rows)) == ["p/9"]
    assert list(pieces.changed(rows + 0.0001)) == []
    rows[A_PIECE // 2] += 1.0
    assert list(pieces.changed(rows)) == ["p/0"]
    gone = pieces.changed(rows[:A_PIECE])
    assert list(gone) == [f"p/{k}" for k in range(1, 10)]


def test_a_tile_is_drawn_again_when_it_changes(steps: list[Step]) -> None:
    tiles = Tiles("grid", "frontier")
    grids = [step.state.grid for step in steps]
    assert len([path for path in tiles.changed(grids[0]) if path.startswith("grid")]) == len(grids[0].tiles)
    assert tiles.changed(grids[0]) == {}
    again = [path for path in tiles.changed(grids[-1]) if path.startswith("grid")]
    assert 0 < len(again) <= len(grids[-1].tiles)
    cleared = tiles.changed(Grid(0.05, 15, -6))["grid/x0_y0"]
    assert isinstance(cleared, Raster)
    assert set(cleared.pixels.flat) == {205}


def test_the_text_says_what_each_block_decided(steps: list[Step]) -> None:
    scene = Scene(RING, 0.15, None)
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
