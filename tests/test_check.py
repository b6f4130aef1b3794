"""`sonarlog check`: what is planted is found, and a sound recording is called sound."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from cli.main import run
from sonarlog.check import check
from sonarlog.check.wire import Wire
from sonarlog.protocol.framing import Frame, Framer, frame
from sonarlog.protocol.packets import Reset, Sip, parse_packet
from sonarlog.recording import RecordingWriter, open_recording
from sonarlog.recording.reader import read_wire
from sonarlog.robot import load_robot

SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sound") / "a.mcap"
    assert run(["record", "--port", "sim://corridor", "-o", str(path), "--route", "scan; go 0.5; scan", "-q"]) == 0
    return path


@pytest.fixture(scope="module")
def wire(sound: Path) -> Wire:
    return list(read_wire(open_recording(sound)))


def write(path: Path, wire: Wire) -> Path:
    with RecordingWriter(path, started_wall_ns=SECOND, command_line="test", config={}) as recording:
        recording.identity({"name": "test"}, load_robot("amigo-sh"))
        for t_ns, direction, data in wire:
            recording.wire(t_ns, direction, data)
    return path


def sips(change: Callable[[Sip], Sip | None]) -> Callable[[Wire], Wire]:
    """Every SIP changed, or left out."""

    def changed(data: bytes) -> bytes:
        out = b""
        for piece in Framer().feed(data, 0):
            assert isinstance(piece, Frame)
            packet = parse_packet(piece.body)
            now = change(packet) if isinstance(packet, Sip) else packet
            out += frame(now.encode()) if now is not None else b""
        return out

    return lambda wire: [
        (t_ns, way, changed(data) if way == "rx" else data) for t_ns, way, data in wire if way == "tx" or changed(data)
    ]


def without(begin_s: float, end_s: float) -> Callable[[Wire], Wire]:
    return lambda wire: [message for message in wire if not begin_s * SECOND <= message[0] < end_s * SECOND]


def ranges(sonar: int, millimetres: int) -> Callable[[Wire], Wire]:
    def change(sip: Sip) -> Sip:
        return replace(sip, sonar=tuple((n, millimetres if n == sonar else r) for n, r in sip.sonar))

    return sips(change)


def flipped(wire: Wire) -> Wire:
    """One byte of every tenth chunk."""
    return [
        (t_ns, way, bytes((*data[:9], data[9] ^ 4, *data[10:])) if k % 10 == 0 and len(data) > 30 else data)
        for k, (t_ns, way, data) in enumerate(wire)
    ]


def reset(wire: Wire) -> Wire:
    at = next(k for k, (t_ns, _, _) in enumerate(wire) if t_ns > 5 * SECOND)
    return [*wire[:at], (wire[at][0], "rx", frame(Reset().encode())), *wire[at:]]


def middle(wire: Wire) -> int:
    return next(k for k, (t_ns, way, _) in enumerate(wire) if t_ns > 20 * SECOND and way == "rx")


def test_a_sound_recording_is_called_sound(sound: Path, wire: Wire, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["doctor", str(sound)]) == 0
    assert "sound; 2 of 2 sweeps usable" in capsys.readouterr().out
    assert run(["check", str(sound), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    received = found["received"]
    parts = received["packet_bytes"], received["bad_packet_bytes"], received["junk_bytes"]
    assert sum(parts) == received["bytes"] == sum(len(data) for _, way, data in wire if way == "rx")
    assert (found["timing"]["cycle_ms"], found["wraps"], len(found["sonars"])) == (100.0, 2, 8)
    assert all(sweep["usable"] for sweep in found["sweeps"])


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (flipped, r"bad packets \("),
        (lambda wire: [(t, way, b"WMS2\r" + data) for t, way, data in wire], "bytes between packets"),
        (without(10, 13), "a gap of 3."),
        (without(10, 14), "part of a circle|of its packets are missing"),
        (without(24, 1000), "° are no full circle"),
        (sips(lambda sip: None if sip.heading % 7 == 0 else sip), "SIPs never came"),
        (reset, "controller was reset 1 time"),
        (sips(lambda sip: replace(sip, x=sip.x ^ (0x2000 if sip.heading > 0 else 0))), "odometry jumped"),
        (sips(lambda sip: replace(sip, sonar=tuple(r for r in sip.sonar if r[0] != 3))), "sonar 3 is dead: it never"),
        (ranges(5, 5000), "sonar 5 is dead: it hears no echo"),
        (ranges(5, 800), "sonar 5 is stuck"),
        (lambda wire: [(t * 9 // 10, way, data) for t, way, data in wire], "one of the clocks is wrong"),
        (lambda wire: wire[: middle(wire)] + wire[middle(wire) - 5 :], "are earlier than the one before"),
        (lambda wire: [m for m in wire for _ in range(1 + (m is wire[middle(wire)]))], "1 messages stand there twice"),
        (sips(lambda sip: replace(sip, sonar=sip.sonar[:1] if sip.heading % 3 == 0 else ())), "where .* should be"),
    ],
)
def test_what_is_wrong_is_found(spoil: Callable[[Wire], Wire], sentence: str, wire: Wire, tmp_path: Path) -> None:
    report = check(write(tmp_path / "a.mcap", spoil(list(wire))))
    assert not report.sound
    assert re.search(sentence, "\n".join(finding.text for finding in report.findings))
    assert report.received is not None
    assert report.received.complete


def test_bursts_are_counted_and_not_smeared(wire: Wire, tmp_path: Path) -> None:
    """A USB adapter that holds bytes back for half a second."""
    held = [(-(-t_ns // (SECOND // 2)) * (SECOND // 2), way, data) for t_ns, way, data in wire]
    report = check(write(tmp_path / "a.mcap", held))
    assert report.timing is not None
    assert report.timing.bursts > 0.7 * report.timing.sips
    assert report.timing.p99_ms == 500


def test_damage_of_the_file_is_a_problem(sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(sound.read_bytes()[:-3000])
    assert run(["check", str(cut)]) == 1
    assert "problem     file: " in capsys.readouterr().out
    cut.write_bytes(sound.read_bytes()[:-100] + b"x" + sound.read_bytes()[-99:])
    assert run(["check", str(cut)]) == 1
    assert "the index at its end" in capsys.readouterr().out
    cut.write_bytes(b"no recording")
    assert run(["check", str(cut)]) == 2
