"""A replay that goes on from a checkpoint ends with the digest of the whole one."""

import json

import pytest

from cli.main import run as sonarlog
from slam.algorithms import algorithm
from slam.pipeline import State
from sonarlog.canonical import canonical, read_canonical
from sonarlog.checkpoints import read_checkpoints, stretch_is_same, stretches
from sonarlog.restore import restored
from sonarlog.runs import Run, read_run
from tests.golden_runs import ROOT

BEND = ROOT / "recordings" / "bend.mcap"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    path = tmp_path_factory.mktemp("checkpoints") / "bend.run.mcap"
    assert sonarlog(["replay", str(BEND), "-o", str(path), "--checkpoint-every", "10", "-q"]) == 0
    return read_run(path)


def test_states_come_back_whole(run: Run) -> None:
    kept = read_checkpoints(run)
    assert [each.sweep for each in kept] == [10, 20]
    for each in kept:
        state = each.restored()
        assert isinstance(state, State)
        assert len(state.poses) == each.sweep
        assert canonical(state) == each.state


def test_a_value_of_another_type_is_refused() -> None:
    with pytest.raises(TypeError, match="1 is no float"):
        restored(tuple[float, ...], [0.5, 1])
    with pytest.raises(KeyError):
        restored(State, read_canonical(canonical({"poses": []})))


@pytest.mark.parametrize(("start", "begin"), [(10, 10), (19, 10), (24, 20), (1000, 20)])
def test_going_on_ends_with_the_same_digest(
    run: Run, start: int, begin: int, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["replay", str(BEND), "-o", str(run.path), "--from", str(start), "-q", "--json"]
    assert sonarlog(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["from"], told["digest"]) == (begin, run.digest)


def test_no_checkpoint_and_another_recording_are_the_users_fault(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert sonarlog(["replay", str(BEND), "-o", str(run.path), "--from", "9", "-q"]) == 2
    assert "keeps no checkpoint before sweep 9" in capsys.readouterr().err
    assert sonarlog(["replay", str(BEND.with_name("loop.mcap")), "-o", str(run.path), "--from", "10", "-q"]) == 2
    assert sonarlog(["replay", str(BEND), "-o", str(run.path), "--from", "10", "--algorithm", "odometry", "-q"]) == 2


def test_every_stretch_is_checked_by_itself(run: Run) -> None:
    assert [(each.begin, each.end) for each in stretches(run)] == [(0, 10), (10, 20), (20, len(run.sweeps))]
    assert stretch_is_same(BEND, algorithm("paper"), run.path, 1)
    other = algorithm("paper").configured({"association.d1_m": 0.01})
    assert not stretch_is_same(BEND, other, run.path, 1)


@pytest.mark.slow
def test_verify_checks_in_parts(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert sonarlog(["verify", str(run.path), str(BEND), "--jobs", "2", "-q"]) == 0
    assert capsys.readouterr() == (f"identical: {len(run.sweeps)} sweeps, digest {run.digest}\n", "")
