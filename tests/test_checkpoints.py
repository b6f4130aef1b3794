"""A replay that goes on from a checkpoint ends with the digest of the whole one."""

import json
import pickle
from pathlib import Path

import pytest

from cli.main import run as sonarlog
from slam.algorithms import ALGORITHMS, DEFAULT, algorithm
from slam.pipeline import State
from sonarlog.canonical import canonical, read_canonical
from sonarlog.checkpoints import read_checkpoints, stretch_is_same, stretches
from sonarlog.restore import restored
from sonarlog.runs import Run, read_run
from tests.golden_runs import ROOT


@pytest.fixture(scope="module")
def run(short_recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    path = tmp_path_factory.mktemp("checkpoints") / "short.run.mcap"
    assert sonarlog(["replay", str(short_recording), "-o", str(path), "--checkpoint-every", "1", "-q"]) == 0
    return read_run(path)


def test_states_come_back_whole(run: Run) -> None:
    kept = read_checkpoints(run)
    assert [each.sweep for each in kept] == [1, 2, 3]
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


@pytest.mark.parametrize(("start", "begin"), [(1, 1), (2, 2), (1000, 3)])
def test_going_on_ends_with_the_same_digest(
    run: Run, short_recording: Path, start: int, begin: int, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["replay", str(short_recording), "-o", str(run.path), "--from", str(start), "-q", "--json"]
    assert sonarlog(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["from"], told["digest"]) == (begin, run.digest)


def test_no_checkpoint_and_another_recording_are_the_users_fault(
    run: Run, short_recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["-o", str(run.path), "-q", "--from"]
    assert sonarlog(["replay", str(short_recording), *words, "0"]) == 2
    assert "keeps no checkpoint before sweep 0" in capsys.readouterr().err
    assert sonarlog(["replay", str(ROOT / "recordings" / "bend.mcap"), *words, "1"]) == 2
    assert sonarlog(["replay", str(short_recording), *words, "1", "--algorithm", "odometry"]) == 2


def test_every_stretch_is_checked_by_itself(run: Run, short_recording: Path) -> None:
    assert [(each.begin, each.end) for each in stretches(run)] == [(0, 1), (1, 2), (2, 3)]
    assert all(stretch_is_same(short_recording, algorithm(DEFAULT), run.path, k) for k in range(3))
    other = algorithm(DEFAULT).configured({"graph.gate": 0.001})
    assert not stretch_is_same(short_recording, other, run.path, 1)


def test_verify_checks_in_parts(run: Run, short_recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sonarlog(["verify", str(run.path), str(short_recording), "--jobs", "2", "-q"]) == 0
    assert capsys.readouterr() == (f"identical: {len(run.sweeps)} sweeps, digest {run.digest}\n", "")


@pytest.mark.parametrize("name", ALGORITHMS)
def test_every_algorithm_can_be_sent_to_another_process(name: str) -> None:
    """With --jobs they are."""
    chosen = algorithm(name).configured({"map.wall": 41})
    again = pickle.loads(pickle.dumps(chosen))
    assert (again.name, again.version, again.config) == (name, chosen.version, chosen.config)
