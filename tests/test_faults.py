"""The recorder against lines that do all that real ones do, in real processes: nothing is lost, nothing hangs."""

import contextlib
import os
import pty
import random
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from sonarlog.check import check
from sonarlog.log import Log
from sonarlog.recording import open_recording, read_log
from sonarlog.recording.reader import read_wire
from tests.faulty_line import FAULTS, FaultyLine
from tests.processes import robot, start

EARLY = (
    "no robot answers",
    "the line to the robot broke",
    "there is no such port",
)  # nothing to come back to before the first SIP
SPEED = "20"
TAIL = 8192  # bytes that may come to a port after the recorder has left it: the line may have held them back


def received(path: Path) -> bytes:
    return b"".join(data for _, way, data in read_wire(open_recording(path)) if way == "rx")


def scenario(port: str, seed: int, folder: Path) -> str:
    """Record over a line with some faults; says what was wrong with that, nothing if nothing was."""
    folder.mkdir()
    chance = random.Random(seed)
    faults = tuple(chance.sample(FAULTS, chance.randrange(1, 5)))
    path = folder / "a.mcap"
    with FaultyLine(port, seed, faults, folder if seed % 3 == 0 else None) as line:
        drive = ("--route", "scan") if seed % 2 else ("--drive", "none")
        recorder = start("record", "--port", line.url, "--speed", SPEED, "-o", str(path), *drive, "--time", "40", "-v")
        try:
            talk = recorder.communicate(timeout=60)[1]
        except TimeoutError:
            recorder.kill()
            return f"{seed} {faults}: it hangs"
    what = f"{seed} {faults}: exit {recorder.returncode}\n{talk}"
    if "Traceback" in talk or recorder.returncode not in (0, 2):
        return what
    if recorder.returncode == 2 and not path.exists():
        return "" if any(words in talk for words in EARLY) else what
    got = received(path)
    if not line.delivered.startswith(got) or len(line.delivered) - len(got) > TAIL:
        return f"{what}\n{len(got)} bytes of {len(line.delivered)} delivered"
    report = check(path)
    account = report.received
    if account is None or not account.complete or account.bytes != len(got):
        return f"{what}\nbytes unaccounted for"
    well = recorder.returncode == 0 or any(words in talk for words in ("halted", *EARLY))
    return "" if well else what


def scenarios(seeds: range, folder: Path, workers: int) -> None:
    def some(worker: int) -> list[str]:
        with robot("--listen", "127.0.0.1:0", speed=SPEED) as port:
            return [scenario(port, seed, folder / str(seed)) for seed in seeds[worker::workers]]

    with ThreadPoolExecutor(workers) as pool:
        wrong = [text for texts in pool.map(some, range(workers)) for text in texts if text]
    assert not wrong, "\n\n".join(wrong)


def test_a_dozen_bad_lines(tmp_path: Path) -> None:
    scenarios(range(12), tmp_path, 3)


@pytest.mark.slow
def test_two_hundred_bad_lines(tmp_path: Path) -> None:
    scenarios(range(1000, 1200), tmp_path, 4)


@pytest.mark.parametrize("by_usb", [False, True])
def test_unplugged_in_a_sweep_and_back_under_another_name(by_usb: bool, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with (
        robot("--listen", "127.0.0.1:0", speed="10") as port,
        FaultyLine(port, 1, (), tmp_path if by_usb else None) as line,
    ):
        route = ("--route", "scan; go 0.3", "-v")
        recorder = start("record", "--port", line.url, "--speed", "10", "-o", str(path), *route)
        assert recorder.stderr is not None
        while "sweep 0 begins" not in recorder.stderr.readline():
            assert recorder.poll() is None
        time.sleep(0.7)
        line.unplug()
        talk = recorder.communicate(timeout=30)[1]
    assert recorder.returncode == 0, talk
    assert received(path) == line.delivered
    log = read_log(path)
    assert log.odometry.session.max() >= 1
    texts = [event.text for event in log.events]
    order = ["the line to the robot broke", "the port is open again", "connected again after", "sweep 0 is done again",
             "sweep 0 ends after", "the route is done", "stopped and closed"]  # fmt: skip
    places = [next(k for k, text in enumerate(texts) if words in text) for words in order]
    assert places == sorted(places)
    report = check(path)
    assert sum(sweep.usable for sweep in report.sweeps) <= 1
    assert not report.sound


def gone_for(log: Log) -> float:
    return float(np.diff(log.odometry.t_ns).max()) / float(SPEED) / 1e9


def test_a_line_that_stays_silent_is_opened_again(tmp_path: Path) -> None:
    """TCP half open: nothing comes any more, and nobody says so."""
    path = tmp_path / "a.mcap"
    with robot("--listen", "127.0.0.1:0", speed=SPEED) as port, FaultyLine(port, 1, ()) as line:
        recorder = start("record", "--port", line.url, "--speed", SPEED, "-o", str(path), "--drive", "none", "-v")
        assert recorder.stderr is not None
        while "connected to" not in recorder.stderr.readline():
            assert recorder.poll() is None
        time.sleep(0.5)
        line.mute = True
        while "trying again" not in recorder.stderr.readline():
            assert recorder.poll() is None
        line.mute = False
        while "connected again" not in recorder.stderr.readline():
            assert recorder.poll() is None
        time.sleep(0.3)
        recorder.send_signal(signal.SIGINT)
        recorder.communicate(timeout=20)
    assert recorder.returncode == 130
    log = read_log(path)
    assert "no SIP any more: the robot is told to stop" in [event.text for event in log.events]
    assert 4 < gone_for(log) < 9
    assert log.odometry.session.max() >= 1


@pytest.mark.parametrize("seconds", [2.5, pytest.param(10, marks=pytest.mark.slow)])
def test_a_recorder_held_up_says_stop_before_anything_else(seconds: float, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with robot("--listen", "127.0.0.1:0", speed="1") as port:
        recorder = start("record", "--port", port, "-o", str(path), "--route", "go 3", "-v")
        assert recorder.stderr is not None
        while "connected to" not in recorder.stderr.readline():
            assert recorder.poll() is None
        time.sleep(1.0)
        recorder.send_signal(signal.SIGSTOP)
        time.sleep(seconds)
        recorder.send_signal(signal.SIGCONT)
        time.sleep(1.0)
        recorder.send_signal(signal.SIGINT)
        talk = recorder.communicate(timeout=20)[1]
    assert recorder.returncode == 130, talk
    assert "held up for" in talk
    wire = list(read_wire(open_recording(path)))
    sent = [(t_ns, data) for t_ns, way, data in wire if way == "tx"]
    pause = max(range(1, len(sent)), key=lambda k: sent[k][0] - sent[k - 1][0])
    assert sent[pause][1][:4] == b"\xfa\xfb\x03\x1d"  # STOP
    account = check(path).received
    assert account is not None
    assert (account.bad_packets, account.junk_bytes) == (0, 0)


def test_a_terminal_that_is_lost_ends_the_recording_well(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    terminal, theirs = pty.openpty()
    code = "from cli.main import main; main()"
    arguments = ["record", "--port", "sim://corridor?speed=20", "-o", str(path), "-v"]
    recorder = subprocess.Popen([sys.executable, "-c", code, *arguments], stderr=theirs, stdin=theirs)
    os.close(theirs)
    while b"sweep 0 begins" not in os.read(terminal, 4096):
        assert recorder.poll() is None
    os.close(terminal)
    assert recorder.wait(timeout=20) == 130
    assert read_log(path).events[-1].text == "the robot is stopped and closed"


def test_a_terminal_that_is_held_holds_nothing_else(tmp_path: Path) -> None:
    """Ctrl-S: nobody takes what the recorder says. A full pipe does the same."""
    path = tmp_path / "a.mcap"
    ours, theirs = os.pipe()
    os.set_blocking(theirs, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(theirs, bytes(4096))
    os.set_blocking(theirs, True)
    with robot("--listen", "127.0.0.1:0", speed="5") as port:
        code = "from cli.main import main; main()"
        arguments = ["record", "--port", port, "-o", str(path), "--speed", "5", "--time", "20", "--drive", "none", "-v"]
        recorder = subprocess.Popen([sys.executable, "-c", code, *arguments], stderr=theirs)
        assert recorder.wait(timeout=20) == 0
    os.close(ours)
    os.close(theirs)
    report = check(path)
    assert report.timing is not None
    assert report.timing.longest_ms < 5000  # a second of ours
    assert report.timing.sips > 180
