"""sonarlog export: what each form holds, that csv comes back as it was, and what is refused."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cli.main import run
from slam.geometry import Pose
from slam.sweep import TURN
from sonarlog.export import READ, Asked, export_file
from sonarlog.exports.carmen import carmen_lines, pseudo_scan
from sonarlog.exports.csv import csv_lines
from sonarlog.imports import csv as form
from sonarlog.log import Log, Odometry, Readings
from sonarlog.protocol.framing import frame
from sonarlog.protocol.packets import Sip
from sonarlog.recording import RecordingWriter, read_log
from sonarlog.replay import sweeps_of
from sonarlog.robot import load_robot
from sonarlog.runs import read_run
from sonarlog.true_map import read_true_map
from tests.conftest import SCANS
from tests.synthetic import corridor, scan


def test_a_recording_comes_back_from_csv_as_the_same_log(short_recording: Path, tmp_path: Path) -> None:
    text, back = tmp_path / "short.csv", tmp_path / "short.mcap"
    assert run(["export", str(short_recording), "--format", "csv", "-o", str(text)]) == 0
    assert run(["import", "csv", str(text), "-o", str(back)]) == 0
    before, after = read_log(short_recording), read_log(back)
    assert after.robot == before.robot
    for table in ("odometry", "readings"):
        for name, column in vars(getattr(before, table)).items():
            assert vars(getattr(after, table))[name].tolist() == column.tolist(), (table, name)


rows = st.lists(
    st.tuples(
        st.integers(0, 10**6), st.integers(-(10**9), 10**9), st.integers(-(10**9), 10**9), st.integers(-TURN, TURN)
    ),
    min_size=1,
    max_size=6,
)
fired = st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 7), st.integers(0, 5000)), max_size=12)


@settings(deadline=None, max_examples=50)
@given(rows, fired)
def test_every_number_of_a_log_is_in_its_csv(
    tmp_path_factory: pytest.TempPathFactory,
    places: list[tuple[int, int, int, int]],
    firings: list[tuple[int, int, int]],
) -> None:
    reported = {t: (x, y, heading) for t, x, y, heading in places}
    where = list(reported.values())
    readings = [(t, sonar, mm, *where[k % len(where)]) for k, (t, sonar, mm) in enumerate(firings)]
    odometry = np.array([(t, *place, 0) for t, place in reported.items()], dtype=np.int64).T
    columns = np.array([(*reading, 0) for reading in readings], dtype=np.int64).reshape(-1, 7).T
    log = Log(load_robot("amigo-sh"), Odometry(*odometry), Readings(*columns))
    path = tmp_path_factory.getbasetemp() / "some.csv"
    path.write_text("\n".join(csv_lines(log)), encoding="utf-8")
    found = list(form.rows(form.read(path)))
    assert [row.t_ns for row in found] == sorted({row.t_ns for row in found})
    turned = {t: (x, y, heading % TURN) for t, (x, y, heading) in reported.items()}
    assert {row.t_ns: (row.x_um, row.y_um, row.heading % TURN) for row in found if row.odometry} == turned
    told = [
        (sonar, mm, row.x_um, row.y_um, row.heading % TURN)
        for row in found
        for sonar, mm in enumerate(row.ranges_mm)
        if mm is not None
    ]
    assert sorted(told) == sorted((sonar, mm, x, y, heading % TURN) for _, sonar, mm, x, y, heading in readings)


def test_a_carmen_log_has_a_line_a_packet_a_firing_and_a_sweep(short_recording: Path) -> None:
    log = read_log(short_recording)
    lines = [line.split() for line in carmen_lines(log, sweeps_of(log, short_recording).sweeps)]
    kinds = [words[0] for words in lines]
    assert kinds.count("ODOM") == len(log.odometry.t_ns)
    assert kinds.count("SONAR") == len(log.readings.t_ns)
    assert kinds.count("ROBOTLASER1") == SCANS
    timed = [float(words[-1]) for words in lines if words[0] in ("ODOM", "SONAR", "ROBOTLASER1")]
    assert timed == sorted(timed)
    last = [words for words in lines if words[0] == "ODOM"][-1]
    assert [float(word) for word in last[1:3]] == [log.odometry.x_um[-1] / 1e6, log.odometry.y_um[-1] / 1e6]
    laser = next(words for words in lines if words[0] == "ROBOTLASER1")
    beams = int(laser[8])
    after = laser[9 + beams :]  # remissions, laser pose, robot pose, speeds, safety, turn axis, times and host
    assert (beams, after[0], len(after), after[1:4]) == (360, "0", 15, after[4:7])
    sonar = next(words for words in lines if words[0] == "SONAR")
    assert (sonar[2], len(sonar)) == ("1", 10)


def test_forms_that_cannot_say_where_odometry_starts_anew_say_that_it_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "reset.mcap"
    with RecordingWriter(path, started_wall_ns=0, command_line="", config={}) as out:
        out.identity({}, load_robot("amigo-sh"))
        for k in range(30):
            x = 100 * (k % 20)  # the robot was switched off and on again
            out.wire(k * 10**8 + 10**11 * (k >= 20), "rx", frame(Sip(x=x, sonar=((k % 8, 1000),)).encode()))
    for name, said in (("csv", True), ("carmen", True), ("tum", True), ("json", False)):
        capsys.readouterr()
        assert run(["export", str(path), "--format", name, "-o", "-"]) == 0
        assert (f"odometry starts anew once in {path}; {name} cannot say where" in capsys.readouterr().err) == said


def test_who_watches_hears_of_a_hundred_parts_in_order(short_recording: Path, tmp_path: Path) -> None:
    heard: list[tuple[int, int]] = []
    export_file(Asked(short_recording, "csv", output=tmp_path / "a.csv"), lambda *parts: heard.append(parts))
    assert heard == sorted(heard)
    assert {count for _, count in heard} == {100}
    assert heard[0][0] < 10 < READ < heard[-1][0]


def test_a_sweep_in_a_corridor_is_a_scan_of_its_walls() -> None:
    found = pseudo_scan(load_robot("amigo-sh"), scan(corridor(width=2.0), scan_pose := Pose(0.5, 0.0, 0.0), scan_pose))
    assert len(found) == 360
    assert found[90] == pytest.approx(1.0, abs=0.02)
    assert found[270] == pytest.approx(1.0, abs=0.02)
    assert found[180] == found[0] == 5.0


def test_the_true_map_is_one_that_eval_takes(short_recording: Path, tmp_path: Path) -> None:
    sheet = tmp_path / "true.yaml"
    assert run(["export", str(short_recording), "--format", "map", "-o", str(sheet)]) == 0
    true = read_true_map(sheet)
    stations = np.array([(0.0, 0.0)])
    log = read_log(short_recording)
    assert log.surfaces
    middles = 0.5 * (log.surfaces.segments[:, :2] + log.surfaces.segments[:, 2:])
    assert (true.distance(middles) <= 0.01).all()
    assert true.is_free(np.array([(0.0, 0.0), (1.0, 0.2)]), stations, 0.05).all()
    assert not true.is_free(np.array([(0.0, -1.02), (0.0, 1.02)]), stations, 0.05).any()


def test_a_run_as_tables_and_json(
    short_run: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("csv", "walls", "json", "png", "map", "tum"):
        assert run(["export", str(short_run), "--format", name]) == 0
    made = read_run(short_run)
    with Path("short.paper.csv").open(encoding="utf-8", newline="") as stream:
        poses = list(csv.DictReader(stream))
    assert [float(row["pose_x_m"]) for row in poses] == pytest.approx([s.pose.x for s in made.sweeps], abs=1e-6)
    assert all(row["truth_x_m"] for row in poses)
    data = json.loads(Path("short.paper.json").read_text(encoding="utf-8"))
    assert (data["digest"], len(data["walls"])) == (made.digest, len(made.chains.members))
    names = {"csv", "json", "pgm", "png", "tum", "walls.csv", "yaml"}
    assert {path.name for path in tmp_path.iterdir()} == {f"short.paper.{name}" for name in names}
    capsys.readouterr()
    assert run(["export", str(short_run), "--format", "tum", "--path", "odometry", "-o", "-"]) == 0
    out, err = capsys.readouterr()
    assert (len(out.splitlines()), err) == (SCANS, "")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            "RECORDING --format walls",
            "which has no walls: replay it and export the run, or the recording as",
        ),
        ("RECORDING --format tum --path final", "is a recording, which has no final path"),
        ("RUN --format carmen", "is a run, which holds no readings: export the recording as carmen"),
        ("RUN --format bag", "'bag' is not one of 'csv', 'tum'"),
        ("RUN --format csv --path truth", "--path goes with --format tum alone"),
        ("RUN --format map -o -", "--format map is no text"),
        ("RUN --format map -o m.png", "the sheet of a map ends in .yaml"),
        ("RUN --format csv -o taken.csv", "taken.csv exists and is not overwritten"),
        ("RUN --format csv -o no/where.csv", "cannot write no/where.csv: No such file or directory"),
        ("taken.csv --format csv", "taken.csv is no MCAP file"),
    ],
)
def test_what_cannot_be_exported_is_said_in_one_sentence(
    short_recording: Path,
    short_run: Path,
    words: str,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken.csv").write_text("mine", encoding="utf-8")
    capsys.readouterr()
    known = {"RECORDING": str(short_recording), "RUN": str(short_run)}
    assert run(["export", *(known.get(word, word) for word in words.split())]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["taken.csv"]
