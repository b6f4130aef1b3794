"""Recording the embedded robot in process: what is driven, what is in the file, and how it ends."""

import time
from pathlib import Path

import numpy as np
import pytest

from sonarlog.cdr import decode
from sonarlog.log import Log
from sonarlog.plan import Plan
from sonarlog.protocol.commands import Command, encode_command, parse_command
from sonarlog.protocol.framing import Frame, Framer
from sonarlog.recorder import Recorder, Status
from sonarlog.recording import RecordingWriter, open_recording, read_log, recording_digest
from sonarlog.ros2 import Wire
from sonarlog.route import Route, default_route, parse_route
from sonarlog.sim.world import load_world
from sonarlog.transport import Link, open_link

SECOND = 1_000_000_000


def record(
    path: Path, url: str | Link, route: Route | None, stop_after_s: float = 1e9, **plan: int
) -> tuple[Status, Log]:
    link = open_link(url, time.monotonic_ns) if isinstance(url, str) else url
    with RecordingWriter(path, started_wall_ns=SECOND, command_line="test", config={}) as writer:
        recorder = Recorder(link, writer, Plan(route, **plan), wall_ns=link.now_ns)  # type: ignore[arg-type]
        status = recorder.run(lambda: link.now_ns() > stop_after_s * 1e9)
    return status, read_log(path)


def sent(path: Path) -> list[tuple[int, int | bytes | None]]:
    wires = [decode(Wire, message.data) for message in open_recording(path).stream({"/wire"})]
    pieces = Framer().feed(b"".join(wire.data for wire in wires if wire.direction == 1), 0)
    return [parse_command(piece.body) for piece in pieces if isinstance(piece, Frame)]


def clearance(log: Log) -> float:
    """Nearest that the robot's centre came to a surface, in metres."""
    assert log.truth is not None
    assert log.surfaces is not None
    points = log.truth.pose[:, None, :2]
    begin, end = log.surfaces.segments[None, :, :2], log.surfaces.segments[None, :, 2:]
    along = end - begin
    share = np.clip(((points - begin) * along).sum(-1) / (along**2).sum(-1), 0, 1)[..., None]
    return float(np.min(np.hypot(*np.moveaxis(points - begin - share * along, -1, 0))))


def test_the_same_seed_records_the_same_bytes_with_all_that_is_known(tmp_path: Path) -> None:
    status, log = record(tmp_path / "a.mcap", "sim://corridor?seed=5", parse_route("scan; follow 0.8; scan"))
    record(tmp_path / "b.mcap", "sim://corridor?seed=5", parse_route("scan; follow 0.8; scan"))
    record(tmp_path / "c.mcap", "sim://corridor?seed=6", parse_route("scan; follow 0.8; scan"))
    digests = [recording_digest(tmp_path / f"{name}.mcap") for name in "abc"]
    assert digests[0] == digests[1] != digests[2]
    assert status.sweeps == 2
    assert status.readings == len(log.readings.t_ns) == log.counts["readings"]
    assert status.bad_packets == 0
    assert log.surfaces is not None
    assert log.surfaces.world == "corridor"
    assert log.truth is not None
    assert len(log.truth.t_ns) >= len(log.odometry.t_ns) - 10
    texts = [event.text for event in log.events]
    assert texts[0] == "the recording begins"
    assert texts[1] == "connected to sonarlog-sim/corridor, Pioneer amigo-sh"
    assert next(text for text in texts if text.startswith("sweep 1")) == "sweep 1 begins, turning right"
    assert texts[-1] == "the robot is stopped and closed"
    identity = open_recording(tmp_path / "a.mcap").metadata["robot"]
    assert (identity["name"], identity["serial"]) == ("sonarlog-sim/corridor", "SIM")


def test_every_reading_has_the_moment_and_the_pose_it_was_fired_at(tmp_path: Path) -> None:
    """A disc fires every 40 ms from OPEN on; the truth comes with every SIP, and turning it is linear in between."""
    _, log = record(tmp_path / "a.mcap", "sim://corridor?odometry=0", parse_route("scan"))
    assert set(np.diff(log.readings.t_ns).tolist()) == {40_000_000}
    assert log.truth is not None
    heading = np.unwrap(log.truth.pose[:, 2]) * (1 << 20) / (2 * np.pi)
    true = np.interp(log.readings.t_ns, log.truth.t_ns, heading)
    later = log.readings.t_ns > log.truth.t_ns[0]
    assert np.abs(log.readings.heading - true)[later].max() < 256  # one of the robot's own units


@pytest.mark.parametrize(
    ("world", "stations"),
    [("bend", 40), *(pytest.param(world, 38, marks=pytest.mark.slow) for world in ("corridor", "loop"))],
)
def test_without_a_route_the_robot_explores_to_the_end_and_touches_nothing(
    tmp_path: Path, world: str, stations: int
) -> None:
    status, log = record(tmp_path / "a.mcap", f"sim://{world}?seed=1", default_route(0.8, stations))
    assert clearance(log) > 0.4
    assert log.truth is not None
    end = {"corridor": (23.2, 0.0), "bend": (15.3, -7.5), "loop": (-1.0, 1.0)}[world]
    assert np.hypot(*(log.truth.pose[-1, :2] - end)) < 1.5
    assert status.sweeps >= 24
    assert world == "loop" or status.sweeps < stations


@pytest.mark.parametrize(
    ("route", "x", "heading"),
    [
        ("go 1.2", 1.2, 0),
        ("go -0.3", -0.3, 0),
        ("turn -90; go 9", 0.0, -90),  # a wall 1 m to the right
        ("turn 180; repeat 9 (go 1); go -1", 0.6, 180),  # one 0.8 m behind
        ("scan; scan", 0.0, 0),
        ("follow 6", 6.0, 0),
    ],
)
def test_steps_end_where_they_should(tmp_path: Path, route: str, x: float, heading: float) -> None:
    _, log = record(tmp_path / "a.mcap", "sim://corridor?odometry=0", parse_route(route))
    assert log.truth is not None
    assert log.truth.pose[-1, 0] == pytest.approx(x, abs=0.12)
    assert abs((np.degrees(log.truth.pose[-1, 2]) - heading + 180) % 360 - 180) < 3
    assert clearance(log) > 0.3


def test_a_scan_is_a_full_circle_left_and_right_by_turns(tmp_path: Path) -> None:
    _, log = record(tmp_path / "a.mcap", "sim://loop", parse_route("repeat 3 (scan)"))
    degrees = log.odometry.heading * 360 / (1 << 20)
    extremes = [degrees.max(), degrees.min(), degrees[-1]]
    assert extremes == pytest.approx([366.5, -6.5, 360], abs=1.6)


def test_recording_without_driving_keeps_the_motors_off_and_the_watchdog_fed(tmp_path: Path) -> None:
    status, log = record(tmp_path / "a.mcap", "sim://corridor", None, limit_ns=5 * SECOND)
    numbers = [number for number, _ in sent(tmp_path / "a.mcap")]
    assert not {Command.ENABLE, Command.VEL, Command.RVEL} & set(numbers)
    assert numbers.count(Command.PULSE) >= 9
    assert numbers[-2:] == [Command.STOP, Command.CLOSE]
    assert 110 < status.readings < 130
    assert status.t_ns >= 5 * SECOND
    assert set(log.odometry.x_um.tolist()) == {0}


def test_when_told_to_stop_the_robot_is_left_standing_and_closed(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", "sim://corridor", parse_route("go 5"), stop_after_s=4)
    assert sent(tmp_path / "a.mcap")[-3:] == [(Command.STOP, None), (Command.ENABLE, 0), (Command.CLOSE, 1)]


class Noisy:
    """A line that puts junk before every chunk and flips a byte of every 40th."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._chunks = 0
        self.waits, self.baud, self.set_baud = link.waits, link.baud, link.set_baud
        self.write, self.close, self.now_ns = link.write, link.close, link.now_ns

    def read(self, timeout_s: float) -> bytes:
        data = bytearray(self._link.read(timeout_s))
        self._chunks += bool(data)
        if data and self._chunks % 40 == 0:
            data[len(data) // 2] ^= 0x04
        return b"\xfa\xfb\x00WMS2\r" + bytes(data) if data else b""


def test_a_bad_line_is_told_and_costs_packets_but_no_recording(tmp_path: Path) -> None:
    link = Noisy(open_link("sim://corridor", time.monotonic_ns))
    status, log = record(tmp_path / "a.mcap", link, parse_route("scan"))
    assert status.sweeps == 1
    assert status.bad_packets == log.counts["bad_packets"] > 5
    assert log.counts["junk_bytes"] > 1000
    assert any(event.text.startswith("sync lost") for event in log.events)
    assert log.odometry.session.max() == 0


def test_a_robot_left_open_by_a_dead_client_is_closed_first(tmp_path: Path) -> None:
    link = open_link("sim://corridor", time.monotonic_ns)
    for command in (0, 1, 2):
        link.write(encode_command(command))
        assert link.read(1.0)
    link.write(encode_command(Command.OPEN, 1) + encode_command(Command.ENABLE, 1) + encode_command(Command.RVEL, 30))
    for _ in range(10):
        link.read(0.2)
    status, log = record(tmp_path / "a.mcap", link, parse_route("scan"))
    assert status.sweeps == 1
    assert "the robot was still open from another session: closing it first" in [e.text for e in log.events]


def test_an_unknown_type_of_robot_is_recorded_with_default_parameters(tmp_path: Path) -> None:
    strange = tmp_path / "strange.toml"
    text = (Path(__file__).parents[1] / "sonarlog" / "robots" / "amigo-sh.toml").read_text(encoding="utf-8")
    strange.write_text(text.replace('name = "amigo-sh"', 'name = "Zorg"'), encoding="utf-8")
    _, log = record(tmp_path / "a.mcap", f"sim://corridor?robot={strange}", parse_route("go 0.3"))
    assert log.robot.name == "amigo-sh"
    assert any("'Zorg' is not known: taken for amigo-sh" in event.text for event in log.events)


def test_sonars_that_are_off_are_switched_on(tmp_path: Path) -> None:
    link = open_link("sim://corridor", time.monotonic_ns)
    write = link.write

    def sabotage(data: bytes) -> None:
        write(data)
        if data == encode_command(Command.OPEN, 1):
            write(encode_command(Command.SONAR, 0))

    link.write = sabotage  # type: ignore[method-assign]
    status, log = record(tmp_path / "a.mcap", link, parse_route("go 0.3"))
    assert "the sonars are off: switching them on" in [event.text for event in log.events]
    assert status.readings > 30


def test_the_worlds_tours_can_be_driven() -> None:
    for world in ("corridor", "bend", "loop", "office", "clutter"):
        assert parse_route(load_world(world).tour)
