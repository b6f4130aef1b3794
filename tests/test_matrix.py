"""A short part of the matrix: another machine in software gives the same bits. All of it: make determinism."""

import subprocess
import sys
from pathlib import Path

import pytest

from slam.algorithms import DEFAULT
from tests.matrix.configurations import Configuration, at_hand
from tests.matrix.probe import explored
from tests.matrix.table import DIFFERS, FAILED, IDLE, SAME, SKIPPED, Outcome, outcomes, page


def test_the_worst_machine_gives_the_bits_of_this_one(tmp_path: Path) -> None:
    first, *_, worst = at_hand()
    if worst.skipped:
        pytest.skip(worst.skipped)
    explored(tmp_path / "exploration.mcap")
    base, other = outcomes([first, worst], ["--short", str(tmp_path / "exploration.mcap")], [])
    assert other.verdict == SAME, other.why
    assert set(other.changed) == {"numpy", "libm", "blas", "hash"}
    assert {"dmath", "embedded robot, wire", f"embedded robot, {DEFAULT}", "exploration, decisions"} <= set(
        base.results
    )


class Told(Configuration):
    """One whose probe says what the test wants."""

    def run(self, arguments: list[str]) -> str:
        return self.environment["says"]


def told(name: str, canary: str, result: str, *claims: str) -> Told:
    says = f'{{"facts": {{}}, "canaries": {{"libm": "{canary}"}}, "results": {{"r": "{result}"}}}}'
    return Told(name, environment={"says": says}, claims=claims)


def test_each_verdict() -> None:
    broken = Configuration("broken", (sys.executable, "-c", "import sys; sys.exit('no luck')"))
    found = list(
        outcomes(
            [
                told("base", "1", "a"),
                told("proves", "2", "a", "libm"),
                told("idle", "1", "a", "libm"),
                told("other", "2", "b", "libm"),
                Configuration("absent", skipped="no such machine"),
                broken,
            ],
            [],
            [],
        )
    )
    assert [each.verdict for each in found] == [SAME, SAME, IDLE, DIFFERS, SKIPPED, FAILED]
    assert [each.well for each in found] == [True, True, False, False, True, False]
    rows = page(found).splitlines()[2:8]
    assert rows[1].split(" | ")[-1] == rows[0].split(" | ")[-1] != rows[3].split(" | ")[-1]
    assert "no such machine" in rows[4]
    assert "no luck" in rows[5]


def test_a_replay_loads_nothing_but_numpy_and_mcap() -> None:
    question = (
        "import sys, slam.algorithms, sonarlog.replay, sonarlog.recorder, sonarlog.sim.link;"
        "print(sorted({m.split('.')[0] for m in sys.modules} & {'rerun', 'PIL', 'serial', 'click', 'rich', 'pyarrow'}))"
    )
    made = subprocess.run([sys.executable, "-c", question], capture_output=True, text=True, check=True)
    assert made.stdout == "[]\n"


def test_an_outcome_without_results_has_no_digest() -> None:
    assert page([Outcome("a", SAME, results={"x": "1"}), Outcome("b", SKIPPED)]).splitlines()[3].endswith("|  |")
