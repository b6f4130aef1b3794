"""The embedded robot's manners: session, motors, watchdog, walls, SIPs, and the same bytes every time."""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.dmath import DEGREE
from slam.sweep import TURN
from sonarlog.protocol.commands import Command, encode_command, encode_set_pose, join_wheels
from sonarlog.protocol.framing import Frame, Framer, frame
from sonarlog.protocol.packets import MOTORS, ConfigPacket, Packet, SimStat, Sip, Sync, Unknown, parse_packet
from sonarlog.sim.link import BadSimulation, Simulation, open_sim, parse_url
from sonarlog.sim.odometry import BadOdometry, Floor, OdometryErrors, draw_errors, parse_errors

MS = 1_000_000
SECOND = 1000 * MS
CAPTURES = Path(__file__).parents[2] / "shared" / "data" / "arcos_captures"


class Client:
    """Commands in, packets out, robot time by hand."""

    def __init__(self, world: str = "corridor", robot: str = "amigo-sh", *, opened: bool = True) -> None:
        self.robot = Simulation(world, odometry="0", noise=0.0, outliers=0.0, robot=robot).build()
        self.framer = Framer()
        self.pulsing = True
        if opened:
            for number in (0, 1, 2, 1):
                self.say(number)
            self.packets()

    def say(self, command: int, argument: int | bytes | None = None) -> None:
        self.robot.write(encode_command(command, argument))

    def wait(self, milliseconds: int) -> list[Packet]:
        end_ns = self.robot.now_ns + milliseconds * MS
        while self.robot.now_ns < end_ns:
            if self.pulsing:
                self.say(Command.PULSE)
            self.robot.advance(min(end_ns, self.robot.now_ns + SECOND))
        return self.packets()

    def packets(self) -> list[Packet]:
        pieces = self.framer.feed(self.robot.read(), self.robot.now_ns)
        assert all(isinstance(piece, Frame) for piece in pieces)
        return [parse_packet(piece.body) for piece in pieces if isinstance(piece, Frame)]

    def sips(self, milliseconds: int) -> list[Sip]:
        return [packet for packet in self.wait(milliseconds) if isinstance(packet, Sip)]

    def drive(self, command: int, argument: int, milliseconds: int) -> Sip:
        """The last SIP after that long under that command."""
        self.say(command, argument)
        return self.sips(milliseconds)[-1]


@pytest.fixture
def client() -> Client:
    ready = Client()
    ready.say(Command.ENABLE, 1)
    return ready


def test_handshake_echoes_names_itself_and_skips_junk() -> None:
    client = Client("loop", opened=False)
    client.robot.write(b"WMS2\r")
    client.say(Command.CLOSE)  # blind, before any SYNC: no answer
    client.say(1)
    assert client.packets() == []
    for number in (0, 0, 1, 2, 2):
        client.say(number)
    names = ("sonarlog-sim/loop", "Pioneer", "amigo-sh")
    assert client.packets() == [Sync(0), Sync(0), Sync(1), Sync(2, names), Sync(2, names)]
    client.say(Command.OPEN, 1)
    assert [type(packet) for packet in client.wait(250)] == [Sip, Sip]
    client.say(0)  # SYNC0 to an open robot is PULSE
    client.say(Command.CLOSE, 1)
    client.pulsing = False
    assert client.wait(500) == []
    assert not client.robot.is_open


def test_readings_come_two_or_three_a_sip_in_the_order_of_the_discs() -> None:
    sips = Client().sips(800)
    assert [len(sip.sonar) for sip in sips] == [2, 3, 2, 3, 2, 3, 2, 3]
    assert [disc for sip in sips for disc, _ in sip.sonar] == [n % 8 for n in range(20)]
    assert dict(sips[0].sonar)[0] == 900  # left wall at y = 1, sonar 0 at y = 0.1


def test_sonar_off_on_polling_and_cycle() -> None:
    client = Client()
    client.say(Command.SONAR, 0)
    assert {(sip.flags, sip.sonar) for sip in client.sips(300)} == {(0, ())}
    client.say(Command.SONAR, 1)
    client.say(Command.POLLING, bytes((1, 1, 8, 99)))
    assert [disc for sip in client.sips(300) for disc, _ in sip.sonar] == [0, 0, 7, 0, 0, 7, 0, 0]  # from 300 to 600 ms
    client.say(Command.POLLING, b"")
    client.say(Command.SONAR_CYCLE, 20)
    assert [sip.sonar for sip in client.sips(200)] == [(), ()]
    client.say(Command.POLLING, bytes((3,)))
    assert [len(sip.sonar) for sip in client.sips(200)] == [5, 5]


def test_both_arrays_of_a_pioneer_fire_together() -> None:
    sip = Client("corridor", "p3dx-sh").sips(100)[0]
    assert [disc for disc, _ in sip.sonar] == [0, 8, 1, 9]
    assert sip.flags == 0b110


def test_motors_are_off_at_first_and_after_close() -> None:
    client = Client()
    assert client.drive(Command.VEL, 300, 500).x == 0
    client.say(Command.ENABLE, 1)
    sip = client.drive(Command.VEL, 300, 500)
    assert sip.x > 0
    assert sip.flags & MOTORS
    assert sip.type == 0x33
    for number in (Command.CLOSE, 0, 1, 2, 1):
        client.say(number)
    sip = client.sips(100)[0]
    assert (sip.x, sip.flags & MOTORS, sip.type) == (0, 0, 0x32)


@pytest.mark.parametrize(
    ("command", "argument", "milliseconds", "expected"),
    [
        (Command.MOVE, 800, 6000, (800, 0, 0)),
        (Command.MOVE, -300, 6000, (32768 - 300, 0, 0)),
        (Command.DHEAD, 90, 6000, (0, 0, 1024)),
        (Command.HEAD, -170, 6000, (0, 0, -1934)),
        (Command.HEAD, 270, 6000, (0, 0, -1024)),
        (Command.RVEL, 12, 2000, (0, 0, 265)),  # 12°/s after 0.12 s of speeding up
        (Command.ROTATE, -12, 2000, (0, 0, -265)),
        (Command.VEL2, join_wheels(-1, 1), 2000, (0, 0, 278)),  # 40 mm/s apart: 12.6°/s
        (Command.VEL2, join_wheels(10, 10), 2000, (334, 0, 0)),
    ],
)
def test_motion_commands(
    client: Client, command: int, argument: int, milliseconds: int, expected: tuple[int, int, int]
) -> None:
    sip = client.drive(command, argument, milliseconds)
    assert (sip.x, sip.y, sip.heading) == pytest.approx(expected, abs=2)


def test_resetting_odometry_does_not_turn_the_robot_again(client: Client) -> None:
    assert client.drive(Command.DHEAD, 90, 4000).heading == 1024
    client.say(Command.SETO)
    assert client.sips(2000)[-1].heading == 0
    assert client.drive(Command.HEAD, 10, 2000).heading == 114


def test_speeds_are_limited_and_reported_per_wheel(client: Client) -> None:
    client.say(Command.SETA, 1000)
    client.say(Command.SETV, 500)
    assert (client.drive(Command.VEL, 900, 1000).left, client.drive(Command.VEL, 900, 100).right) == (500, 500)
    client.say(Command.VEL, 0)
    client.say(Command.SETRV, 20)
    sip = client.drive(Command.RVEL, 100, 3000)
    assert (sip.left, sip.right, sip.extra("turn_rate")) == (-32, 32, 200)
    client.say(Command.E_STOP)
    assert client.sips(200)[-1].type == 0x32


def test_the_watchdog_stops_the_robot_and_a_mere_pulse_resumes_the_old_goal(client: Client) -> None:
    client.pulsing = False
    client.drive(Command.VEL, 200, 2000)
    stopped = client.sips(2000)[-1]
    assert stopped.type == 0x32
    assert stopped.flags & MOTORS
    assert client.sips(1000)[-1].x == stopped.x
    client.say(Command.PULSE)
    assert client.sips(1500)[-1].x > stopped.x + 150


def test_walls_stop_the_robot_and_say_stall(client: Client) -> None:
    client.robot.write(encode_set_pose(23000, 0, 0))
    sip = client.drive(Command.VEL, 500, 5000)
    assert sip.stalled
    assert client.robot.true_pose[0] == pytest.approx((24.2 - 0.18) * 1e6, abs=5000)
    assert sip.x == pytest.approx(1020, abs=5)  # the wheels stand still, too
    sip = client.drive(Command.VEL, -200, 2000)
    assert not sip.stalled
    assert client.robot.true_pose[0] < 23.8e6


def test_x_wraps_at_15_bits_and_heading_at_half_a_turn(client: Client) -> None:
    client.drive(Command.MOVE, -100, 3000)
    assert client.sips(100)[0].x == 32768 - 100
    client.say(Command.SETRV, 100)
    headings = [sip.heading for sip in [client.drive(Command.RVEL, 90, 100) for _ in range(40)]]
    assert min(headings) < -1900
    assert max(headings) > 1900
    assert all(-2048 <= heading < 2048 for heading in headings)


def test_truth_is_exact_and_goes_with_every_sip_if_asked(client: Client) -> None:
    client.robot.write(encode_set_pose(5000, -300, 90))
    client.say(Command.SIM_STAT, 1)
    sip, stat = client.wait(100)
    assert isinstance(sip, Sip)
    assert stat == SimStat(5000, -300, 0, 90, (5_000_000, -300_000, TURN // 4))
    assert len(client.wait(100)) == 1
    client.say(Command.SIM_STAT, 2)
    assert [type(packet) for packet in client.wait(200)] == [Sip, SimStat] * 2
    client.say(Command.SIM_RESET)
    stats = [packet for packet in client.wait(100) if isinstance(packet, SimStat)]
    assert stats[0].exact == (0, 0, 0)


def test_other_packets_on_request(client: Client) -> None:
    client.say(Command.CONFIG)
    client.say(Command.ENCODER, 1)
    client.say(Command.IOREQUEST, 1)
    client.say(Command.SAY, b"la")
    client.say(250, 3)
    config, _, encoders, digital = client.wait(100)
    assert isinstance(config, ConfigPacket)
    assert (config.get("subtype"), config.get("watchdog_ms"), config.get("sip_cycle_ms")) == ("amigo-sh", 2000, 100)
    assert encoders == Unknown(bytes((0x90, *(8 * [0]))))
    assert isinstance(digital, Unknown)
    assert digital.body[0] == 0xF0


def short_session(url: str, clock: Iterator[int]) -> bytes:
    """Handshake, a turn, a drive, all bytes received; some reads are short, some long."""
    link = open_sim(url, clock_ns=lambda: next(clock), sleep=lambda _: None)
    data = b""
    for number in (0, 1, 2, 1):
        link.write(encode_command(number))
        data += link.read(0.01)
    for command, argument in ((Command.ENABLE, 1), (Command.SIM_STAT, 2), (Command.RVEL, 12), (Command.VEL, 150)):
        link.write(encode_command(command, argument))
        end_ns = link.now_ns() + 5 * SECOND
        while link.now_ns() < end_ns:
            data += link.read(0.35)
            link.write(encode_command(Command.PULSE))
    return data


def test_same_seed_same_bytes_at_any_speed() -> None:
    first = short_session("sim://clutter?seed=7", iter(range(10**9)))
    assert first == short_session("sim://clutter?seed=7&speed=3", iter(range(0, 10**12, 77_777)))
    assert first != short_session("sim://clutter?seed=8", iter(range(10**9)))


def test_golden_bytes() -> None:
    """Equal on every machine; a change of these bytes is a change of the simulator, to be shown and blessed."""
    digest = hashlib.blake2b(short_session("sim://clutter?seed=7", iter(range(10**9))), digest_size=16).hexdigest()
    assert digest == "44fc85e1d86c258bf03a06adc686e00e"


@given(st.lists(st.tuples(st.integers(0, 255), st.none() | st.integers(-32767, 65535) | st.binary(max_size=14))))
@settings(max_examples=60, deadline=None)
def test_no_command_breaks_it(calls: list[tuple[int, int | bytes | None]]) -> None:
    client = Client("clutter")
    client.say(Command.ENABLE, 1)
    for number, argument in calls:
        client.say(number, argument)
        client.robot.write(b"\xfa" + frame(bytes((number,)) + (argument if isinstance(argument, bytes) else b"")))
        client.robot.advance(client.robot.now_ns + 200 * MS)
    client.packets()  # every frame is whole


def test_odometry_errors_are_what_they_say() -> None:
    floor = Floor(OdometryErrors(rotation=1.01, distance=0.98, drift=0.5), seed=1)
    assert floor.true_motion(0.0, 1.01) == pytest.approx((0.0, 1.0))
    assert floor.true_motion(0.98, 0.0) == pytest.approx((1.0, -0.49 * DEGREE))
    slippery = Floor(OdometryErrors(slip=1.0), seed=2)
    lost = [sum(slippery.true_motion(0.01, 0.0)[1] for _ in range(100)) for _ in range(400)]
    assert (sum(turn * turn for turn in lost) / 400) ** 0.5 == pytest.approx(1.0 * DEGREE, rel=0.1)  # over 1 m


def test_odometry_texts() -> None:
    assert parse_errors("0", 5) == OdometryErrors()
    assert parse_errors("1", 5) == draw_errors(5) != draw_errors(6)
    assert parse_errors("rotation=1.01, drift=-0.3", 5) == OdometryErrors(rotation=1.01, drift=-0.3)
    for text in ("", "x", "-1", "nan", "11", "wheel=1", "drift=", "drift=nan", "rotation=3", "a=b=c"):
        with pytest.raises(BadOdometry, match="known are"):
            parse_errors(text, 5)


@pytest.mark.parametrize(
    ("url", "complaint"),
    [
        ("sim://corridor?sped=3", "no 'sped'; known are seed, speed, odometry, noise, outliers, robot, mounting"),
        ("sim://corridor?seed=one", "seed cannot be 'one'"),
        ("sim://corridor?noise=-1", "noise cannot be -1; it goes from 0 to 1000"),
        ("sim://corridor?speed=nan", "speed cannot be nan"),
        ("sim://corridor?mounting=30", "mounting cannot be 30; it goes from 0 to 20"),
    ],
)
def test_bad_urls(url: str, complaint: str) -> None:
    with pytest.raises(BadSimulation, match=complaint):
        open_sim(url)


def test_url() -> None:
    url = "sim:///home/me/my%20world.toml?seed=3&speed=2&odometry=drift=0.3,slip=0&robot=amigo"
    expected = Simulation("/home/me/my world.toml", seed=3, speed=2.0, odometry="drift=0.3,slip=0", robot="amigo")
    assert parse_url(url) == expected


def captured(name: str) -> list[dict[str, object]]:
    path = CAPTURES / name
    if not path.exists():
        pytest.skip(f"no captures of real peers at {CAPTURES}")
    return [json.loads(line) for line in path.read_text().splitlines()]


def packets_of(data: bytes) -> list[Packet]:
    return [parse_packet(piece.body) for piece in Framer().feed(data, 0) if isinstance(piece, Frame)]


@pytest.mark.parametrize(
    "name",
    [
        "ariacoda_demo_tcp.jsonl",
        "ariacoda_simpleconnect_tcp.jsonl",
        "ariacoda_simpleconnect_serial.jsonl",
        "mobilesim_amigo-sh_rotate.jsonl",
    ],
)
def test_a_real_clients_bytes_get_answers_of_the_form_the_real_simulator_gave(name: str) -> None:
    """Everything the client sent, at its own times; only names, poses and readings may differ from what it got then."""
    robot = Simulation("office", odometry="0").build()
    ours = b""
    for line in captured(name):
        if line.get("dir") == "tx":
            robot.advance(int(float(str(line["t"])) * SECOND))
            ours += robot.read()
            robot.write(bytes.fromhex(str(line["hex"])))
    theirs = packets_of(b"".join(bytes.fromhex(str(x["hex"])) for x in captured(name) if x.get("dir") == "rx"))
    mine = packets_of(ours)

    my_syncs, their_syncs = ([p for p in packets if isinstance(p, Sync)] for packets in (mine, theirs))
    assert [sync.number for sync in my_syncs] == [sync.number for sync in their_syncs] == [0, 1, 2]
    assert my_syncs[-1].strings[1:] == their_syncs[-1].strings[1:] == ("Pioneer", "amigo-sh")
    my_config, their_config = (next(p for p in ps if isinstance(p, ConfigPacket)) for ps in (mine, theirs))
    assert len(my_config.values) == len(their_config.values) == len(ConfigPacket.LAYOUT)
    for field in ("type", "subtype", "serial", "sip_cycle_ms", "watchdog_ms", "autobaud", "version", "rotvelmax"):
        assert my_config.get(field) == their_config.get(field)
    my_sips, their_sips = ([p for p in ps if isinstance(p, Sip)] for ps in (mine, theirs))
    assert len(my_sips) == pytest.approx(len(their_sips), abs=3)
    assert {len(sip.tail) for sip in my_sips} == {len(sip.tail) for sip in their_sips} == {12}
    assert my_sips[-1].heading == pytest.approx(their_sips[-1].heading, abs=60)  # degrees in its case, and no ramps
    assert not robot.is_open
