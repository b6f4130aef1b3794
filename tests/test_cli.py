"""Every command does its work, and every wrong input is one sentence, exit code 2, and nothing lost or left behind."""

import json
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from cli.main import COMMANDS, run
from slam.algorithms import DEFAULT
from sonarlog.log import Surfaces
from sonarlog.mcap_file import McapWriter
from sonarlog.recording import RecordingWriter, read_log
from sonarlog.runs import read_run
from tests.conftest import SCANS
from tests.processes import start

CSV = """# half_beam_deg: 12.5
# max_range_mm: 5000
# sonar: 70 100 90
# sonar: 70 -100 -90
t_s,x_m,y_m,theta_deg,r0_m,r1_m
"""


@pytest.fixture(scope="module")
def shelf(short_recording: Path, short_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One file of each kind."""
    folder = tmp_path_factory.mktemp("shelf")
    shutil.copy(short_recording, folder / "short.mcap")
    shutil.copy(short_run, folder / "run.mcap")
    rows = "".join(f"{k / 10},{k * 0.03:.3f},0,0,1.0,1.0\n" for k in range(60))
    texts = {
        "text.txt": "hello\n", "empty.mcap": "", "drive.csv": CSV + rows, "bad.csv": CSV + "0,0,0,0,oops,1\n",
        "broken.toml": "[association\n", "block.toml": "[nosuch]\nx = 1\n", "key.toml": "[association]\nd9_m = 1\n",
        "type.toml": "[association]\nd1_m = 'wide'\n", "good.toml": "[association]\nd1_m = 0.25\n",
        "route.txt": "scan; jump 3\n",
    }  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    with McapWriter(folder / "chat.mcap") as chat:
        chat.write(chat.channel("/chat", "std_msgs/msg/String", "string data"), 5, b"\0\1\0\0\2\0\0\0a\0")
    with RecordingWriter(folder / "silent.mcap", started_wall_ns=1, command_line="", config={}) as silent:
        silent.surfaces(Surfaces.from_json(b'{"world": "", "segments": [], "poles": []}'))
    assert (
        run(["replay", str(folder / "short.mcap"), "--algorithm", "odometry", "-q", "-o", str(folder / "raw.mcap")])
        == 0
    )
    return folder


@pytest.fixture
def here(shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a copy of the shelf, to work in; and no display."""
    folder = tmp_path / "here"
    shutil.copytree(shelf, folder)
    (folder / "made").mkdir()
    (folder / "made" / "map.yaml").write_text("mine", encoding="utf-8")
    (folder / "made" / "new.mcap.part").write_text("half", encoding="utf-8")
    (folder / "picture.png").write_text("mine", encoding="utf-8")
    monkeypatch.chdir(folder)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


# What the commands do


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_that_begins_with_what_it_does(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([name, "--help"]) == 0
    assert capsys.readouterr().out.startswith(f"Usage: sonarlog {name} ")


def test_help_imports_nothing_heavy() -> None:
    heavy = ("numpy", "rerun", "mcap", "serial", "rich", "PIL", "slam", "sonarlog")
    code = f"import sys, cli.main; cli.main.run(['--help']); print([m for m in {heavy} if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.splitlines()[-1] == "[]"


def test_record(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["record", "--port", "sim://bend?seed=2", "-o", "new.mcap", "--route", "scan"]) == 0
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith("new.mcap: 1 sweeps, ")
    assert len(read_log(here / "new.mcap").readings.t_ns) > 700


def test_replay(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        run(["replay", "short.mcap", "--config", "good.toml", "--set", "map.wall=35", "--json", "--export", "x"]) == 0
    )
    said = json.loads(capsys.readouterr().out)
    assert (said["run"], said["sweeps"]) == (f"short.{DEFAULT}.run.mcap", SCANS)
    made = read_run(here / said["run"])
    assert said["digest"] == made.digest
    assert (made.identity.config["association.d1_m"], made.identity.config["map.wall"]) == (0.25, 35)
    assert sorted(path.name for path in (here / "x").iterdir()) == [
        "map.pgm", "map.yaml", "trajectory.tum", "walls.csv",
    ]  # fmt: skip


def test_replay_into_a_file_for_the_viewer(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["replay", "short.mcap", "--viz", "new.rrd", "-q"]) == 0
    assert capsys.readouterr().err == ""
    assert (here / "new.rrd").read_bytes()[:4] == b"RRF2"
    assert list(here.glob("*.run.mcap")) == []


def test_diff(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["diff", "run.mcap", "run.mcap"]) == 0
    assert run(["diff", "raw.mcap", "run.mcap", "--png", "new.png"]) == 1
    assert "differs" in capsys.readouterr().out
    assert (here / "new.png").read_bytes().startswith(b"\x89PNG")
    assert run(["diff", "short.mcap", "--algorithms", "odometry, paper", "--json", "-q"]) == 1
    told = capsys.readouterr()
    assert told.err == ""
    assert json.loads(told.out)["first"]["block"] == "B"
    assert list(here.glob("*.run.mcap")) == []


@pytest.mark.parametrize(("file", "key"), [("short.mcap", "sweeps"), ("run.mcap", "algorithm")])
def test_info(here: Path, capsys: pytest.CaptureFixture[str], file: str, key: str) -> None:
    assert run(["info", file]) == 0
    assert "digest" in capsys.readouterr().out
    assert run(["info", file, "--json"]) == 0
    assert key in json.loads(capsys.readouterr().out)


def test_verify(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["verify", "run.mcap", "short.mcap", "-q"]) == 0
    assert capsys.readouterr().out.startswith(f"identical: {SCANS} sweeps")


def test_recover(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = (here / "short.mcap").read_bytes()
    half = here / "cut.mcap.part"
    half.write_bytes(whole[:-100])  # its chunk is whole, its index is not
    before = half.read_bytes()
    for more in ([], ["--force"]):
        assert run(["recover", "cut.mcap.part", "-o", "cut.mcap", *more]) == 1
        assert half.read_bytes() == before
    assert sorted(path.name for path in here.glob("cut*")) == ["cut.mcap", "cut.mcap.part"]
    capsys.readouterr()
    assert run(["info", "cut.mcap", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["readings"]
    assert run(["recover", "short.mcap", "-o", "same.mcap"]) == 0


def test_algorithms(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["algorithms"]) == 0
    names = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert run(["algorithms", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert list(told) == names
    assert [name for name in told if told[name]["default"]] == [DEFAULT]
    assert run(["algorithms", "literal"]) == 0
    assert "localisation.shift_price = 0.0" in capsys.readouterr().out


def test_sim_shows_a_tour(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["sim", "--world", "clutter", "--tour"]) == 0
    assert capsys.readouterr().out.startswith("repeat 2 (repeat 8 (scan; go 0.8); turn 90;")


def test_sim_lists_its_worlds(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["sim", "--list"]) == 0
    names = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert names == ["bend", "clutter", "corridor", "loop", "office"]


def test_import_and_replay_of_driving_sweeps(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["import", "csv", "drive.csv", "-o", "new.mcap"]) == 0
    assert capsys.readouterr().err == "new.mcap: 60 rows\n"
    assert run(["replay", "new.mcap", "--json", "-q"]) == 0
    assert json.loads(capsys.readouterr().out)["sweeps"] == 4


def test_an_output_is_overwritten_with_force(here: Path) -> None:
    assert run(["replay", "short.mcap", "-o", "raw.mcap", "--force", "-q", "--export", "made"]) == 0
    assert read_run(here / "raw.mcap").identity.algorithm == DEFAULT
    assert (here / "made" / "map.yaml").read_text(encoding="utf-8").startswith("image: map.pgm")


# Wrong input

REPLAY = "replay short.mcap -o new.mcap"
RECORD = "record -o new.mcap --port"
WRONG = {
    "no such port": (f"{RECORD} /dev/ttyNOSUCH", "there is no such port"),
    "nobody listens": (f"{RECORD} socket://127.0.0.1:1", "nobody listens there"),
    "no such host": (f"{RECORD} socket://nosuch.invalid:8101", "no such host"),
    "no such protocol": (f"{RECORD} carrier://pigeon", "'carrier' not known"),
    "no such world": (f"{RECORD} sim://moon", "no world 'moon'; known are bend, clutter"),
    "no such parameter": (f"{RECORD} sim://bend?sped=2", "no 'sped'; known are seed, speed"),
    "wrong parameter": (f"{RECORD} sim://bend?seed=x", "seed cannot be 'x'"),
    "no such step": (f"{RECORD} sim://bend --route route.txt", "'jump' is no step"),
    "no such robot": (f"{RECORD} sim://bend --robot hal", "robot 'hal' is not built in (amigo, "),
    "record: output exists": ("record --port sim://bend -o text.txt", "text.txt exists and is not overwritten"),
    "record: half exists": ("record --port sim://bend -o made/new.mcap", "new.mcap.part exists (never finished"),
    "record: no folder": ("record --port sim://bend -o nosuch/new.mcap", "cannot write nosuch/new.mcap"),
    "record: no port": ("record -o new.mcap", "Missing option '--port'"),
    "sim: no such world": ("sim --world moon", "no world 'moon'"),
    "sim: no world": ("sim", "name a world with --world"),
    "sim: no address": ("sim --world bend --listen here", "--listen takes HOST:PORT"),
    "sim: not our address": ("sim --world bend --listen nosuch.invalid:1", "cannot listen on nosuch.invalid:1"),
    "sim: wrong errors": ("sim --world bend --odometry much", "odometry 'much' is neither"),
    "no such file": ("replay nosuch.mcap", "cannot read nosuch.mcap: No such file"),
    "a folder": ("replay made", "'made' is a directory"),
    "no file": ("replay", "which recording?"),
    "no MCAP": ("replay text.txt", "text.txt is no MCAP file"),
    "empty": ("replay empty.mcap", "empty.mcap is no MCAP file: it is empty"),
    "no sonar": ("replay chat.mcap", "holds no sonar readings"),
    "nothing recorded": ("replay silent.mcap", "silent.mcap"),
    "a run, not a recording": ("replay run.mcap", "is a run, not a recording"),
    "no such algorithm": (f"{REPLAY} --algorithm magic", "no algorithm 'magic'; there are odometry, literal, paper"),
    "no such block": (f"{REPLAY} --set magic.x=1", "no setting 'magic.x'; blocks are self_calibration, "),
    "no such key": (f"{REPLAY} --set association.d9_m=1", "no setting 'association.d9_m'; association has d1_m, "),
    "wrong type": (f"{REPLAY} --set association.d1_m=wide", "association.d1_m takes a number, not 'wide'"),
    "wrong kind of number": (f"{REPLAY} --set localisation.window=1.5", "localisation.window takes a"),
    "too small": (f"{REPLAY} --set map.cell_m=0", "map.cell_m goes from 0.01 to 1; it cannot be 0"),
    "too large": (f"{REPLAY} --set map.wall=1000", "map.wall goes from 0 to 127; it cannot be 1000"),
    "no number": (f"{REPLAY} --set localisation.angle_step_deg=nan", "it cannot be nan"),
    "no value": (f"{REPLAY} --set association.d1_m", "--set takes BLOCK.KEY=VALUE"),
    "broken file": (f"{REPLAY} --config broken.toml", "broken.toml is no TOML"),
    "no such block in a file": (f"{REPLAY} --config block.toml", "no setting 'nosuch.x'"),
    "no such key in a file": (f"{REPLAY} --config key.toml", "no setting 'association.d9_m'"),
    "wrong type in a file": (f"{REPLAY} --config type.toml", "association.d1_m takes a number, not 'wide'"),
    "no such settings file": (f"{REPLAY} --config nosuch.toml", "cannot read nosuch.toml"),
    "no such option": (f"{REPLAY} --magic", "No such option '--magic'"),
    "replay: output exists": ("replay short.mcap -o run.mcap", "run.mcap exists and is not overwritten"),
    "replay: run exists, viz not": ("replay short.mcap -o run.mcap --viz new.rrd", "run.mcap exists and is not"),
    "replay: viz exists": (f"{REPLAY} --viz text.txt", "text.txt exists and is not overwritten"),
    "replay: no folder for viz": (f"{REPLAY} --viz nosuch/new.rrd", "cannot write nosuch/new.rrd"),
    "replay: export exists": (f"{REPLAY} --export made", "map.yaml exists and is not overwritten"),
    "no display": ("replay short.mcap --viz", "there is no display to open the viewer on; save with --viz FILE.rrd"),
    "diff: no runs": ("diff", "Missing argument"),
    "diff: one run": ("diff run.mcap", "which runs?"),
    "diff: recordings": ("diff short.mcap short.mcap", "short.mcap is a recording, not a run: replay it first"),
    "diff: no run": ("diff chat.mcap run.mcap", "chat.mcap holds no run"),
    "diff: a run replayed": ("diff run.mcap --algorithms literal,paper", "is a run, not a recording"),
    "diff: no such algorithm": ("diff short.mcap --algorithms literal,magic -q", "no algorithm 'magic'"),
    "diff: one algorithm": ("diff short.mcap --algorithms paper", "one recording and two names"),
    "diff: picture exists": ("diff raw.mcap run.mcap --png picture.png", "picture.png exists and is not overwritten"),
    "info: no MCAP": ("info text.txt", "text.txt is no MCAP file"),
    "verify: a recording": ("verify short.mcap", "short.mcap is a recording, not a run"),
    "check: a run": ("check run.mcap", "run.mcap"),
    "recover: no MCAP": ("recover text.txt -o new.mcap", "text.txt is no MCAP file"),
    "recover: output exists": ("recover short.mcap -o run.mcap", "run.mcap exists and is not overwritten"),
    "import: no such file": ("import csv nosuch.csv -o new.mcap", "nosuch.csv cannot be read"),
    "import: wrong form": ("import csv text.txt -o new.mcap", "text.txt has no line '# half_beam_deg"),
    "import: wrong row": ("import csv bad.csv -o new.mcap", "bad.csv:6"),
    "import: output exists": ("import csv drive.csv -o run.mcap", "run.mcap exists and is not overwritten"),
    "udacity: wrong row": ("import udacity text.txt text.txt -o new.mcap", "text.txt:1: 'hello' is no row of integers"),
    "algorithms: no such": ("algorithms magic", "no algorithm 'magic'"),
    "no such command": ("fly", "No such command 'fly'"),
}  # fmt: skip


@pytest.mark.parametrize(("line", "told"), WRONG.values(), ids=WRONG)
def test_wrong_input_is_one_sentence_and_nothing_changes(
    here: Path, capfd: pytest.CaptureFixture[str], line: str, told: str
) -> None:
    before = contents(here)
    assert run(line.split(" ")) == 2
    said = capfd.readouterr()
    assert told in said.err
    assert_one_sentence(said.out, said.err)
    assert contents(here) == before


def assert_one_sentence(out: str, err: str) -> None:
    assert out == ""
    assert err.startswith("sonarlog: ")
    assert err.count("\n") == 1, err
    assert "Traceback" not in err


def test_a_port_that_is_taken(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        process = start("sim", "--world", "bend", "--listen", address)
        out, err = process.communicate(timeout=20)
    assert process.returncode == 2
    assert_one_sentence(out, err)
    assert err == f"sonarlog: cannot listen on {address}: Address already in use; name another one with --listen\n"


# Quiet where there is progress to tell: on a busy machine a line of it would come before the sentence.
FULL = {
    "replay": (f"{REPLAY} -q", 8192),
    "replay, not even a head": (f"{REPLAY} -q", 10),
    "replay and export": ("replay short.mcap --export new -q", 8192),
    "replay --viz": ("replay short.mcap --viz new.rrd -q", 8192),
    "replay --viz -o": (f"{REPLAY} --viz new.rrd -q", 8192),
    "diff --png": ("diff raw.mcap run.mcap --png new.png", 1024),
    "import": ("import csv drive.csv -o new.mcap", 1024),
    "record, not even a head": (f"{RECORD} sim://bend --route scan -q", 10),
}


@pytest.mark.parametrize(("line", "largest_file"), FULL.values(), ids=FULL)
def test_a_full_disk_is_one_sentence_and_nothing_is_left(here: Path, line: str, largest_file: int) -> None:
    before = contents(here)
    process = start(*line.split(" "), largest_file=largest_file)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 2, err
    assert_one_sentence(out, err)
    assert "cannot write" in err
    assert contents(here) == before
