"""Nothing that was recorded is lost: killed recorders, full disks, flipped bits, files cut anywhere."""

import json
import random
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from sonarlog.errors import SonarlogError
from sonarlog.log import Log
from sonarlog.mcap_file import McapReader, partial_path
from sonarlog.recording import read_log, recording_digest
from tests.processes import robot, start

FASTER = 20


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sound") / "a.mcap"
    arguments = ["--port", "sim://corridor?speed=20", "-o", str(path), "--route", "scan; go 0.3", "-q"]
    assert run(["record", *arguments]) == 0
    return path


def killed(folder: Path, after_s: float, port: str) -> tuple[Path, float]:
    """A recorder killed so long after its first packet; its file and the seconds between the last packet in it and
    the kill.
    """
    path = folder / "a.mcap"
    recorder = start("record", "--port", port, "--speed", str(FASTER), "-o", str(path), "--drive", "none", "-v")
    assert recorder.stderr is not None
    while "connected to" not in recorder.stderr.readline():
        assert recorder.poll() is None
    time.sleep(after_s)
    killed_ns = time.time_ns()
    recorder.kill()
    recorder.communicate()
    part = partial_path(path)
    last_ns = int(read_log(part).odometry.t_ns[-1])
    started_ns = int(McapReader(part).metadata["recording"]["started_wall_ns"])
    return part, (killed_ns - started_ns - last_ns / FASTER) / 1e9


def losses(folder: Path, moments: list[float]) -> list[float]:
    found = []
    with robot("--listen", "127.0.0.1:0", speed=str(FASTER)) as port:
        for k, after_s in enumerate(moments):
            (folder / str(k)).mkdir()
            part, lost_s = killed(folder / str(k), after_s, port)
            output = folder / f"{k}.mcap"
            assert run(["recover", str(part), "-o", str(output)]) in (0, 1)
            assert McapReader(output).damage == ()
            np.testing.assert_array_equal(read_log(output).odometry.t_ns, read_log(part).odometry.t_ns)
            found.append(lost_s)
    return found


def test_kill_9_costs_a_second_at_most(tmp_path: Path) -> None:
    chance = random.Random(1)
    found = losses(tmp_path, [1.2 + chance.random() for _ in range(3)])
    assert max(found) < 1.1, found


@pytest.mark.slow
def test_kill_9_at_fifty_moments(tmp_path: Path) -> None:
    def some(batch: int) -> list[float]:
        chance = random.Random(batch)
        (tmp_path / str(batch)).mkdir()
        return losses(tmp_path / str(batch), [1.2 + 1.5 * chance.random() for _ in range(10)])

    with ThreadPoolExecutor(2) as pool:
        found = [lost_s for batch in pool.map(some, range(5)) for lost_s in batch]
    print(f"lost: median {np.median(found):.2f} s, at most {max(found):.2f} s of {len(found)} kills")  # noqa: T201
    assert max(found) < 1.2, found


def test_a_full_disk_leaves_a_file_that_is_whole_to_its_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, new = tmp_path / "a.mcap", tmp_path / "new.mcap"
    recorder = start("record", "--port", "sim://corridor?speed=30", "-o", str(path), largest_file=80_000)
    talk = recorder.communicate(timeout=60)[1]
    assert recorder.returncode == 2, talk
    assert "File too large; what was written before is kept there, whole" in talk
    assert "never finished" in McapReader(partial_path(path)).damage[0]
    assert run(["info", str(path)]) == 2
    assert "a.mcap.part is there" in capsys.readouterr().err
    for command in (["info"], ["recover", "-o", str(new)], ["replay", "--algorithm", "odometry", "-o", f"{new}.run"]):
        assert run([command[0], str(partial_path(path)), *command[1:]]) == 0
    said = capsys.readouterr()
    assert "never finished: it ends after byte" in said.out  # info
    assert "never finished: it ends after byte" in said.err  # replay
    assert McapReader(new).damage == ()
    assert recording_digest(new) == recording_digest(partial_path(path))


def middle_chunk(data: bytearray) -> int:
    """Some byte of the compressed content of a chunk in the middle."""
    found = [at for at in range(len(data)) if data.startswith(b"\x04\0\0\0zstd", at)]
    return found[len(found) // 4] + 200  # the summary repeats the pattern


def test_recover_says_what_is_missing_and_so_does_the_new_file(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = bytearray(sound.read_bytes())
    data[middle_chunk(data)] ^= 0x10
    bad, new = tmp_path / "bad.mcap", tmp_path / "new.mcap"
    bad.write_bytes(data)
    assert run(["recover", str(bad), "-o", str(new)]) == 1
    assert "chunk at byte" in capsys.readouterr().err
    assert McapReader(new).damage == ()
    assert 100 < len(read_log(new).odometry.t_ns) < len(read_log(sound).odometry.t_ns)
    assert run(["info", "--json", str(new)]) == 0
    assert "was recovered" in json.loads(capsys.readouterr().out)["damage"][0]


def test_a_chunk_whose_length_is_wrong_costs_no_other(sound: Path, tmp_path: Path) -> None:
    data = bytearray(sound.read_bytes())
    head = middle_chunk(data) - 200 - 37
    data[head + 1 + 2] ^= 0xFF
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(data)
    whole, rest = read_log(sound), read_log(bad)
    assert rest.odometry.t_ns[-1] == whole.odometry.t_ns[-1]
    assert "unreadable and left out" in McapReader(bad).damage[0]


def test_a_chunk_that_lost_its_mark_is_found_again(sound: Path, tmp_path: Path) -> None:
    data = bytearray(sound.read_bytes())
    data[middle_chunk(data) - 200 - 37] ^= 1
    bad, new = tmp_path / "bad.mcap", tmp_path / "new.mcap"
    for kept in (len(data), 3 * len(data) // 4):
        bad.write_bytes(data[:kept])
        assert run(["recover", str(bad), "-o", str(new), "--force"]) == (kept < len(data))
        assert "lost its mark" in McapReader(bad).damage[0]
        assert len(McapReader(new).messages()) == len(McapReader(bad).messages())
        if kept == len(data):
            assert recording_digest(new) == recording_digest(sound)


@pytest.mark.parametrize("what", ["nothing in it", "no MCAP", "not there", "output there"])
def test_what_cannot_be_recovered(what: str, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bad, new = tmp_path / "bad.mcap", tmp_path / "new.mcap"
    if what == "output there":
        new.write_bytes(b"precious")
    if what != "not there":
        whole = sound.read_bytes()
        bad.write_bytes({"nothing in it": whole[:100], "no MCAP": b"hello"}.get(what, whole))
    assert run(["recover", str(bad), "-o", str(new)]) == 2
    assert "sonarlog: " in capsys.readouterr().err
    assert new.exists() == (what == "output there")


def reported_or_right(path: Path, right: Log) -> None:
    """A reading that is not in the original is a lie, unless something was reported."""
    try:
        log = read_log(path)
    except SonarlogError:
        return
    if log.counts.get("damage"):
        return
    for name, column in vars(right.readings).items():
        np.testing.assert_array_equal(vars(log.readings)[name], column)


def flip_and_cut(sound: Path, tmp_path: Path, flips: int, cuts: int) -> None:
    data, right = sound.read_bytes(), read_log(sound)
    chance = random.Random(flips)
    bad = tmp_path / "bad.mcap"
    for _ in range(flips):
        bit = chance.randrange(64, 8 * len(data))
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        bad.write_bytes(flipped)
        reported_or_right(bad, right)
    for _ in range(cuts):
        bad.write_bytes(data[: chance.randrange(8, len(data))])
        reported_or_right(bad, right)


def test_no_flipped_bit_and_no_cut_gives_a_wrong_reading(sound: Path, tmp_path: Path) -> None:
    flip_and_cut(sound, tmp_path, 20, 10)


@pytest.mark.slow
def test_300_flipped_bits_and_100_cuts(sound: Path, tmp_path: Path) -> None:
    flip_and_cut(sound, tmp_path, 300, 100)
