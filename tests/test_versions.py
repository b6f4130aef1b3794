"""Old recordings: files of every version so far are read, newer ones refused by name, altered metadata is told."""

from pathlib import Path

import pytest

from cli.main import run
from sonarlog.mcap_file import McapReader, McapWriter, copy
from sonarlog.recording import open_recording, read_log, recording_digest, versions

DATA = Path(__file__).parent / "data"


@pytest.mark.parametrize("version", range(1, versions.VERSION + 1))
def test_a_file_of_each_version_reads_the_same(version: int) -> None:
    path = DATA / f"recording-v{version}.mcap"
    assert McapReader(path).metadata["recording"]["schema_version"] == str(version)
    file = open_recording(path)
    assert file.damage == ()
    assert file.metadata["recording"]["port"] == "sim://corridor?seed=1"
    log = read_log(path)
    assert (len(log.odometry.t_ns), len(log.readings.t_ns)) == (330, 825)
    assert recording_digest(path) == recording_digest(DATA / "recording-v1.mcap")
    assert run(["check", str(path)]) == 0


def with_metadata(path: Path, change: dict[str, str]) -> Path:
    source = McapReader(DATA / f"recording-v{versions.VERSION}.mcap")
    with McapWriter(path) as target:
        copy(source, target)
        target.metadata("recording", change)
    return path


def test_a_newer_one_is_refused_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = with_metadata(tmp_path / "new.mcap", {"schema_version": str(versions.VERSION + 1)})
    for command in ("info", "replay", "check"):
        assert run([command, str(path)]) == 2
        assert f"schema version {versions.VERSION + 1}; this sonarlog reads up to" in capsys.readouterr().err


def test_altered_metadata_is_damage(tmp_path: Path) -> None:
    path = with_metadata(tmp_path / "altered.mcap", {"started_wall_ns": "17"})
    assert read_log(path).counts["damage"] == 1
    assert "the metadata 'recording' fails its checksum" in open_recording(path).damage[0]


def test_a_wire_without_its_robot_is_read_with_what_the_handshake_says(tmp_path: Path) -> None:
    source = McapReader(DATA / "recording-v1.mcap")
    path = tmp_path / "anonymous.mcap"
    with McapWriter(path) as target:
        channel = target.channel("/wire", "sonarlog_msgs/msg/Wire", "")
        target.metadata("recording", source.metadata["recording"])
        for message in source.stream({"/wire"}):
            target.write(channel, message.log_time_ns, message.data)
    log = read_log(path)
    assert "it does not say of which robot it is; amigo-sh is assumed" in log.missing[0]
    assert len(log.readings.t_ns) == 825
