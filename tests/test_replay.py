"""Replay: the same recording gives the same bytes, where the robot really was, and the files for other tools."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from cli.main import run as sonarlog
from slam.algorithms import algorithm
from slam.dmath import DEGREE
from sonarlog.exports.files import CannotExport
from sonarlog.exports.folder import NAMES, export_folder
from sonarlog.exports.ros_map import FREE, OCCUPIED, UNKNOWN
from sonarlog.log import Truth
from sonarlog.mcap_file import McapReader
from sonarlog.recording import recording_digest
from sonarlog.replay import replay, true_pose
from sonarlog.runs import Run, read_run
from tests.conftest import ROUTE, SCANS


@pytest.mark.parametrize("name", ["odometry", "literal", "paper"])
def test_replaying_twice_gives_the_same_bytes_apart_from_the_machine(
    short_recording: Path, tmp_path: Path, name: str
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    moved = Path(shutil.copy(short_recording, elsewhere / "renamed.mcap"))
    first = replay(short_recording, algorithm(name), tmp_path / "a.mcap")
    second = replay(moved, algorithm(name), tmp_path / "b.mcap")
    assert first == second
    a, b = McapReader(tmp_path / "a.mcap"), McapReader(tmp_path / "b.mcap")
    assert list(a.stream()) == list(b.stream())
    assert a.attachments == b.attachments
    assert a.metadata.keys() == b.metadata.keys() == {"run", "map", "machine"}
    assert a.metadata["machine"].pop("recording") != b.metadata["machine"].pop("recording")
    assert a.metadata == b.metadata
    assert a.metadata["run"]["digest"] == first.digest


def test_the_digest_needs_no_run(short_recording: Path, short_run: Path) -> None:
    made = replay(short_recording, algorithm("paper"), None)
    run = read_run(short_run)
    assert (made.digest, made.sweeps, made.counts) == (run.digest, SCANS, run.counts)


def test_the_embedded_robot_recorded_again_is_the_same_recording(short_recording: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.mcap"
    arguments = ["record", "--port", "sim://corridor?seed=1", "--route", ROUTE, "-q", "-o", str(again)]
    assert sonarlog(arguments) == 0  # not lean: what is beside the wire is no part of it
    assert recording_digest(again) == recording_digest(short_recording)
    other = tmp_path / "other.mcap"
    assert sonarlog([*arguments[:2], "sim://corridor?seed=2", *arguments[3:-1], str(other)]) == 0
    assert recording_digest(other) != recording_digest(short_recording)


def test_every_step_is_written_with_its_digests_and_the_true_pose(short_run: Path) -> None:
    run = read_run(short_run)
    assert [sweep.index for sweep in run.sweeps] == list(range(SCANS))
    for sweep in run.sweeps:
        assert list(sweep.digests) == [*"ABCDEFGHI", "map"]
        assert sweep.truth is not None
    assert run.sweeps[-1].digests["map"] == run.map_digest
    assert len({sweep.chain for sweep in run.sweeps}) == SCANS
    assert run.truth is not None
    np.testing.assert_allclose(run.truth.pose[:, 0], [0, 0.8, 1.6], atol=0.03)
    assert len(run.chains.members) == sum(len(sweep.data["walls"]) for sweep in run.sweeps) > SCANS


def test_the_true_pose_lies_between_its_neighbours_also_over_the_seam_of_heading() -> None:
    truth = Truth(np.array([0, 100]), np.array([[0.0, 0.0, np.pi - 0.1], [1.0, 2.0, -np.pi + 0.3]]))
    between = true_pose(truth, 25)
    assert between is not None
    np.testing.assert_allclose((between.x, between.y, between.theta), (0.25, 0.5, np.pi))
    assert true_pose(truth, 100) is not None
    assert [true_pose(truth, t_ns) for t_ns in (-1, 101)] == [None, None]
    assert true_pose(None, 0) is None


@pytest.fixture(scope="module")
def exported(short_run: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Path]:
    folder = tmp_path_factory.mktemp("export") / "made" / "here"
    run = read_run(short_run)
    assert export_folder(run, folder) == [folder / name for name in NAMES]
    return run, folder


def test_the_map_is_one_for_map_server(exported: tuple[Run, Path]) -> None:
    run, folder = exported
    sheet = dict(line.split(": ", 1) for line in (folder / "map.yaml").read_text(encoding="utf-8").splitlines())
    assert sheet["image"] == "map.pgm"
    cell = float(sheet["resolution"])
    assert cell == run.grid.cell_m
    kind, size, depth, pixels = (folder / sheet["image"]).read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    assert (kind, depth, len(pixels)) == (b"P5", b"255", width * height)
    image = np.frombuffer(pixels, dtype=np.uint8).reshape(height, width)
    assert set(np.unique(image).tolist()) == {FREE, UNKNOWN, OCCUPIED}
    # By map_server's own rule a cell's value is (255 − pixel) / 255, held against the two thresholds.
    value = (255 - image.astype(float)) / 255
    cells = run.grid.dense()[0][::-1]
    np.testing.assert_array_equal(value > float(sheet["occupied_thresh"]), run.grid.occupied(cells))
    np.testing.assert_array_equal(value < float(sheet["free_thresh"]), run.grid.free(cells))
    # Where the robot stood is free, in the picture's own coordinates.
    x0, y0, _ = json.loads(sheet["origin"])
    for sweep in run.sweeps:
        column, row = int((sweep.pose.x - x0) / cell), int((sweep.pose.y - y0) / cell)
        assert image[height - 1 - row, column] == FREE


def test_the_trajectory_is_in_tum_form(exported: tuple[Run, Path]) -> None:
    run, folder = exported
    rows = np.loadtxt(folder / "trajectory.tum")
    assert rows.shape == (SCANS, 8)
    np.testing.assert_allclose(rows[:, 0], [sweep.t_ns / 1e9 for sweep in run.sweeps])
    np.testing.assert_allclose(rows[:, 1:3], [(s.pose.x, s.pose.y) for s in run.sweeps], atol=1e-6)
    np.testing.assert_allclose(2 * np.arctan2(rows[:, 6], rows[:, 7]), [s.pose.theta for s in run.sweeps], atol=1e-8)
    assert not rows[:, 3:6].any()


def test_the_walls_lie_on_their_lines_and_every_chain_has_one_root(exported: tuple[Run, Path]) -> None:
    run, folder = exported
    with (folder / "walls.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(run.chains.members)
    assert [row["chain"] for row in rows if row["root"] == "1"] == [str(k) for k in range(len(run.chains.roots))]
    for row in rows:
        alpha = float(row["alpha_deg"]) * DEGREE
        for x, y in ((row["x0"], row["y0"]), (row["x1"], row["y1"])):
            assert np.cos(alpha) * float(x) + np.sin(alpha) * float(y) == pytest.approx(float(row["rho"]), abs=3e-4)


def test_an_export_overwrites_only_when_told_and_leaves_nothing_half_made(
    exported: tuple[Run, Path], tmp_path: Path
) -> None:
    run, folder = exported
    with pytest.raises(CannotExport, match=r"map\.pgm exists and is not overwritten"):
        export_folder(run, folder)
    (tmp_path / "walls.csv").write_text("mine", encoding="utf-8")
    with pytest.raises(CannotExport, match=r"walls\.csv exists"):
        export_folder(run, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["walls.csv"]
    export_folder(run, tmp_path, force=True)
    assert (tmp_path / "walls.csv").read_bytes() == (folder / "walls.csv").read_bytes()
    with pytest.raises(CannotExport, match="Not a directory"):
        export_folder(run, tmp_path / "walls.csv" / "below")
