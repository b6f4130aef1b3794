"""What the recorder does when the line, the disk or the robot at the other end is not what it should be."""

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest

from cli.main import run
from sonarlog import recorder as recorder_module
from sonarlog import scribe as scribe_module
from sonarlog.connection import Again
from sonarlog.log import Event, Log
from sonarlog.mcap_file import CannotWrite, partial_path
from sonarlog.plan import Plan
from sonarlog.protocol.commands import Command, encode_command, parse_command
from sonarlog.protocol.framing import Frame, Framer, frame
from sonarlog.protocol.packets import STOP_BUTTON, Packet, Reset, Sip, parse_packet
from sonarlog.recorder import Recorder, RouteHalted, SimulatorAnswers, Status
from sonarlog.recording import RecordingWriter, open_recording, read_log
from sonarlog.recording.reader import read_wire
from sonarlog.route import parse_route
from sonarlog.scribe import Scribe, WriterHangs
from sonarlog.session import NoAnswer
from sonarlog.sim.link import open_sim
from sonarlog.transport import LinkLost, PortNotOpened, stable_name
from tests.processes import robot

SECOND = 1_000_000_000
Change = Callable[[Packet], Packet | None]


class Bench:
    """The embedded robot at a serial line that this test holds in its hand.

    The robot listens at `robot_baud`; it changes that on HOSTBAUD if `obeys`. `change` is done to each packet.
    """

    def __init__(self, robot_baud: int = 9600, *, obeys: bool = True, change: Change = lambda packet: packet) -> None:
        self._sim = open_sim("sim://corridor?odometry=0")
        self._framer = Framer()
        self.robot_baud = robot_baud
        self.baud = 9600
        self.waits = True
        self.rates = [9600]
        self.commands: list[tuple[int, int | bytes | None]] = []
        self.broken = False
        self.mute = False
        self.pause_s = 0.0
        self._obeys = obeys
        self._change = change
        self.now_ns = self._sim.now_ns

    def read(self, timeout_s: float) -> bytes:
        data = self._sim.read(timeout_s)
        time.sleep(self.pause_s)
        if self.broken:
            raise LinkLost("bench", OSError("unplugged"))
        if self.baud != self.robot_baud:
            return bytes(byte ^ 0x5A for byte in data)
        pieces = [] if self.mute else self._framer.feed(data, 0)
        packets = [self._change(parse_packet(piece.body)) for piece in pieces if isinstance(piece, Frame)]
        return b"".join(frame(packet.encode()) for packet in packets if packet is not None)

    def write(self, data: bytes) -> None:
        if self.broken:
            raise LinkLost("bench", OSError("unplugged"))
        if self.baud != self.robot_baud or self.mute:
            return
        for piece in Framer().feed(data, 0):
            assert isinstance(piece, Frame)
            number, argument = parse_command(piece.body)
            if number == Command.CLOSE and self._sim.robot.is_open:
                self.robot_baud = 9600
            self.commands.append((number, argument))
            if self._obeys and self.commands[-1] == (Command.HOSTBAUD, 2):
                self.robot_baud = 38400
        self._sim.write(data)

    def set_baud(self, baud: int) -> None:
        self.baud = baud
        self.rates.append(baud)

    def pass_time(self, seconds: float) -> None:
        self._sim.read(seconds)

    def close(self) -> None:
        self._sim.close()
        self.robot_baud = 9600


def record(path: Path, bench: Bench, plan: Plan, again: Again | None = None) -> tuple[Log, list[str]]:
    events: list[Event] = []
    with RecordingWriter(path, started_wall_ns=SECOND, command_line="test", config={}) as writer:
        Recorder(bench, writer, plan, wall_ns=bench.now_ns, again=again, tell=events.append).run(lambda: False)
    return read_log(path), [event.text for event in events]


SHORT = Plan(limit_ns=20 * SECOND)
SIMULATED = replace(SHORT, rate=1.0001)  # nobody asks a simulator for another rate


@pytest.mark.parametrize("baud", [38400, 115200])
def test_a_robot_at_another_rate_is_found(baud: int, tmp_path: Path) -> None:
    log, texts = record(tmp_path / "a.mcap", Bench(baud), replace(SIMULATED, limit_ns=30 * SECOND))
    assert len(log.odometry.t_ns) > 50
    assert "no answer at 9600 baud: trying 38400" in texts


def test_a_robot_left_open_at_another_rate_is_closed_and_found_at_its_own(tmp_path: Path) -> None:
    """What a client leaves that was killed after HOSTBAUD."""
    bench = Bench()
    for command in (0, 1, 2):
        bench.write(encode_command(command))
        bench.read(1.0)
    bench.write(encode_command(Command.OPEN, 1))
    bench.robot_baud = 38400
    log, texts = record(tmp_path / "a.mcap", bench, replace(SIMULATED, limit_ns=30 * SECOND))
    assert "the robot was still open from another session: closing it first" in texts
    assert bench.rates == [9600, 38400, 9600]
    assert len(log.odometry.t_ns) > 50


def test_a_robot_at_no_rate_is_given_up(tmp_path: Path) -> None:
    bench = Bench(300)
    with pytest.raises(NoAnswer, match="nothing came back"):
        record(tmp_path / "a.mcap", bench, Plan())
    assert bench.rates == [9600, 38400, 115200, 19200, 57600]


@pytest.mark.parametrize("obeys", [True, False])
def test_a_robot_that_offers_a_faster_line_gets_it_or_is_left_at_the_slow_one(obeys: bool, tmp_path: Path) -> None:
    bench = Bench(obeys=obeys)
    log, texts = record(tmp_path / "a.mcap", bench, SHORT)
    assert (Command.HOSTBAUD, 2) in bench.commands
    assert bench.rates == ([9600, 38400] if obeys else [9600, 38400, 9600])
    said = "the line runs at 38400 baud now" if obeys else "nothing is heard at 38400 baud: back to 9600"
    assert said in texts
    assert len(log.odometry.t_ns) > 150
    assert log.odometry.session.max() == 0


def test_a_config_packet_that_never_passes_its_checksum_is_done_without(tmp_path: Path) -> None:
    bench = Bench(change=lambda packet: None if type(packet).__name__ == "ConfigPacket" else packet)
    log, texts = record(tmp_path / "a.mcap", bench, SIMULATED)
    assert "no CONFIG packet passed its checksum: going on without one" in texts
    assert [number for number, _ in bench.commands].count(Command.CONFIG) == 3
    assert len(log.odometry.t_ns) > 100


def test_a_simulator_where_a_robot_was_expected_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SimulatorAnswers, match="--sim"):
        record(tmp_path / "a.mcap", Bench(), replace(SHORT, real=True))


def test_a_reset_controller_begins_a_new_session_and_the_sweep_again(tmp_path: Path) -> None:
    """A reset takes place of SIP 100; the real robot is then closed and counts from zero."""
    sips = 0

    def change(packet: Packet) -> Packet:
        nonlocal sips
        sips += isinstance(packet, Sip)
        if isinstance(packet, Sip) and sips == 100:
            bench.write(encode_command(Command.CLOSE))
            return Reset()
        return packet

    bench = Bench(change=change)
    log, texts = record(tmp_path / "a.mcap", bench, Plan(parse_route("scan")))
    assert "the robot's controller was reset: odometry starts anew" in texts
    assert "sweep 0 is done again: odometry began anew in it" in texts
    assert log.odometry.session.max() == 1
    assert [number for number, _ in bench.commands].count(Command.OPEN) == 4  # SYNC1 and OPEN, twice


def test_a_pressed_stop_button_halts_the_route_and_the_robot_is_left_safe(tmp_path: Path) -> None:
    sips = 0

    def press(packet: Packet) -> Packet:
        nonlocal sips
        sips += isinstance(packet, Sip)
        return replace(packet, flags=packet.flags | STOP_BUTTON) if isinstance(packet, Sip) and sips > 50 else packet

    bench = Bench(change=press)
    with pytest.raises(RouteHalted, match="STOP button"):
        record(tmp_path / "a.mcap", bench, Plan(parse_route("go 3")))
    assert bench.commands[-3:] == [(Command.STOP, None), (Command.ENABLE, 0), (Command.CLOSE, 1)]
    assert len(read_log(tmp_path / "a.mcap").odometry.t_ns) > 40


def test_a_goodbye_that_is_not_heard_is_said_again(tmp_path: Path) -> None:
    bench = Bench()
    write, deaf = bench.write, [True]

    def lose_the_first(data: bytes) -> None:
        if data.endswith(encode_command(Command.CLOSE, 1)) and deaf.pop():
            deaf.append(False)
            return
        write(data)

    bench.write = lose_the_first  # type: ignore[method-assign]
    record(tmp_path / "a.mcap", bench, replace(SIMULATED, limit_ns=3 * SECOND))
    assert bench.commands[-1] == (Command.CLOSE, 1)


def test_an_exception_anywhere_leaves_the_robot_stopped(tmp_path: Path) -> None:
    def fail(_event: Event) -> None:
        if any(number == Command.VEL for number, _ in bench.commands):
            raise ZeroDivisionError

    bench = Bench()
    with RecordingWriter(tmp_path / "a.mcap", started_wall_ns=0, command_line="", config={}) as writer:
        plan = Plan(parse_route("go 0.3; scan"))
        with pytest.raises(ZeroDivisionError):
            Recorder(bench, writer, plan, wall_ns=bench.now_ns, tell=fail).run(lambda: False)
    assert bench.commands[-3:] == [(Command.STOP, None), (Command.ENABLE, 0), (Command.CLOSE, 1)]


def test_a_lost_line_is_tried_again_with_growing_pauses_and_then_given_up(tmp_path: Path) -> None:
    bench = Bench()
    tried: list[int] = []

    def unplugged() -> Bench:
        tried.append(bench.now_ns())
        raise PortNotOpened("bench", FileNotFoundError(2, "gone"))

    def lost_soon(status: Status) -> None:
        bench.broken |= status.sips > 20

    with RecordingWriter(tmp_path / "a.mcap", started_wall_ns=0, command_line="", config={}) as writer:
        again = Again(unplugged, bench.pass_time, give_up_s=10)
        recorder = Recorder(bench, writer, Plan(), wall_ns=bench.now_ns, again=again, report=lost_soon)
        with pytest.raises(LinkLost, match="unplugged"):
            recorder.run(lambda: False)
    pauses = [round((after - before) / SECOND, 1) for before, after in pairwise(tried)]
    assert pauses == [0.5, 1.0, 2.0, 4.0, 4.0]
    texts = [event.text for event in read_log(tmp_path / "a.mcap").events]
    assert "trying again for 10 s" in texts[-1]


def hanging(writer: RecordingWriter, gate: threading.Event) -> RecordingWriter:
    flush = writer.flush

    def wait(*, fsync: bool = False) -> None:
        gate.wait(10)
        flush(fsync=fsync)

    writer.flush = wait  # type: ignore[method-assign]
    return writer


def test_a_disk_that_hangs_stops_the_robot_until_it_has_caught_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The line does not wait for the disk here, as no real one does."""
    monkeypatch.setattr(recorder_module, "HOLD_NS", SECOND // 10)
    gate = threading.Event()
    bench = Bench()
    bench.waits = False
    bench.pause_s = 0.001
    seen: list[str] = []

    def tell(event: Event) -> None:
        seen.append(event.text)
        if "does not keep up" in event.text:
            gate.set()

    with RecordingWriter(tmp_path / "a.mcap", started_wall_ns=0, command_line="", config={}) as writer:
        plan = Plan(parse_route("scan"))
        Recorder(bench, hanging(writer, gate), plan, wall_ns=time.monotonic_ns, tell=tell).run(lambda: False)
    held = next(k for k, text in enumerate(seen) if "does not keep up" in text)
    assert "the disk has caught up" in seen[held:]
    assert any("sweep 0 ends after" in text for text in seen)
    account = b"".join(data for _, way, data in read_wire(open_recording(tmp_path / "a.mcap")) if way == "tx")
    assert encode_command(Command.STOP) in account


def test_a_disk_that_never_comes_back_ends_the_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scribe_module, "HUNG_NS", SECOND // 5)  # how long the end waits for it
    gate = threading.Event()
    bench = Bench()
    bench.waits = False
    writer = RecordingWriter(tmp_path / "a.mcap", started_wall_ns=0, command_line="", config={})
    recorder = Recorder(bench, hanging(writer, gate), Plan(parse_route("scan")), wall_ns=bench.now_ns)
    with pytest.raises(WriterHangs, match="the robot is stopped"):
        recorder.run(lambda: False)
    assert bench.commands[-1] == (Command.CLOSE, 1)
    gate.set()
    recorder._scribe._thread.join()
    writer.close()


def test_what_the_disk_refuses_is_raised_again_and_again(tmp_path: Path) -> None:
    refusal = CannotWrite(partial_path(tmp_path / "a.mcap"), OSError(28, "No space left on device"), kept=True)

    def refuse() -> None:
        raise refusal

    scribe = Scribe(SimpleNamespace(flush=lambda fsync: None), time.monotonic_ns, waits=True)  # type: ignore[arg-type]
    scribe.do(refuse)
    for call in (scribe.close, lambda: scribe.do(print), scribe.close):
        with pytest.raises(CannotWrite, match="No space left"):
            call()


def test_a_device_is_opened_by_the_name_that_stays_the_same(tmp_path: Path) -> None:
    by_id = tmp_path / "by-id"
    by_id.mkdir()
    (by_id / "usb-FTDI_123-if00").symlink_to("/dev/null")
    assert stable_name("/dev/null", by_id) == f"{by_id}/usb-FTDI_123-if00"
    assert stable_name("/dev/zero", by_id) == "/dev/zero"
    assert stable_name("socket://127.0.0.1:1", by_id) == "socket://127.0.0.1:1"


def test_a_serial_port_with_a_simulator_is_refused_by_the_command_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["-o", str(tmp_path / "a.mcap"), "--drive", "none", "--time", "1", "-q"]
    with robot("--pty", speed="1") as device:
        assert run(["record", "--port", device, *arguments]) == 2
        assert "a simulator answers at this port" in capsys.readouterr().err
        assert run(["record", "--port", device, "--sim", *arguments, "--force"]) == 0
