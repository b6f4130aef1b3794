"""What a diff says of times: on runs that say how long their blocks took."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from cli.diff_text import tell_many
from cli.main import run as sonarlog
from sonarlog.diff import FirstDifference, Report, diff_runs
from sonarlog.diff.figures import figures
from sonarlog.diff.gate import BadCondition, Condition
from sonarlog.diff.outcome import Outcome
from sonarlog.diff_page import page
from sonarlog.runs import Run, read_run
from sonarlog.times import TIMED, BlockTimes
from tests.made_runs import drifting, made_run

DOCUMENTED = (Path(__file__).parents[1] / "docs" / "diff.md").read_text(encoding="utf-8")


def milliseconds(**of: int) -> BlockTimes:
    """So many of every sweep by these blocks, 1 ms by the others."""
    return BlockTimes({block: (1000 * of.get(block, 1),) * 5 for block in TIMED})


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Run]:
    """The same twice, but for E and H of the second."""
    folder, sweeps = tmp_path_factory.mktemp("times"), drifting()
    a = made_run(folder / "a.run.mcap", "paper", sweeps, times=milliseconds(E=10))
    return a, made_run(folder / "b.run.mcap", "paper", sweeps, times=milliseconds(E=15, H=3))


@pytest.fixture(scope="module")
def report(runs: tuple[Run, Run]) -> Report:
    return diff_runs(*runs, now=(True, True))


def test_the_same_map_in_more_time_is_the_same_and_the_time_is_told(report: Report) -> None:
    assert report.verdict == "same"
    times = report.times
    assert times is not None
    assert [(row.block, row.a_ms, row.b_ms, row.ratio) for row in times.telling] == [
        ("E", 10, 15, 1.5), ("H", 1, 3, 3), ("", 17, 24, pytest.approx(24 / 17)),
    ]  # fmt: skip
    assert times.words == "both measured now on this machine; less than × 1.3 may be noise"


def test_swapped_sides_give_the_mirrored_times(runs: tuple[Run, Run]) -> None:
    there, back = (
        diff_runs(*pair, now=now).times for pair, now in ((runs, (True, False)), (runs[::-1], (False, True)))
    )
    assert there is not None
    assert there.mirrored() == back
    assert there != back


def test_what_the_numbers_are_worth(runs: tuple[Run, Run]) -> None:
    a, b = runs
    abroad = replace(b, machine={**b.machine, "host": "elsewhere"})
    newer = replace(b, machine={**b.machine, "numpy": "9.9"})
    cases = [
        (b, (False, False), "of one machine, both kept from earlier; less than × 2 "),
        (b, (True, False), "of one machine, B kept from earlier; less than × 2 "),
        (b, (False, True), "of one machine, A kept from earlier; less than × 2 "),
        (abroad, (False, False), "of two machines (host "),
        (newer, (False, False), "of other libraries (numpy "),
    ]
    for other, now, words in cases:
        times = diff_runs(a, other, now=now).times
        assert times is not None
        assert times.words.startswith(words)
        assert [row.block for row in times.telling] == ["H"]


def test_a_gate_on_times(report: Report, runs: tuple[Run, Run]) -> None:
    cases = {"time.E>+20%": True, "time.E>+50%": False, "time.E>14": True, "time>+6": True, "time.B>+0": False}
    assert {text: Condition.parse(text).reason(report) is not None for text in cases} == cases
    assert Condition.parse("time.E>+20%").reason(report) == "time.E>+20%: time.E went from 10 to 15 ms (+50.0 %)"
    untimed = diff_runs(runs[0], replace(runs[1], times=None))
    assert untimed.times is None
    with pytest.raises(BadCondition, match="times must be kept in both runs"):
        Condition.parse("time.E>+20%").reason(untimed)


def test_json_and_page_have_them_as_documented(report: Report) -> None:
    told = report.as_dict()["times"]
    assert [row["block"] for row in told["blocks"]] == [*TIMED, ""]
    assert all(f"`{key}`" in DOCUMENTED for key in (*told, *told["blocks"][0]))
    assert all(f"`{name}`" in DOCUMENTED for name in figures(report) if name.startswith("time"))
    assert "<th>E feature association</th><td>10.0</td><td>15.0</td><td><b>× 1.50</b></td>" in page(report)


def test_the_command_tells_them_where_they_say_something_or_when_asked(
    runs: tuple[Run, Run], capsys: pytest.CaptureFixture[str]
) -> None:
    a, b = (str(run.path) for run in runs)
    assert sonarlog(["diff", a, b]) == 0
    told = capsys.readouterr().out
    assert "H map extension" in told
    assert "E feature association" not in told
    assert sonarlog(["diff", a, b, "-v"]) == 0
    assert "E feature association" in capsys.readouterr().out
    assert sonarlog(["diff", a, a]) == 0
    assert "ms a sweep" not in capsys.readouterr().out


def test_of_many_diffs_a_line_each(report: Report, capsys: pytest.CaptureFixture[str]) -> None:
    changed = replace(
        report, first=FirstDifference(0, "E", "feature association", ("one", "other"), {}, (None, None), ())
    )
    tell_many([Outcome("changed", changed), Outcome("same", report)])
    told = [line.strip() for line in capsys.readouterr().out.splitlines() if "Times" in line]
    assert len(told) == 1
    assert told[0].startswith("Times: E × 1.50, H × 3.00, all blocks × 1.41; both measured now on this machine")


def test_what_was_replayed_for_the_diff_is_told_from_what_was_kept(
    short_recording: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SONARLOG_CACHE", str(tmp_path))
    command = ["diff", f"{short_recording}@odometry", f"{short_recording}@odometry:map.wall=20", "--json", "-q"]
    nows = []
    for _ in range(2):
        assert sonarlog(command) == 1
        nows.append(json.loads(capsys.readouterr().out)["times"]["now"])
    assert nows == [[True, True], [False, False]]
    assert all(read_run(path).times for path in tmp_path.glob("*.run.mcap"))
