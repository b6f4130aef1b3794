"""sonarlog info: facts of recordings and runs as text and as JSON, one sentence for anything else."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cli.info import command
from cli.main import run
from sonarlog.calibration.correction import Calibration
from sonarlog.calibration.robot_file import write_robot
from sonarlog.info import Gap, RunInfo, UnknownRun, gaps, info
from sonarlog.log import Surfaces
from sonarlog.mcap_file import McapWriter
from sonarlog.protocol.framing import frame
from sonarlog.protocol.packets import SimStat, Sip
from sonarlog.recording import RecordingWriter, recording_digest
from sonarlog.recording.versions import VERSION
from sonarlog.robot import load_robot

SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A turn of 360° in 30 s, with two seconds of silence behind it, then one more SIP and a broken one."""
    path = tmp_path_factory.mktemp("info") / "turn.mcap"
    none = np.zeros((0, 4)), np.zeros((0, 3))
    with RecordingWriter(path, started_wall_ns=1_790_000_000 * SECOND, command_line="record it", config={}) as out:
        out.identity({"NAME": "somebody", "serial": "4711"}, load_robot("amigo-sh"))
        out.surfaces(Surfaces("nowhere", *none))
        for k in range(302):
            t_ns = k * SECOND // 10 + 2 * SECOND * (k == 301)
            heading = (min(k, 300) * 4096 // 300 + 2048) % 4096 - 2048
            fired = (((2 * k) % 8, 1000), ((2 * k + 1) % 8, 5000))
            data = frame(Sip(heading=heading, sonar=fired).encode()) + frame(SimStat(0, 0, 0, 0).encode())
            out.wire(t_ns, "rx", data)
        out.wire(33 * SECOND, "rx", frame(Sip().encode())[:-1] + b"?" + b"rubbish")
        out.event(33 * SECOND, "warn", "a bad packet")
    return path


def test_facts_of_a_recording(recording: Path) -> None:
    result = CliRunner().invoke(command, [str(recording)])
    facts = {line[:10].strip(): line[12:] for line in result.output.splitlines()}
    assert facts["robot"] == "amigo-sh, 8 sonars (somebody, 4711)"
    assert facts["recorded"] == "32.1 s from 2026-09-21T14:13:20+00:00"
    assert facts["sweeps"] == "1 scan"
    assert facts["readings"] == "604 (50 % without echo)"
    assert "1 bad packets" in facts["decoded"]
    assert facts["gaps"] == "1: 2.1 s at 30.0 s"
    assert facts["truth"] == "302 poses, surfaces of nowhere"
    assert facts["events"] == "1 warn"
    assert facts["topics"] == "/rosout 1, /tf_static 1, /wire 303"
    assert facts["made by"] == f"record it, schema {VERSION}, sonarlog 0.1.0"
    assert facts["digest"] == recording_digest(recording)
    assert "damage" not in facts


def test_json_says_the_same(recording: Path) -> None:
    data = json.loads(CliRunner().invoke(command, [str(recording), "--json"]).output)
    assert data["kind"] == "recording"
    assert data["sweeps"] == {"scan": 1}
    assert data["gaps"] == [{"at_s": 30.0, "seconds": 2.1}]
    assert data["identity"] == {"NAME": "somebody", "serial": "4711"}
    assert data["damage"] == []


def test_a_damaged_recording_is_told(recording: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recording.read_bytes()[:-1000])
    result = CliRunner().invoke(command, [str(cut)])
    assert result.exit_code == 0
    assert "cut off" in result.output.splitlines()[-1]


def test_facts_of_a_run(tmp_path: Path) -> None:
    path = tmp_path / "a.run.mcap"
    identity = {
        "recording_digest": "12",
        "algorithm": "paper",
        "algorithm_version": 3,
        "config": {"grid": {"cell_m": 0.05}},
        "code_digest": "34",
    }
    with McapWriter(path) as writer:
        run_data = {"version": "1", "sweeps": "7", "map_digest": "56", "digest": "78", "counts": '{"readings": 90}'}
        writer.metadata("run", {**run_data, "identity": json.dumps(identity)})
        writer.metadata("machine", {"python": "3.11"})
    found = info(path)
    assert isinstance(found, RunInfo)
    assert (found.algorithm, found.algorithm_version, found.sweeps, found.digest) == ("paper", 3, 7, "78")
    facts = dict(found.facts())
    assert facts["machine"] == "python 3.11"
    assert facts["used"] == "90 readings"


def test_what_a_robot_was_calibrated_to_is_told_of_recordings_and_of_runs(
    short_recording: Path, tmp_path: Path
) -> None:
    calibration = Calibration(1.01, 0.99, -0.5, 1.0, (0.0,) * 7 + (-2.0,), {"sonar_deg": [math.nan]}, ("12",))
    robot = replace(load_robot("amigo-sh"), calibration=calibration)
    text = "rotation × 1.0100, distance × 0.9900, drift -0.50°/m, sonars turned by -1.0° to +1.0°; found in 1 recording"
    recording, made = tmp_path / "a.mcap", tmp_path / "a.run.mcap"
    with RecordingWriter(recording, started_wall_ns=SECOND, command_line="record it", config={}) as out:
        out.identity({}, robot)
        out.wire(SECOND, "rx", frame(Sip().encode()))
    found = info(recording)
    assert dict(found.facts())["calibrated"] == text
    assert found.as_dict()["calibration"]["sigma"] == {"sonar_deg": [None]}
    write_robot(robot, tmp_path / "mine.toml")
    words = f"--algorithm odometry --robot {tmp_path / 'mine.toml'} -o {made} -q".split()
    assert run(["replay", str(short_recording), *words]) == 0
    assert dict(info(made).facts())["robot"] == f"amigo-sh, given with --robot: {text}"
    assert "calibrated" not in dict(info(short_recording).facts())


def test_a_run_of_another_make_is_refused(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "a.run.mcap") as writer:
        writer.metadata("run", {"version": "99"})
    with pytest.raises(UnknownRun, match=r"a\.run\.mcap is a run, but"):
        info(tmp_path / "a.run.mcap")


@pytest.mark.parametrize("text", ["", "no MCAP at all"])
def test_other_files_are_refused_in_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str) -> None:
    path = tmp_path / "x.mcap"
    path.write_text(text)
    assert run(["info", str(path)]) == 2
    assert capsys.readouterr().err.startswith(f"sonarlog: {path} is no MCAP file")


def test_gaps() -> None:
    times = np.array([5, 5.1, 5.6, 6.2, 9.2]) * SECOND
    assert gaps(times.astype(np.int64)) == (Gap(0.6, 0.6), Gap(1.2, 3.0))
    assert gaps(np.zeros(0, dtype=np.int64)) == ()
