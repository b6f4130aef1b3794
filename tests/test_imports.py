"""Foreign logs: the integers come back as they went in, bad rows are refused by file and line."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cli.import_ import command
from slam.sweep import TURN
from sonarlog.imports import csv, udacity
from sonarlog.imports.rows import BadRow, Row, write_rows
from sonarlog.recording import read_log, recording_digest

DATA = Path(__file__).parents[2] / "shared" / "data" / "udacity_corridor"
HEAD = "# half_beam_deg: 12.5\n# max_range_mm: 5000\n# sonar: 70 100 90\n# sonar: 70 -100 -90\n"
NAMES = "t_s,x_m,y_m,theta_deg,r0_m,r1_m\n"

Step = tuple[int, int, int, int, tuple[int | None, ...]]

distance = st.none() | st.integers(0, 999_999)
row = st.tuples(
    st.integers(1, 10**12),  # ns since the row before
    st.integers(-(2**39), 2**39),
    st.integers(-(2**39), 2**39),
    st.integers(-TURN // 2 + 1, TURN // 2 - 1),  # turned since the row before
    st.tuples(distance, distance),
)


@settings(max_examples=50, deadline=None)
@given(st.lists(row, min_size=1, max_size=8), st.integers(0, TURN - 1))
def test_integers_survive_csv_and_mcap(
    tmp_path_factory: pytest.TempPathFactory, steps: list[Step], heading: int
) -> None:
    folder = tmp_path_factory.mktemp("csv")
    path, t_ns = folder / "log.csv", 0
    expected: list[tuple[int, ...]] = []
    fired: list[tuple[int, ...]] = []
    text = [HEAD + "t_ns,x_um,y_um,theta_turn,r0_mm,r1_mm\n"]
    for dt_ns, x_um, y_um, turned, ranges in steps:
        t_ns += dt_ns
        heading += turned if expected else 0
        expected.append((t_ns, x_um, y_um, heading))
        fired += [(t_ns, sonar, mm, x_um, y_um, heading) for sonar, mm in enumerate(ranges) if mm is not None]
        cells = ["" if mm is None else str(mm) for mm in ranges]
        text.append(",".join([str(t_ns), str(x_um), str(y_um), f"{heading / TURN:.20f}", *cells]) + "\n")
    path.write_text("".join(text))
    assume(fired)
    table = csv.read(path)
    write_rows(folder / "log.mcap", csv.rows(table), table.robot, source=path, command_line="", config={})
    log = read_log(folder / "log.mcap")
    assert log.robot == table.robot
    assert np.column_stack(list(vars(log.odometry).values())[:4]).tolist() == [list(values) for values in expected]
    assert np.column_stack(list(vars(log.readings).values())[:6]).tolist() == [list(values) for values in fired]


def test_units(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(HEAD + "# a remark\n" + NAMES + "0.5,1.25,-1e-3,-90,1.204,inf\n1.0,1.25,0,nan,,NaN\n")
    table = csv.read(path)
    rows = csv.rows(table)
    assert next(rows) == Row(7, 500_000_000, 1_250_000, -1000, -TURN // 4, (1204, 5000))
    with pytest.raises(BadRow, match=r"a\.csv:8: theta_deg is 'nan', no number"):
        next(rows)


def test_the_example_in_the_documentation(tmp_path: Path) -> None:
    text = (Path(__file__).parents[1] / "docs" / "recording.md").read_text()
    example = next(block for block in text.split("```") if "# half_beam_deg" in block)
    (tmp_path / "log.csv").write_text(example)
    arguments = ["csv", str(tmp_path / "log.csv"), "-o", str(tmp_path / "log.mcap")]
    assert CliRunner().invoke(command, arguments).exit_code == 0
    log = read_log(tmp_path / "log.mcap")
    assert log.robot.name == "my-robot"
    assert log.readings.range_mm.tolist() == [1204, 1206, 5000]


BAD_CSV = [
    ("", "half_beam_deg"),
    (HEAD, "has no line of column names"),
    (HEAD + NAMES, "holds no rows"),
    (HEAD + NAMES + "0,0,0,0,,nan\n", "holds no readings"),
    (HEAD + "t_s,x_m,y_m,theta_deg,r0_m\n0,0,0,0,1\n", ":5: 1 range columns, but 2 '# sonar:' lines"),
    (HEAD + "t_s,x_m,y_m,theta_deg,r0_m,r2_m\n", ":5: range columns r0_mm, r1_mm"),
    (HEAD + "t,x_m,y_m,theta_deg,r0_m,r1_m\n", ":5: one column of t_ns, t_us, t_ms, t_s is needed, there are 0"),
    (HEAD + NAMES.replace("\n", ",volts\n"), ":5: unknown column 'volts'"),
    (HEAD + NAMES + "0,0,0,0,1\n", ":6: 5 cells where 6 belong"),
    (HEAD + NAMES + "0,0,0,0,1,one\n", ":6: r1_m is 'one', no number"),
    (HEAD + NAMES + "0,1e999999999,0,0,1,1\n", ":6: x_m is '1e999999999', too large"),
    (HEAD + NAMES + "0,0,0,0,1,-1\n", ":6: sonar 1: a range of -1000 mm"),
    (HEAD + NAMES + "0,0,0,0,1,1\n0,0,0,0,1,1\n", ":7: time 0 s does not come after the row before"),
    (HEAD + NAMES + "-1,0,0,0,1,1\n", ":6: time -1 s is negative"),
    (HEAD + NAMES + '0,0,0,0,1,"1\n', ":6: is no CSV"),
    (HEAD.replace("12.5", "wide") + NAMES, "bad number in its comment lines"),
    (HEAD.replace("12.5", "nan") + NAMES, "needs 0 < half_beam_deg < 90"),
    (HEAD.replace("70 100 90", "70 100") + NAMES, ":3: '# sonar:' takes x_mm y_mm heading_deg, not '70 100'"),
]


@pytest.mark.parametrize(("text", "words"), BAD_CSV)
def test_bad_csv_is_refused_by_file_and_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    result = CliRunner().invoke(command, ["csv", str(path), "-o", str(tmp_path / "a.mcap")])
    assert isinstance(result.exception, BadRow)
    assert words in str(result.exception)
    assert str(path) in str(result.exception)
    assert not list(tmp_path.glob("a.mcap*"))


def test_udacity_files_go_together(tmp_path: Path) -> None:
    measurement, poses = tmp_path / "m.txt", tmp_path / "p.txt"
    measurement.write_text("1000 1 2 3 4 5 6 7 5110\n2000 1 2 3 4 5 6 7 8\n")
    poses.write_text("1000 10 -20 3599\n2000 10 -20 1\n")
    first, second = udacity.rows(measurement, poses)
    assert first == Row(1, 10**9, 10_000, -20_000, udacity.heading(3599), (1, 2, 3, 4, 5, 6, 7, 5110))
    assert second.heading == udacity.heading(1)
    poses.write_text("1000 10 -20 3599\n2001 10 -20 1\n")
    with pytest.raises(BadRow, match=r"m\.txt:2: time 2000 ms, but 2001 ms in .*p\.txt"):
        list(udacity.rows(measurement, poses))
    poses.write_text("1000 10 -20 3599\n")
    with pytest.raises(BadRow, match="has 2 rows"):
        list(udacity.rows(measurement, poses))
    poses.write_text("1000 10 x 3599\n")
    with pytest.raises(BadRow, match=r"p\.txt:1: '1000 10 x 3599' is no row of integers"):
        list(udacity.rows(measurement, poses))


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no {DATA}: the Udacity corridor is not part of this repository")
def test_the_real_corridor_comes_in_as_it_is(tmp_path: Path) -> None:
    output = tmp_path / "udacity.mcap"
    arguments = ["udacity", str(DATA / "measurement.txt"), str(DATA / "poses.txt"), "-o", str(output)]
    assert CliRunner().invoke(command, arguments).exit_code == 0
    log = read_log(output)
    poses = np.loadtxt(DATA / "poses.txt", dtype=np.int64)
    ranges = np.loadtxt(DATA / "measurement.txt", dtype=np.int64)
    assert (log.odometry.t_ns == poses[:, 0] * 1_000_000).all()
    assert (log.odometry.x_um == poses[:, 1] * 1000).all()
    assert (log.odometry.y_um == poses[:, 2] * 1000).all()
    tenths = np.rint(log.odometry.heading * 3600 / TURN).astype(np.int64)
    assert ((tenths - poses[:, 3]) % 3600 == 0).all()
    assert np.abs(np.diff(tenths)).max() < 900
    assert (log.readings.range_mm.reshape(-1, 8) == ranges[:, 1:]).all()
    assert (log.readings.sonar.reshape(-1, 8) == np.arange(8)).all()
    digest = recording_digest(output)
    assert CliRunner().invoke(command, [*arguments, "--force"]).exit_code == 0
    assert recording_digest(output) == digest
