"""Conditions, tolerances and reports for CI, on a report whose numbers are known."""

import json
import pickle
from pathlib import Path
from xml.etree import ElementTree

import pytest

from cli.main import run as sonarlog
from sonarlog.diff import BadTolerance, Report, Tolerance, diff_runs
from sonarlog.diff.figures import figures
from sonarlog.diff.gate import BadCondition, Condition, is_condition
from sonarlog.diff.junit import junit
from sonarlog.diff.outcome import Outcome, judged, summary
from sonarlog.errors import SonarlogError
from sonarlog.runs import Run
from tests.made_runs import drifting, made_run

HOME = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Run]:
    folder, sweeps = tmp_path_factory.mktemp("gate"), drifting()
    return made_run(folder / "a.run.mcap", "paper", sweeps), made_run(folder / "b.run.mcap", "odometry", sweeps)


@pytest.fixture(scope="module")
def report(runs: tuple[Run, Run]) -> Report:
    return diff_runs(*runs)


def test_conditions(report: Report) -> None:
    known = figures(report)
    a, b = known["ate"].sides or (0.0, 0.0)
    assert b > 2 * a > 0
    cases = {
        "ate>+5%": True, f"ate>+{100 * (b - a) / a + 1:.3f}%": False, f"ate > {b - 1e-4:.5f}": True,
        f"ate>{b + 1e-4:.5f}": False, f"ate>+{b - a - 1e-4:.5f}": True, "ate<+0%": False, "cells.changed>1%": True,
        "cells.changed>1": True, "cells.changed>99%": False, "sweeps<+0": False, "sweeps>=5": True,
        "walls.gone>100": False,
    }  # fmt: skip
    assert {text: Condition.parse(text).reason(report) is not None for text in cases} == cases
    assert Condition.parse("cells.changed>1%").reason(report) == (
        f"cells.changed>1%: cells.changed is {known['cells.changed'].value:.4g} %"
    )
    for text, words in {
        "ate>5%": "its growth is ate>\\+5%", "walls.gone>+1": "has no growth", "speed>1": "there is no figure 'speed'",
        "ate": "a condition is written", "ate>five": "a condition is written",
    }.items():  # fmt: skip
        with pytest.raises(BadCondition, match=words):
            Condition.parse(text).reason(report)
    assert not is_condition("recordings/corridor.mcap")


def test_tolerances(runs: tuple[Run, Run], tmp_path: Path) -> None:
    assert Tolerance.parse("5mm, 0.1deg,20cells") == Tolerance(5, 0.1, 20)
    assert Tolerance.parse("1.5cm") == Tolerance(15, 0, 0)
    for text in ("5", "5 miles", "mm", "-5mm"):
        with pytest.raises(BadTolerance, match="is written 5mm"):
            Tolerance.parse(text)
    other = made_run(tmp_path / "c.run.mcap", "paper", drifting(), {"map.wall": 10})
    wide = diff_runs(runs[0], other, tolerance=Tolerance(1, 0.1, 10_000))
    assert (wide.same, wide.verdict) == (False, "within")
    assert wide.headline.startswith("The same within 1 mm, 0.1° and 10000 cells, though not identical. Different from")
    assert diff_runs(runs[0], other, tolerance=Tolerance(1, 0.1, 1)).verdict == "changed"
    assert diff_runs(*runs, tolerance=Tolerance(1, 0.1, 100_000)).verdict == "changed"


def test_outcomes_and_junit(report: Report, runs: tuple[Run, Run]) -> None:
    same = diff_runs(runs[0], runs[0])
    outcomes = [
        judged("kept", report, [Condition.parse("walls.gone>100")]),
        judged("broken", report, [Condition.parse("ate>+5%")]),
        judged("free", report, []),
        judged("same", same, []),
        Outcome("none", None, "it cannot be read\x00"),
    ]
    assert [outcome.bad for outcome in outcomes] == [False, True, True, False, True]
    assert summary(outcomes) == "3 changed, 1 the same, 1 failed"
    root = ElementTree.fromstring(junit(outcomes))
    suite = root[0]
    assert suite.attrib == {"name": "sonarlog diff", "tests": "5", "failures": "2", "errors": "1"}
    assert [[child.tag for child in case] for case in suite] == [
        ["system-out"], ["failure", "system-out"], ["failure", "system-out"], ["system-out"], ["error"],
    ]  # fmt: skip
    assert suite[1][0].attrib["message"].startswith("ate>+5%: ate went from")


def test_the_command_keeps_the_gate(runs: tuple[Run, Run], capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    a, b = (str(run.path) for run in runs)
    assert sonarlog(["diff", a, b, "--fail-on", "walls.gone>100"]) == 0
    assert sonarlog(["diff", a, b, "--fail-on", "walls.gone>100", "ate>+5%", "--junit", str(tmp_path / "j.xml")]) == 1
    assert "Not kept: ate>+5%: ate went from" in capsys.readouterr().out
    assert ElementTree.parse(tmp_path / "j.xml").getroot()[0].attrib["failures"] == "1"
    assert sonarlog(["diff", a, a, "--fail-on", "nothing>1"]) == 2
    assert sonarlog(["diff", a, b, "--tolerance", "10m,180deg,100000cells"]) in (0, 1)


def test_the_json_is_as_documented(runs: tuple[Run, Run], report: Report, capsys: pytest.CaptureFixture[str]) -> None:
    assert sonarlog(["diff", *(str(run.path) for run in runs), "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    text = (HOME / "docs" / "diff.md").read_text(encoding="utf-8")
    for key in data:
        assert f"`{key}`" in text
    for name in figures(report):
        assert f"`{name}`" in text, name
    assert data["figures"]["ate"] == pytest.approx(data["truth"]["b"]["ate_m"])


@pytest.mark.parametrize("error", SonarlogError.__subclasses__())
def test_errors_of_the_diff_survive_a_process(error: type[SonarlogError]) -> None:
    if error.__module__.startswith(("sonarlog.diff", "sonarlog.cache", "sonarlog.sides", "sonarlog.bisect")):
        made = error(Path("folder"), "why") if error.__name__ == "NoCache" else error("what")
        assert type(pickle.loads(pickle.dumps(made))) is error
