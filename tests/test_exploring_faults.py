"""An exploration and all that may befall it: it stops safely, says why, goes on or ends, and its recording is sound."""

import random
import signal
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from sonarlog.exploring.explorer import Limits
from sonarlog.plan import SECOND
from sonarlog.protocol.commands import Command, encode_command
from sonarlog.protocol.packets import STOP_BUTTON, Packet, Reset, Sip
from sonarlog.recorder import RouteHalted
from sonarlog.recording import read_log
from sonarlog.sim.link import open_sim
from sonarlog.sim.world import Material, Wall
from tests.explorations import CHAMBER, HALL, QUICK, bench, explore, on_the_way, put, texts, unsound, url
from tests.faulty_line import FaultyLine
from tests.processes import robot, start
from tests.test_recorder import clearance

DONE = "nothing reachable is unknown"
HOME = "the exploration is back at its start"
SPEED = "20"


@pytest.mark.parametrize(
    ("sips", "said"),
    [
        (30, ["no SIP any more: the robot is told to stop", "the robot is heard again"]),
        (70, ["no SIP any more: the robot is told to stop", "the port is open again", "odometry was interrupted"]),
    ],
)
def test_a_silence_stops_it_and_then_it_goes_on(sips: int, said: list[str], tmp_path: Path) -> None:
    link = bench(on_the_way(lambda number, sip: None if number < sips else sip))
    explorer, log = explore(tmp_path / "a.mcap", link, replace(QUICK, come_back=True))
    assert explorer.ended == DONE
    assert all(any(words in text for text in texts(log)) for words in said)
    assert HOME in texts(log)
    assert clearance(log) > 0.2
    made = str(tmp_path / "a.run.mcap")
    assert run(["replay", str(tmp_path / "a.mcap"), "-o", made, "-q"]) == 0
    assert run(["verify", made, "-q"]) == 0


@pytest.mark.slow
def test_a_silence_in_a_place_with_a_niche(tmp_path: Path) -> None:
    explorer, log = explore(
        tmp_path / "a.mcap", bench(on_the_way(lambda n, sip: None if n < 30 else sip), CHAMBER), place=CHAMBER
    )
    assert explorer.ended == DONE
    assert clearance(log) > 0.2


@pytest.mark.parametrize("after", [0, pytest.param(6, marks=pytest.mark.slow)])
@pytest.mark.parametrize("place", [HALL, pytest.param(CHAMBER, marks=pytest.mark.slow)], ids=["hall", "chamber"])
def test_after_a_reset_it_looks_where_it_is_and_goes_on(place: Path, after: int, tmp_path: Path) -> None:
    def reset(number: int, sip: Sip) -> Packet:
        if number != after:
            return sip
        link.write(encode_command(Command.CLOSE))
        return Reset()

    link = bench(on_the_way(reset), place)
    explorer, log = explore(tmp_path / "a.mcap", link, replace(QUICK, come_back=True), place)
    said = texts(log)
    lost = next(k for k, text in enumerate(said) if text.startswith("odometry was interrupted"))
    assert said[lost + 1].startswith("sweep 1 begins")
    assert "the walls are known again: on as before" in said
    assert explorer.ended == DONE
    assert clearance(log) > 0.2
    assert HOME in said
    assert log.truth is not None
    assert np.hypot(*log.truth.pose[-1, :2]) < 0.4
    assert not unsound(tmp_path / "a.mcap")


def test_junk_on_the_line_is_lived_with(tmp_path: Path) -> None:
    link, chance = open_sim(url()), random.Random(1)
    read = link.read

    def spoilt(timeout_s: float) -> bytes:
        data = bytearray(read(timeout_s))
        if data and chance.random() < 0.05:
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        if chance.random() < 0.03:
            data += chance.randbytes(20) + b"\xfa\xfb"
        return bytes(data)

    link.read = spoilt  # type: ignore[method-assign]
    explorer, log = explore(tmp_path / "a.mcap", link)
    assert explorer.ended == DONE
    assert any(text.startswith("sync lost") for text in texts(log))
    assert clearance(log) > 0.2
    assert not unsound(tmp_path / "a.mcap")


def obstructed(path: Path, across: Wall, from_x: float) -> tuple[float, list[str], str]:
    """A wall across the hall appears once the robot is at x: nearest its rim came to it, events, and how it ended."""
    link = open_sim(url())
    read, there = link.read, False

    def reading(timeout_s: float) -> bytes:
        nonlocal there
        if not there and link.robot.true_pose[0] > from_x * 1e6:
            there = True
            put(link, across)
        return read(timeout_s)

    link.read = reading  # type: ignore[method-assign]
    explorer, log = explore(path, link, replace(QUICK, max_time_ns=120 * SECOND))
    assert there
    assert log.truth is not None
    off = np.abs(log.truth.pose[:, 0] - across.x0)
    return float(off.min()) - 0.18, texts(log), explorer.ended


def test_a_way_that_is_blocked_while_it_drives_is_not_driven(tmp_path: Path) -> None:
    plaster = Material(14.0)
    room, said, ended = obstructed(tmp_path / "a.mcap", Wall(0.7, -0.9, 0.7, 0.9, plaster), 0.1)
    assert room > 0.03
    assert any(text.startswith("something is in the way") for text in said)
    assert ended
    assert not any("stalled" in text for text in said)
    assert not unsound(tmp_path / "a.mcap")


def test_what_no_sonar_sees_is_backed_off_from(tmp_path: Path) -> None:
    room, said, ended = obstructed(tmp_path / "a.mcap", Wall(1.1, -0.9, 1.1, 0.9, Material(14.0, echo=0.0)), 0.45)
    assert room == pytest.approx(0.0, abs=0.01)
    assert "the wheels stalled: backing off" in said
    assert ended
    assert not unsound(tmp_path / "a.mcap")


def test_a_bumper_that_is_hit_is_backed_off_from(tmp_path: Path) -> None:
    link = bench(on_the_way(lambda number, sip: replace(sip, stall_bumps=0x0400) if number < 5 else sip))
    explorer, log = explore(tmp_path / "a.mcap", link)
    assert "a bumper was hit: backing off" in texts(log)
    assert explorer.ended == DONE
    assert not unsound(tmp_path / "a.mcap")


@pytest.mark.parametrize(
    ("fault", "why"),
    [
        (lambda sip: replace(sip, stall_bumps=0x0400), "a bumper is pressed"),
        (lambda sip: replace(sip, flags=sip.flags | STOP_BUTTON), "the STOP button is pressed"),
    ],
)
def test_what_does_not_pass_halts_it(fault, why: str, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(RouteHalted, match=why):
        explore(tmp_path / "a.mcap", bench(on_the_way(lambda _number, sip: fault(sip))))
    assert read_log(tmp_path / "a.mcap").events[-1].text == "the robot is stopped and closed"
    assert not unsound(tmp_path / "a.mcap")


def drained(_number: int, sip: Sip) -> Sip:
    return replace(sip, battery=105, tail=(*sip.tail[:5], 105, *sip.tail[6:]))


@pytest.mark.parametrize(
    ("limits", "change", "why"),
    [
        (Limits(max_time_ns=40 * SECOND), lambda _n, sip: sip, "the time is up"),
        (Limits(max_distance_m=0.2), lambda _n, sip: sip, "0.3 m are driven"),
        (Limits(min_volts=11.0), drained, "the battery is low: 10.5 V"),
    ],
)
def test_it_ends_where_it_is_told_to_even_on_the_way(limits, change, why: str, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    explorer, log = explore(tmp_path / "a.mcap", bench(on_the_way(change)), replace(limits, come_back=True))
    assert explorer.ended == why
    assert HOME in texts(log)
    assert texts(log)[-1] == "the robot is stopped and closed"
    assert not unsound(tmp_path / "a.mcap")


def test_a_bad_line_that_breaks_between_real_processes(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with (
        robot("--world", str(HALL), "--listen", "127.0.0.1:0", speed=SPEED) as port,
        FaultyLine(port, 1, ("junk", "flip", "drop", "split")) as line,
    ):
        arguments = ["--port", line.url, "--speed", SPEED, "-o", str(path), "--max-time", "80", "--lean"]
        explorer = start("explore", *arguments)
        assert explorer.stderr is not None
        while "station 0" not in explorer.stderr.readline():
            assert explorer.poll() is None
        time.sleep(0.05)
        line.unplug()
        talk = explorer.communicate(timeout=60)[1]
        assert explorer.returncode == 0, talk
        assert line.closes == 1
    said = ["the line to the robot broke", "connected again after", "odometry was interrupted", "station 1: "]
    places = [talk.find(words) for words in said]
    assert -1 not in places, talk
    assert places == sorted(places)
    assert talk.rstrip().endswith(("the time is up", DONE))
    assert not unsound(path)


@pytest.mark.parametrize("home", [False, True], ids=["here", "home"])
def test_ctrl_c_ends_it_here_or_at_home(home: bool, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    port = f"{url()}&speed=30"
    explorer = start("explore", "--port", port, "-o", str(path), "-v", "--lean", *(["--return"] if home else []))
    assert explorer.stderr is not None
    while "sweep 1 begins" not in explorer.stderr.readline():
        assert explorer.poll() is None
    explorer.send_signal(signal.SIGINT)
    talk = explorer.communicate(timeout=60)[1]
    assert explorer.returncode == 130, talk
    assert talk.rstrip().endswith("you asked for it"), talk
    assert (HOME in talk) == home
    assert texts(read_log(path))[-1] == "the robot is stopped and closed"
    assert not unsound(path)
