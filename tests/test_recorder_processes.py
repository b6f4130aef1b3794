"""`sonarlog record` as a process, against the embedded robot as another one, over TCP and a pseudo terminal."""

import os
import pty
import re
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cli.main import run
from sonarlog.recording import read_log
from tests.processes import SPEED, robot, start


@pytest.fixture(scope="module")
def port() -> Iterator[str]:
    with robot("--listen", "127.0.0.1:0") as url:
        yield url


def test_over_tcp(port: str, tmp_path: Path) -> None:
    recorder = start("record", "--port", port, "--speed", SPEED, "-o", str(tmp_path / "a.mcap"), "--route", "scan")
    talk = recorder.communicate(timeout=30)[1]
    assert recorder.returncode == 0, talk
    assert re.search(r"a\.mcap: 1 sweeps, \d+ readings, \d+ SIPs and 0 bad packets", talk)
    log = read_log(tmp_path / "a.mcap")
    assert log.robot.name == "amigo-sh"
    assert len(log.readings.t_ns) > 700
    assert log.truth is not None
    assert log.surfaces is not None


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupted_recording_is_finished_and_the_robot_can_be_used_again(
    port: str, tmp_path: Path, number: signal.Signals
) -> None:
    path = tmp_path / "a.mcap"
    recorder = start("record", "--port", port, "--speed", SPEED, "-o", str(path), "-v")
    assert recorder.stderr is not None
    while "sweep 0 begins" not in recorder.stderr.readline():
        pass
    time.sleep(0.2)
    recorder.send_signal(number)
    recorder.communicate(timeout=20)
    assert recorder.returncode == 130
    assert not list(tmp_path.glob("*.part"))
    log = read_log(path)
    assert log.events[-1].text == "the robot is stopped and closed"
    assert "damage" not in log.counts


def test_over_a_pseudo_terminal_that_only_one_may_use(tmp_path: Path) -> None:
    with robot("--pty") as device:
        first = start("record", "--port", device, "--speed", SPEED, "-o", str(tmp_path / "a.mcap"), "--drive", "none")
        assert first.stderr is not None
        deadline = time.monotonic() + 10
        while not list(tmp_path.glob("a.mcap.part")) and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(0.5)
        second = start("record", "--port", device, "--speed", SPEED, "-o", str(tmp_path / "b.mcap"))
        talk = second.communicate(timeout=20)[1]
        assert second.returncode == 2
        assert "another program has it open" in talk
        first.send_signal(signal.SIGINT)
        first.communicate(timeout=20)
        assert first.returncode == 130
    assert len(read_log(tmp_path / "a.mcap").readings.t_ns) > 50
    assert not list(tmp_path.glob("b.*"))


def test_a_full_disk_stops_the_robot_and_keeps_what_was_recorded(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recorder = start("record", "--port", "sim://corridor?speed=30", "-o", str(path), largest_file=80_000)
    talk = recorder.communicate(timeout=60)[1]
    assert recorder.returncode == 2, talk
    assert "cannot write" in talk
    assert "Traceback" not in talk
    partial = tmp_path / "a.mcap.part"
    log = read_log(partial)
    assert len(log.odometry.t_ns) > 100


@pytest.mark.slow
def test_a_line_that_says_nothing_leaves_no_file(tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    try:
        device = os.ttyname(theirs)
        recorder = start("record", "--port", device, "-o", str(tmp_path / "a.mcap"), "-q")
        talk = recorder.communicate(timeout=30)[1]
    finally:
        os.close(ours)
        os.close(theirs)
    assert recorder.returncode == 2
    assert talk.startswith("sonarlog: no robot answers at this port: nothing came back")
    assert not list(tmp_path.iterdir())


def closed_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--port", "/dev/nosuchport"], "port /dev/nosuchport: there is no such port"),
        (["--port", "socket://127.0.0.1:{closed}"], "nobody listens there"),
        (["--port", "nonsense://x"], "port nonsense://x: cannot be opened"),
        (["--port", "/dev/null"], "port /dev/null: cannot be opened"),
        (["--port", "sim://atlantis"], "there is no world 'atlantis'"),
        (["--port", "sim://corridor", "--speed", "3"], "speed stands in its URL"),
        (["--port", "sim://corridor", "--route", "jump"], "'jump' is no step"),
        (["--port", "sim://corridor", "--route", "scan", "--drive", "none"], "give one of them"),
        (["--port", "sim://corridor", "--robot", "r2d2"], "robot 'r2d2' is not built in"),
    ],
)
def test_what_the_user_can_mend_is_one_sentence(
    arguments: list[str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [argument.replace("{closed}", str(closed_port())) for argument in arguments]
    assert run(["record", *arguments, "-o", str(tmp_path / "a.mcap")]) == 2
    assert sentence in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_recording_is_never_overwritten_unasked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"precious")
    arguments = ["record", "--port", "sim://corridor", "-o", str(path), "--route", "go 0.2", "-q"]
    assert run(arguments) == 2
    assert "exists" in capsys.readouterr().err
    assert path.read_bytes() == b"precious"
    assert run([*arguments, "--force"]) == 0
    assert len(read_log(path).readings.t_ns) > 20


def test_a_route_may_stand_in_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "route.txt").write_text("# there and back\nrepeat 2 (go 0.2;\n turn 180)", encoding="utf-8")
    arguments = ["record", "--port", "sim://corridor?odometry=0", "-o", str(tmp_path / "a.mcap"), "--lean"]
    assert run([*arguments, "--route", str(tmp_path / "route.txt")]) == 0
    log = read_log(tmp_path / "a.mcap")
    assert abs(log.odometry.x_um[-1]) < 50_000
    assert 150_000 < log.odometry.x_um.max() < 250_000
