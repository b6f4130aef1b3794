"""Time per block: what a run keeps of it, and that the result does not hang on it."""

from itertools import count
from pathlib import Path

import pytest

from cli.main import run as sonarlog
from slam.algorithms import algorithm
from sonarlog.replay import replay
from sonarlog.runs import read_run
from sonarlog.times import TIMED, BlockTimes, Stopwatch, times_in
from tests.conftest import SCANS


def test_a_watch_hears_every_block_of_every_sweep_and_not_what_lies_between() -> None:
    moments = iter([0, 1, 3, 6, 10, 15, 21, 28, 36, 1000, 1001, 1003, 1006, 1010, 1015, 1021, 1028, 1036])
    watch = Stopwatch(lambda: 1000 * next(moments))
    for letter in 2 * "ABCDEFGHI":
        watch(letter)
    times = watch.times()
    assert times.taken_us == {block: (k, k) for k, block in enumerate(TIMED, 1)}
    assert (times.median_ms("E"), times.median_ms(), times.total_ms("E"), times.total_ms()) == (
        0.004,
        0.036,
        0.008,
        0.072,
    )


def test_a_run_keeps_its_times_and_they_are_no_part_of_its_result(short_recording: Path, tmp_path: Path) -> None:
    ticks = count(0, 2000)
    timed = replay(short_recording, algorithm("paper"), tmp_path / "timed.mcap", clock=lambda: next(ticks))
    plain = replay(short_recording, algorithm("paper"), tmp_path / "plain.mcap")
    assert timed == plain
    times = read_run(tmp_path / "timed.mcap").times
    assert times == BlockTimes(dict.fromkeys(TIMED, (2,) * SCANS))
    assert read_run(tmp_path / "plain.mcap").times is None


def test_info_tells_them(short_run: Path, short_recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sonarlog(["info", str(short_run)]) == 0
    assert " ms a sweep (B " in capsys.readouterr().out
    assert sonarlog(["verify", str(short_run), str(short_recording), "-q"]) == 0


def test_times_of_another_make_are_none() -> None:
    times = BlockTimes(dict.fromkeys(TIMED, (1, 2)))
    kept = times.as_metadata()
    assert times_in({"times": kept}) == times
    for broken in ({}, {**kept, "E_us": "[1]"}, {**kept, "E_us": "[1,-2]"}, {**kept, "E_us": "1"}, {"E_us": "[1,2]"}):
        assert times_in({"times": broken}) is None
    with pytest.raises(ValueError, match="not of B, C"):
        BlockTimes({"E": (1,)})
