"""What was planted is found: an ulp in any block, a changed constant, an altered file; and `sonarlog verify`."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.main import run as sonarlog
from slam import chaining, pipeline
from slam.recognition import recognise
from slam.reliability import analyse_reliability
from slam.sweep import Sweep
from sonarlog.apart import apart, plain, ulps_between
from sonarlog.revision import HOME, NoSuchCode, code_of
from sonarlog.runs import BadRun, read_run
from sonarlog.verify import CannotDump, compare, dump
from tests.made_runs import drifting, made_run

AT = 3


def nudged(value: Any) -> Any:
    """The same, but its first float one ulp further on; None if it has none."""
    if isinstance(value, float):
        return float(np.nextafter(value, np.inf))
    if isinstance(value, np.ndarray) and value.dtype == np.float64 and value.size:
        value = value.copy()
        value.reshape(-1)[0] = np.nextafter(value.reshape(-1)[0], np.inf)
        return value
    if isinstance(value, tuple):
        for k, item in enumerate(value):
            if (other := nudged(item)) is not None:
                return (*value[:k], other, *value[k + 1 :])
    for name in getattr(value, "__dataclass_fields__", {}):
        if (other := nudged(getattr(value, name))) is not None:
            return replace(value, **{name: other})
    return None


def planted(block: Callable[..., Any], count: int = AT) -> Callable[..., Any]:
    """The block, but in its call number `count` its result is an ulp off."""
    calls = iter(range(1 << 30))

    def off(*arguments: Any) -> Any:
        made = block(*arguments)
        return nudged(made) if next(calls) == count else made

    return off


@pytest.fixture(scope="module")
def sweeps() -> list[Sweep]:
    return drifting()


@pytest.mark.parametrize(
    ("function", "block"),
    [
        ("self_calibrate", "B"),
        ("analyse_reliability", "C"),
        ("extract_features", "D"),
        ("recognise", "E"),
        ("post_calibrate", "G"),
        ("next_goal", "I"),
    ],
)
def test_one_ulp_is_found_at_its_sweep_and_block(
    function: str, block: str, sweeps: list[Sweep], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = made_run(tmp_path / "a.run.mcap", sweeps=sweeps)
    module = chaining if function == "recognise" else pipeline
    monkeypatch.setattr(module, function, planted(getattr(module, function)))
    found = compare(run, made_run(tmp_path / "b.run.mcap", sweeps=sweeps))
    assert found.first is not None
    assert (found.first.sweep, found.first.block, found.first.ulps) == (AT, block, 1)
    assert len(found.first.differences) == 1


def test_a_changed_constant_in_association_is_named_so_and_not_as_the_map(sweeps: list[Sweep], tmp_path: Path) -> None:
    run = made_run(tmp_path / "a.run.mcap", sweeps=sweeps)
    again = made_run(tmp_path / "b.run.mcap", sweeps=sweeps, changes={"association.a1_deg": 0.001})
    found = compare(run, again)
    assert found.first is not None
    assert (found.first.block, found.first.name) == ("E", "feature association")
    assert found.position_mm > 0
    assert found.cells > 0


def test_a_changed_weight_is_named_as_map_extension(sweeps: list[Sweep], tmp_path: Path) -> None:
    run = made_run(tmp_path / "a.run.mcap", sweeps=sweeps)
    found = compare(run, made_run(tmp_path / "b.run.mcap", sweeps=sweeps, changes={"map.wall": 41}))
    assert found.first is not None
    assert (found.first.sweep, found.first.block, found.position_mm) == (0, "H", 0.0)


def test_what_changes_nothing_is_told_as_a_changed_question(sweeps: list[Sweep], tmp_path: Path) -> None:
    run = made_run(tmp_path / "a.run.mcap", sweeps=sweeps)
    assert compare(run, made_run(tmp_path / "b.run.mcap", sweeps=sweeps)).same
    found = compare(run, made_run(tmp_path / "c.run.mcap", sweeps=sweeps, changes={"features.corner_m": 0.0801}))
    assert found.first is not None
    assert (found.first.block, found.first.differences[0].where) == ("", "config.features.corner_m")


def test_both_sides_are_written_out_in_full(
    sweeps: list[Sweep], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = made_run(tmp_path / "a.run.mcap", sweeps=sweeps)
    monkeypatch.setattr(chaining, "recognise", planted(recognise))
    found = compare(run, made_run(tmp_path / "b.run.mcap", sweeps=sweeps))
    assert found.first is not None
    paths = dump(found.first, tmp_path / "apart")
    inputs, mine, yours, between = (json.loads(path.read_text(encoding="utf-8")) for path in paths)
    assert ulps_between(mine["links"][0]["d1"], yours["links"][0]["d1"]) == 1
    assert [next(apart(mine, yours)).where] == [each["where"] for each in between["differences"]]
    assert set(inputs) == {"B self-calibration", "D feature extraction", "before"}
    assert inputs["before"]["poses"] == [plain([s.pose.x, s.pose.y, s.pose.theta]) for s in run.sweeps[:AT]]
    with pytest.raises(CannotDump, match="exists and is not overwritten"):
        dump(found.first, tmp_path / "apart")


def test_values_that_do_not_have_their_digests_are_an_altered_file(
    sweeps: list[Sweep], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = made_run(tmp_path / "a.run.mcap", sweeps=sweeps)
    again = made_run(tmp_path / "b.run.mcap", sweeps=sweeps, changes={"map.wall": 41})
    monkeypatch.setattr("sonarlog.diff.first.digest_of", lambda _: "0")
    with pytest.raises(BadRun, match=r"was altered: block A of sweep 0"):
        compare(run, again)


@pytest.mark.parametrize(
    ("a", "b", "ulps"),
    [
        (1.0, 1.0 + 2**-52, 1),
        (0.0, 5e-324, 1),
        (-5e-324, 5e-324, 2),
        (1.0, 2.0, 1 << 52),
        (1.0, float("nan"), None),
    ],
)
def test_ulps(a: float, b: float, ulps: int | None) -> None:
    assert ulps_between(a, b) == ulps


def test_where_values_part() -> None:
    a = {"x": [1, 2.0, "s"], "y": np.array([[1.0, 2.0]]), "n": float("nan")}
    b = {"x": [1, 2.5, "t"], "y": np.array([[1.0, 3.0]]), "n": float("nan")}
    assert [each.where for each in apart(a, b)] == ["x[1]", "x[2]", "y[0, 1]"]
    assert [each.where for each in apart([1], [1, 2], "l")] == ["l (how many)"]
    assert list(apart(a, a)) == []


@pytest.fixture
def recording(short_recording: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(short_recording, tmp_path / "corridor.mcap"))


@pytest.fixture
def run(recording: Path, tmp_path: Path) -> Path:
    path = tmp_path / "corridor.run.mcap"
    assert sonarlog(["replay", str(recording), "-o", str(path), "-q"]) == 0
    return path


def test_verify_says_identical(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sonarlog(["verify", str(run), "-q"]) == 0
    assert capsys.readouterr() == (f"identical: 3 sweeps, digest {read_run(run).digest}\n", "")


def test_verify_names_the_ulp(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pipeline, "analyse_reliability", planted(analyse_reliability, count=1))
    capsys.readouterr()
    assert sonarlog(["verify", str(run), "-q", "--dump", str(tmp_path / "apart")]) == 1
    told = capsys.readouterr().out
    assert told.startswith("differs first at sweep 1, data reliability analysis (block C): ")
    assert "1 value differs, floats by up to 1 ulp\n  rcds[0].bearing: " in told
    assert "by the end: poses up to 0 mm and 0° apart" in told
    assert (tmp_path / "apart" / "output.replay.json").exists()
    assert sonarlog(["verify", str(run), "-q", "--json"]) == 0  # planted in the second call only
    assert json.loads(capsys.readouterr().out)["same"] is True


def test_verify_refuses_another_recording_and_a_missing_one(
    run: Path, recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert sonarlog(["verify", str(recording)]) == 2
    assert sonarlog(["verify", str(run), str(tmp_path / "none.mcap")]) == 2
    moved = recording.rename(recording.with_name("elsewhere.mcap"))
    capsys.readouterr()
    assert sonarlog(["verify", str(run)]) == 2
    assert "is not beside it: name it after the run" in capsys.readouterr().err
    assert sonarlog(["verify", str(run), str(moved), "-q"]) == 0


def test_verify_warns_of_other_code(
    run: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sonarlog.provenance.code_digest", lambda: "0")
    assert sonarlog(["verify", str(run), "-q"]) == 0
    assert "was made by other code than this" in capsys.readouterr().err
    assert sonarlog(["verify", str(run), "--code", "HEAD"]) == 2


@pytest.mark.skipif(not (HOME / ".git").exists(), reason="no git checkout")
def test_the_code_of_a_revision_is_had() -> None:
    with code_of("HEAD") as folder:
        assert (folder / "slam").is_dir()
    assert not folder.exists()
    with pytest.raises(NoSuchCode, match="no code of revision 'nonsense'"), code_of("nonsense"):
        pass
