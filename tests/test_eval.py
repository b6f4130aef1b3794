"""sonarlog eval: the numbers, the ways to name a truth, what is refused, and what evo says of the same files."""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.main import run
from slam.geometry import Pose
from sonarlog.evaluation import OtherDrive, Track, evaluate, reference_of_run, track_of_run
from sonarlog.exports.tum import tum_lines
from sonarlog.log import Floats, Odometry, Truth
from sonarlog.metrics import path_errors, placed
from sonarlog.recording import read_log
from sonarlog.runs import read_run
from sonarlog.truth import NoTruth, Reference, reference_of_log
from tests.made_runs import STATIONS, drifting, made_run

DOC = Path(__file__).parents[1] / "docs" / "evaluation.md"
S = 1_000_000_000


def line(count: int = 7) -> Floats:
    """A metre a second along x."""
    return np.array([(k, 0.0, 0.0) for k in range(count)], dtype=np.float64)


def times(count: int = 7) -> np.ndarray:
    return np.arange(count) * S


def test_only_poses_with_a_truth_are_judged_and_both_paths_and_odometry_are() -> None:
    off = placed(line(), Pose(0.0, 1.0, 0.0))
    off[2] = (2.0, 1.3, 0.0)
    odometry = off + np.outer(np.arange(7), (0.0, 0.1, 0.0))
    track = Track("run", times(), path=off, online=off + np.outer(np.arange(7), (0.0, 0.05, 0.0)), odometry=odometry)
    found = evaluate(track, Reference("truth", Truth(times(7)[1:6], placed(line()[1:6], Pose(5, 5, 1)))))
    assert (found.poses, found.judged) == (7, 5)
    assert found.path
    assert found.path.ate_m == pytest.approx(0.3 / np.sqrt(5))
    assert found.online
    assert found.online.end_m == pytest.approx(0.2)
    assert found.odometry
    assert found.odometry.end_m == pytest.approx(0.4)
    assert found.online_ratio
    assert found.online_ratio["end_m"] == pytest.approx(0.5)
    assert found.corrected_later
    assert found.map is None


def test_a_path_of_another_program_is_held_against_the_odometry_of_the_recording() -> None:
    units = Odometry(times(), np.arange(7) * 1_100_000, np.zeros(7, int), np.zeros(7, int), np.zeros(7, int))
    reference = Reference("recording", Truth(times(), line()), odometry=units)
    found = evaluate(Track("other", times()[::2], line()[::2] * 1.05), reference)
    assert found.ratio
    assert found.ratio["end_m"] == pytest.approx(0.5)


def test_the_truth_of_another_drive_is_refused_and_that_of_a_calibrated_one_is_not() -> None:
    units = Odometry(times(), np.zeros(7, int), np.arange(7) * 1_000_000, np.zeros(7, int), np.zeros(7, int))
    reference = Reference("recording", Truth(times(), line()), odometry=units)
    bent = np.column_stack([line()[:, 0], 0.02 * line()[:, 0] ** 2, np.zeros(7)])
    assert evaluate(Track("run", times(), line(), odometry=bent), reference).path
    with pytest.raises(OtherDrive, match="recording is not the recording of run"):
        evaluate(Track("run", times(), line(), odometry=line() * (3.0, 1.0, 1.0)), reference)


def test_a_run_is_judged_by_its_own_truth(tmp_path: Path) -> None:
    made = made_run(tmp_path / "odometry.run.mcap", "odometry", drifting(3.0))
    found = evaluate(track_of_run(made), reference_of_run(made))
    assert found.judged == STATIONS
    assert found.path == found.online
    assert found.ratio == pytest.approx(
        dict.fromkeys(found.ratio or {}, 1.0) | {"over_5m_m": None, "over_5m_deg": None}
    )
    assert found.path
    assert found.path.heading_rmse_deg == pytest.approx(3.0 * np.sqrt(3 / 5), abs=0.02)
    assert found.path.end_m == pytest.approx(2 * 1.6 * np.sin(np.radians(1.5)), abs=0.001)
    assert found.map
    assert found.map.free_true == pytest.approx(1.0, abs=0.02)


def test_a_path_as_found_online_is_another_where_later_sweeps_moved_it(tmp_path: Path) -> None:
    found = track_of_run(made_run(tmp_path / "graph.run.mcap", "graph", drifting(3.0)))
    assert found.online is not None
    assert 0.0 < np.abs(found.online - found.path).max() < 0.1


def test_a_map_that_is_only_turned_is_a_true_one_after_the_best_alignment(tmp_path: Path) -> None:
    made = made_run(tmp_path / "a.run.mcap", "paper", drifting(0.0))
    track, reference = track_of_run(made), reference_of_run(made)
    assert reference.truth
    turned = reference.truth.pose.copy()
    turned[0, 2] += np.radians(10.0)  # the truth knows the first heading badly, and nothing else
    found = evaluate(track, replace(reference, truth=replace(reference.truth, pose=turned)))
    assert found.map
    assert found.map_aligned
    assert (found.map.surface_mapped or 0.0) < 0.9 * (found.map_aligned.surface_mapped or 0.0)
    assert found.map_aligned == evaluate(track, reference).map_aligned
    assert evaluate(track, Reference("", None, reference.surfaces), start=Pose(0.0, 0.0, 0.0)).map_aligned is None


def test_without_a_truth_nothing_is_judged(tmp_path: Path) -> None:
    made = made_run(tmp_path / "a.run.mcap", sweeps=drifting(), truth=False)
    with pytest.raises(NoTruth, match="has no truth: give one with --truth"):
        evaluate(track_of_run(made), reference_of_run(made))
    with pytest.raises(NoTruth, match="holds no poses"):
        evaluate(Track("empty.tum", times(0), line(0)), Reference("truth", Truth(times(), line())))


@pytest.fixture(scope="module")
def folder(short_recording: Path, short_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The short run with its truth and its path as files, and the true map."""
    folder = tmp_path_factory.mktemp("eval")
    for file, form, name in (
        (short_run, "tum", "path.tum"),
        (short_run, "tum --path truth", "truth.tum"),
        (short_recording, "map", "true.yaml"),
        (short_recording, "csv", "short.csv"),
    ):
        assert run(["export", str(file), "--format", *form.split(), "-o", str(folder / name)]) == 0
    assert run(["import", "csv", str(folder / "short.csv"), "-o", str(folder / "blind.mcap")]) == 0
    blind = str(folder / "blind.run.mcap")
    assert run(["replay", str(folder / "blind.mcap"), "--algorithm", "paper", "-o", blind, "-q"]) == 0
    (folder / "short.mcap").symlink_to(short_recording)
    (folder / "short.run.mcap").symlink_to(short_run)
    (folder / "late.tum").write_text("1e6 0 0 0 0 0 0 1\n", encoding="utf-8")
    (folder / "imageless.yaml").write_text("image: gone.pgm\nresolution: 0.05\n", encoding="utf-8")
    return folder


def judged(words: str, capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    capsys.readouterr()
    assert run(["eval", *words.split(), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["schema"] == "sonarlog.eval/1"
    runs: list[dict[str, Any]] = data["runs"]
    return runs


def test_one_truth_in_four_forms_gives_the_same_errors(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    (own,) = judged("short.run.mcap", capsys)
    assert own["path"]["ate_m"] < 0.1
    blind, again = judged("blind.run.mcap short.run.mcap --truth truth.tum --truth-map true.yaml", capsys)
    (recorded,) = judged("path.tum --truth short.mcap", capsys)
    (bare,) = judged("path.tum --truth truth.tum", capsys)
    for other in (blind, again, recorded, bare):
        assert other["path"] == pytest.approx(own["path"], abs=2e-5)
    assert recorded["odometry"]["ate_m"] == pytest.approx(own["odometry"]["ate_m"], abs=1e-3)
    assert (bare["ratio"], bare["map"], bare["straightness_m"]) == (None, None, None)
    assert again["map"] == pytest.approx(own["map"], abs=0.03)  # surfaces as lines, and as cells of 1 cm
    (placed_by_hand,) = judged("blind.run.mcap --truth-map true.yaml --start 0,0,0", capsys)
    assert placed_by_hand["path"] is None
    assert placed_by_hand["map"]["free_true"] > 0.9


def test_the_table_has_a_column_a_run_and_says_what_was_not_judged(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    assert run(["eval", "short.run.mcap", "path.tum", "--truth", "short.mcap"]) == 0
    out = capsys.readouterr().out
    assert re.search(r"short +path\.tum", out)
    assert re.search(r"position, RMS \(ATE\) +0\.\d{3} m \(\d\.\d\d\) +0\.\d{3} m \(\d\.\d\d\)", out)
    assert re.search(r"free cells truly free +\d+\.\d % +–", out)
    assert "as found online" not in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("blind.run.mcap", "blind.run.mcap has no truth: give one with --truth FILE.tum, or a map with --truth-map"),
        ("blind.run.mcap --truth-map true.yaml", "has no true poses: say with --start X,Y,DEG"),
        ("blind.run.mcap --truth-map true.yaml --start 1,2", "--start takes X,Y,DEG in metres and degrees, not '1,2'"),
        (
            "short.run.mcap --truth late.tum",
            "late.tum knows no pose at the time of short.run.mcap: it covers 1000",
        ),
        ("short.run.mcap --truth truth.tum --truth-offset 1000", "if their clocks differ, say by how much"),
        ("short.run.mcap --truth-map imageless.yaml", "cannot read the image gone.pgm, which imageless.yaml names"),
        ("short.run.mcap --truth-map none.yaml", "cannot read none.yaml: No such file"),
        ("short.run.mcap --truth none.tum", "none.tum cannot be read: No such file"),
        ("short.run.mcap --truth short.csv", "short.csv:13: 1 words where 8 belong; a TUM line is"),
        ("short.run.mcap --truth blind.mcap", "blind.mcap holds no /truth"),
        ("path.tum", "path.tum is a path alone: name its truth"),
        ("short.mcap", "short.mcap is a recording, not a run: replay it first"),
    ],
)
def test_what_cannot_be_judged_is_said_in_one_sentence(
    folder: Path, words: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    capsys.readouterr()
    assert run(["eval", *words.split()]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1


def test_the_recordings_truth_is_a_reference_with_odometry(short_recording: Path, short_run: Path) -> None:
    reference = reference_of_log(short_recording, read_log(short_recording))
    own = track_of_run(read_run(short_run))
    assert evaluate(own, reference).path == pytest.approx(evaluate(own, reference_of_run(read_run(short_run))).path)


def test_every_key_of_the_json_is_documented(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    doc = DOC.read_text(encoding="utf-8")
    (found,) = judged(str(folder / "short.run.mcap"), capsys)
    nested = [value for value in found.values() if isinstance(value, dict)] + found["walls"]
    for key in {"schema", "truth", "truth_map", "runs", *found, *(key for value in nested for key in value)}:
        assert f"`{key}`" in doc, key


def evo(tmp_path: Path, truth: Path, path: Path, *options: str) -> float:
    """The RMSE that `evo_ape tum` prints."""
    command = [str(word) for word in (Path(sys.executable).with_name("evo_ape"), "tum", truth, path, *options)]
    environment = os.environ | {"HOME": str(tmp_path), "MPLBACKEND": "agg"}  # evo writes its settings there
    made = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    found = re.search(r"rmse\s+(\S+)", made.stdout)
    assert found, made.stdout
    return float(found[1])


@pytest.mark.parametrize(
    ("option", "key"), [("--align_origin", "ate_m"), ("--align", "ate_aligned_m"), ("-r angle_deg --align_origin", "")]
)
def test_evo_finds_the_same_errors_in_our_tum_files(tmp_path: Path, option: str, key: str) -> None:
    angle = np.linspace(0.0, 5.0, 40)
    truth = np.column_stack([4.0 * np.sin(angle), 3.0 * np.cos(angle), angle])
    noise = np.random.default_rng(1).normal(size=(40, 3)) * (0.1, 0.1, 0.02)
    path = placed(truth + np.cumsum(noise, axis=0), Pose(3.0, -2.0, 1.0))
    files = tmp_path / "truth.tum", tmp_path / "path.tum"
    for file, poses in zip(files, (truth, path), strict=True):
        file.write_text("\n".join(tum_lines(np.arange(40) * S, poses)), encoding="utf-8")
    errors = path_errors(path, truth)
    assert evo(tmp_path, *files, *option.split()) == pytest.approx(vars(errors)[key or "heading_rmse_deg"], abs=2e-5)


def test_evo_reads_the_export_of_a_run_as_it_is(folder: Path, tmp_path: Path, short_run: Path) -> None:
    made = read_run(short_run)
    errors = evaluate(track_of_run(made), reference_of_run(made)).path
    assert errors
    found = evo(tmp_path, folder / "truth.tum", folder / "path.tum", "--align_origin")
    assert found == pytest.approx(errors.ate_m, abs=2e-5)
