import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from click.testing import CliRunner

from cli.diff import command
from cli.main import run as run_command
from slam.geometry import Pose
from slam.grid import Cells, Grid, Patch
from slam.sweep import Sweep
from sonarlog.diff import NotComparable, Report, cell_changes, diff_runs
from sonarlog.diff.decisions import decided
from sonarlog.runs import read_run
from tests.made_runs import drifting, made_run
from tests.synthetic import corridor, scan


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="module")
def sweeps() -> list[Sweep]:
    return drifting()


@pytest.fixture(scope="module")
def paper(folder: Path, sweeps: list[Sweep]) -> Path:
    return made_run(folder / "paper.run.mcap", "paper", sweeps).path


@pytest.fixture(scope="module")
def odometry(folder: Path, sweeps: list[Sweep]) -> Path:
    return made_run(folder / "odometry.run.mcap", "odometry", sweeps).path


def against_paper(
    folder: Path,
    paper: Path,
    name: str,
    sweeps: list[Sweep],
    changes: Mapping[str, object] = MappingProxyType({}),
    *,
    recording: str = "one recording",
    truth: bool = True,
) -> Report:
    """The difference between the run `paper` and another one, made now with these changes."""
    other = made_run(folder / f"{name}.mcap", "paper", sweeps, changes, recording=recording, truth=truth)
    return diff_runs(read_run(paper), other)


def elsewhere() -> list[Sweep]:
    """Another drive, through a narrower corridor and the other way round."""
    return [scan(corridor(width=1.6), Pose(-0.5 * k, 0.1, 0.3 * k)) for k in range(3)]


def test_a_run_and_itself_are_the_same(folder: Path, paper: Path, sweeps: list[Sweep]) -> None:
    found = against_paper(folder, paper, "again", sweeps)
    assert found.same
    assert found.headline == "The same: all 5 sweeps and the map are identical to the bit."
    assert found.cells.changed == 0
    assert found.path.largest_m == 0


def test_settings_that_change_nothing_are_named_and_the_result_is_the_same(
    folder: Path, paper: Path, sweeps: list[Sweep]
) -> None:
    found = against_paper(folder, paper, "wider", sweeps, {"association.d1_m": 0.21})
    assert found.same
    assert found.headline.endswith("though made with different association.d1_m.")


def test_a_changed_threshold_is_found_in_association_where_it_first_bites(
    folder: Path, paper: Path, sweeps: list[Sweep]
) -> None:
    found = against_paper(folder, paper, "d1", sweeps, {"association.d1_m": 0.005})
    assert found.first is not None
    assert (found.first.sweep, found.first.block) == (2, "E")
    assert "joins chain" in found.first.words
    assert "starts chain" in found.first.words
    assert "feature association (block E)" in found.headline
    assert found.settings["association.d1_m"] == (0.2, 0.005)


def test_a_changed_weight_is_found_in_map_extension_and_the_path_is_untouched(
    folder: Path, paper: Path, sweeps: list[Sweep]
) -> None:
    found = against_paper(folder, paper, "weight", sweeps, {"map.wall": 10})
    assert found.first is not None
    assert (found.first.sweep, found.first.block) == (0, "H")
    assert found.path.largest_m == 0
    assert found.cells.changed > 0
    assert "The paths are the same within a millimetre" in found.headline


def test_another_idea_of_occupied_is_a_difference_though_no_evidence_is(
    folder: Path, paper: Path, sweeps: list[Sweep]
) -> None:
    found = against_paper(folder, paper, "strict", sweeps, {"map.occupied_from": 100})
    assert found.first is not None
    assert found.first.block in "HI"
    assert found.cells.table[2][0] > 0


def test_a_reading_dropped_is_found_in_sensing(folder: Path, paper: Path, sweeps: list[Sweep]) -> None:
    kept = np.arange(len(sweeps[3])) != 7
    names = ("t_ns", "sonar", "range_mm", "x_um", "y_um", "heading")
    arrays = {name: getattr(sweeps[3], name)[kept] for name in names}
    fewer = [*sweeps[:3], replace(sweeps[3], reference=sweeps[3].reference - 1, **arrays), sweeps[4]]
    found = against_paper(folder, paper, "dropped", fewer)
    assert found.first is not None
    assert (found.first.sweep, found.first.block, found.first.name) == (3, "A", "sensing")


def test_a_sweep_that_only_one_has_is_a_difference(folder: Path, paper: Path, sweeps: list[Sweep]) -> None:
    found = against_paper(folder, paper, "short", sweeps[:4])
    assert found.first is not None
    assert found.first.words == "only A has sweep 4 and those after it"


def test_swapped_sides_give_the_mirrored_report(paper: Path, odometry: Path) -> None:
    there, back = (diff_runs(*(read_run(p) for p in pair)) for pair in ((odometry, paper), (paper, odometry)))
    assert there.truth is not None
    assert back.truth is not None
    assert (there.truth.nearer, back.truth.nearer) == ("B", "A")
    assert there.cells.table == tuple(zip(*back.cells.table, strict=True))
    assert there.path.largest_m == back.path.largest_m > 0.05
    assert "(paper) is nearer to the truth" in there.headline
    assert "(paper) is nearer to the truth" in back.headline


def test_without_truth_nothing_is_said_of_it(folder: Path, paper: Path, sweeps: list[Sweep]) -> None:
    assert against_paper(folder, paper, "blind", sweeps, {"map.wall": 11}, truth=False).truth is None


def test_runs_that_cannot_be_compared_are_refused_by_name(folder: Path, paper: Path, sweeps: list[Sweep]) -> None:
    with pytest.raises(NotComparable, match="different recordings"):
        against_paper(folder, paper, "elsewhere", elsewhere(), recording="another")
    with pytest.raises(NotComparable, match="cells of 5 cm and 10 cm"):
        against_paper(folder, paper, "coarse", sweeps[:1], {"map.cell_m": 0.1})


def test_cells_are_counted_by_what_became_of_them() -> None:
    before: Cells = np.array([[0, -20, 40, -20]], dtype=np.int16)
    after: Cells = np.array([[40, -20, -20, 0]], dtype=np.int16)
    empty = Grid(0.05, 15, -6)
    a, b = empty.extended(Patch(-2, 70, before)), empty.extended(Patch(-2, 70, after))
    changes = cell_changes(a, b)
    assert changes.table == ((0, 0, 1), (1, 1, 0), (0, 1, 0))
    assert changes.changed == 0.75
    assert cell_changes(empty, empty).changed == 0.0


def test_the_command_says_it_draws_it_and_exits_with_1(paper: Path, odometry: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    result = runner.invoke(
        command, [str(odometry), str(paper), "--png", str(tmp_path / "d.png")], standalone_mode=False
    )
    assert result.return_value == 1
    assert result.output.startswith("Different from the first sweep on")
    assert "A occupied" in result.output
    assert (tmp_path / "d.png").read_bytes().startswith(b"\x89PNG")
    plain = runner.invoke(command, [str(odometry), str(paper), "--json"], standalone_mode=False)
    assert json.loads(plain.output)["first"]["name"] == "self-calibration"


def test_a_bad_side_is_one_clear_sentence(
    folder: Path, paper: Path, short_recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    half = folder / "half.run.mcap"
    half.write_bytes(paper.read_bytes()[: paper.stat().st_size // 2])
    sides = {
        (str(half), str(paper)): "cut off or unreadable",
        (f"{short_recording}@paper", str(paper)): "different recordings, and not of one drive",
        (f"{short_recording}@paper", f"{short_recording}@paper:map.cell_m=0.1"): "have cells of 5 cm and 10 cm",
        (f"{short_recording}@paper", f"{short_recording}@paper:map.cell=0.1"): "no setting 'map.cell'",
        (f"{short_recording}@paper", f"{short_recording}@git:no-such-revision"): "no code of revision",
    }
    for pair, words in sides.items():
        assert run_command(["diff", *pair, "-q"]) == 2
        said = capsys.readouterr()
        assert said.out == ""
        assert words in said.err
        assert len(said.err.splitlines()) == 1


def test_everything_is_written_beside(paper: Path, odometry: Path, tmp_path: Path) -> None:
    files = {option: tmp_path / f"d.{option}" for option in ("png", "html", "rrd", "junit")}
    words = ["--png", str(files["png"]), "--html", str(files["html"]), "--viz", str(files["rrd"])]
    words += ["--junit", str(files["junit"])]
    assert run_command(["diff", str(odometry), str(paper), *words]) == 1
    assert all(path.stat().st_size > 100 for path in files.values())
    assert run_command(["diff", str(odometry), str(paper), "--html", str(files["html"])]) == 2


@pytest.mark.parametrize(
    ("arguments", "code"),
    [(["paper", "paper"], 0), (["odometry", "paper"], 1), (["paper"], 2), (["paper", "no such file"], 2),
     (["paper", "--algorithms", "paper"], 2)],
)  # fmt: skip
def test_exit_codes(arguments: list[str], code: int, paper: Path, odometry: Path) -> None:
    paths = {"paper": str(paper), "odometry": str(odometry)}
    assert run_command(["diff", *(paths.get(a, a) if k < 2 else a for k, a in enumerate(arguments))]) == code


def test_walls_that_join_the_same_chains_are_told_by_how_far_off_these_they_are() -> None:
    alike, here, there = (
        {"joined": 0, "chain": chain, "d1": d1, "a1": 0.01, "gap": 0.0}
        for chain, d1 in ((4, 0.002), (2, 0.014), (2, 0.005))
    )
    said = decided("E", ({"walls": [alike, here]}, {"walls": [alike, there]}), (None, None), (), 0.05)
    assert said == ("finds wall 1 off chain 2 by d1 1.4 cm, a1 0.6°", "finds wall 1 off chain 2 by d1 0.5 cm, a1 0.6°")
