"""Decoding: wraps, moments and poses of readings, sessions, and what is left out is counted."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.sweep import TURN
from sonarlog.decode import Pose, Sample, WireDecoder, decode_wire, firing_age_ms
from sonarlog.protocol.framing import frame
from sonarlog.protocol.packets import Packet, Reset, SimStat, Sip, Sync, Unknown
from sonarlog.robot import load_robot

CAPTURES = Path(__file__).parents[2] / "shared" / "data" / "arcos_captures"
ROBOT = load_robot("amigo-sh")
MS = 1_000_000


def decode(*packets: tuple[int, Packet]) -> list[Sample]:
    decoder = WireDecoder(ROBOT)
    return [s for t_ms, packet in packets for s in decoder.feed(t_ms * MS, frame(packet.encode()))]


def poses(samples: list[Sample]) -> list[Pose]:
    return [sample.pose for sample in samples if sample.pose is not None]


@pytest.mark.parametrize("wrap", [1 << 15, 1 << 16])
def test_odometry_goes_on_over_both_kinds_of_wrap_and_both_seams_of_heading(wrap: int) -> None:
    raw = [(wrap - 60, 100, 2000), (wrap - 10, 10, 2040), (40, wrap - 80, -2016), (90, wrap - 170, -1976)]
    samples = decode(*((100 * i, Sip(x, y, th)) for i, (x, y, th) in enumerate([(*raw[0][:2], 0), *raw])))
    assert poses(samples)[1:] == [Pose(50_000 * i, -90_000 * i, (2000 + 40 * i) * 256) for i in range(4)]
    raw.reverse()
    backwards = decode(*((100 * i, Sip(x, y, th)) for i, (x, y, th) in enumerate([(*raw[0][:2], 0), *raw])))
    assert poses(backwards)[1:] == [Pose(-50_000 * i, 90_000 * i, (-1976 - 40 * i) * 256) for i in range(4)]


def test_after_a_reset_the_robot_goes_on_the_way_it_looks() -> None:
    """Its odometry begins at zero with axes of its own: ahead is x again."""
    turned, ahead = Sip(1000, 0, 1024), Sip(200, 100, 512)
    found = poses(decode((0, Sip()), (3000, turned), (3100, Reset()), (3500, Sip()), (4500, ahead)))
    assert found[1:] == [Pose(1_000_000, 0, TURN // 4)] * 2 + [Pose(900_000, 200_000, TURN // 8 * 3)]


def test_a_robot_that_falls_silent_on_the_way_is_taken_to_go_on_for_a_while() -> None:
    """Until its watchdog stops it; one that stands, or was reset, stays where it was."""
    driving = [(100 * k, Sip(30 * k)) for k in range(3)]
    back = (8000, Sip(60))
    assert poses(decode(*driving, back))[-1] == Pose(60_000 + 15 * 30_000, 0, 0)
    assert poses(decode(*driving, (300, Sip(60)), back))[-1] == Pose(60_000, 0, 0)
    assert poses(decode(*driving, (250, Reset()), (700, Sip())))[-1] == Pose(60_000, 0, 0)


def test_factors_are_applied_to_the_sum_so_that_rounding_does_not_add_up() -> None:
    decoder = WireDecoder(load_robot("amigo"))
    for step in range(1001):
        sample = decoder.feed(step * 100 * MS, frame(Sip(x=step).encode()))[0]
    assert sample.pose == Pose(508_300, 0, 0)


@pytest.mark.parametrize(
    ("count", "ages"),
    [(1, [20]), (2, [60, 20]), (3, [80, 40, 0]), (4, [0] * 4), (8, [0] * 8)],
)
def test_readings_are_fired_before_their_sip(count: int, ages: list[int]) -> None:
    assert [firing_age_ms(index, count, ROBOT) for index in range(count)] == ages


def test_two_arrays_fire_two_readings_at_a_time() -> None:
    pioneer = load_robot("p3dx-sh")
    assert [firing_age_ms(index, 6, pioneer) for index in range(6)] == [80, 80, 40, 40, 0, 0]
    assert [firing_age_ms(index, 4, pioneer) for index in range(4)] == [60, 60, 20, 20]


def test_readings_get_the_pose_of_their_own_moment_whatever_the_stamps_do() -> None:
    first, second = Sip(heading=0), Sip(heading=50, sonar=((0, 1000), (4, 5000)))
    for late_ms in (100, 60, 140, 0):
        sample = decode((0, first), (late_ms, second))[1]
        assert [r.pose.heading for r in sample.readings] == [20 * 256, 40 * 256]
        assert [r.t_ns for r in sample.readings] == [(late_ms - 60) * MS, (late_ms - 20) * MS]
        assert [(r.sonar, r.range_mm) for r in sample.readings] == [(0, 1000), (4, 5000)]
    lost_one = decode((0, first), (205, Sip(heading=100, sonar=second.sonar)))[1]
    assert [r.pose.heading for r in lost_one.readings] == [70 * 256, 90 * 256]
    alone = decode((0, second))[0]
    assert [r.pose for r in alone.readings] == [Pose(0, 0, 0)] * 2


def test_sips_held_up_and_delivered_together_are_a_cycle_apart() -> None:
    held_up = b"".join(frame(Sip(heading=10 * i, sonar=((0, 900), (4, 900))).encode()) for i in (1, 2, 3))
    log = decode_wire([(0, "rx", frame(Sip().encode())), (300 * MS, "rx", held_up)], ROBOT)
    assert log.readings.heading.tolist() == [256 * units for units in (4, 8, 14, 18, 24, 28)]
    assert [t // MS for t in log.readings.t_ns.tolist()] == [40, 80, 140, 180, 240, 280]


def test_a_reset_a_long_gap_and_a_jump_start_sessions_and_are_never_bridged() -> None:
    samples = decode(
        (0, Sip(x=1000)),
        (100, Sip(x=1050)),
        (150, Reset()),
        (200, Sip(x=0, sonar=((1, 700), (2, 800)))),
        (300, Sip(x=20)),
        (1500, Sip(x=60)),  # a gap that odometry bridges
        (1600, Sip(x=9000)),  # 9 m in 0.1 s
        (9000, Sip(x=9100)),  # longer than anyone may trust
        (9100, Sync(2, ("again", "Pioneer", "amigo-sh"))),
        (9200, Sip(x=0)),
    )
    sips = [s for s in samples if isinstance(s.packet, Sip)]
    assert [s.session for s in sips] == [0, 0, 1, 1, 1, 2, 3, 4]
    assert [s.pose.x_um // 1000 for s in sips if s.pose] == [0, 50, 50, 70, 110, 110, 110, 110]
    assert {r.pose.x_um for r in sips[2].readings} == {50_000}
    assert [s.note for s in samples if s.note] == [
        "the robot's controller was reset: odometry starts anew",
        "no SIP for 1.2 s",
        "odometry jumped by 8.94 m: it starts anew",
        "no SIP for 7.4 s: odometry starts anew",
    ]


def test_what_is_left_out_is_counted_by_name() -> None:
    damaged = bytearray(frame(Sip(x=5).encode()))
    damaged[6] ^= 1
    stream = b"WMS2\r" + frame(Sip(sonar=((3, 900), (9, 900)), missing=2).encode()) + bytes(damaged)
    stream += frame(Unknown(b"\x90abc").encode()) + frame(b"\x32\x01")
    log = decode_wire([(0, "rx", stream), (0, "tx", b"never decoded")], ROBOT)
    assert log.counts == {
        "packets": 3,
        "sips": 1,
        "readings": 1,
        "bad_discs": 1,
        "missing_readings": 2,
        "bad_packets": 1,
        "bad_packet_bytes": len(damaged),
        "junk_bytes": 5,
        "unknown_packets": 1,
        "malformed_packets": 1,
    }


def test_a_log_holds_odometry_readings_and_truth_as_columns() -> None:
    exact = SimStat(1, 2, 0, 90, (1234, -5, TURN // 2))
    packets: list[Packet] = [Sip(), Sip(x=100, heading=1024, sonar=((0, 700), (1, 800))), exact, SimStat(500, 0, 0, 90)]
    log = decode_wire([(i * 100 * MS, "rx", frame(p.encode())) for i, p in enumerate(packets)], ROBOT)
    assert log.odometry.x_um.tolist() == [0, 100_000]
    assert log.odometry.heading.tolist() == [0, TURN // 4]
    assert log.readings.x_um.tolist() == [40_000, 80_000]
    assert log.readings.t_ns.tolist() == [40 * MS, 80 * MS]
    assert log.truth is not None
    assert log.truth.t_ns.tolist() == [200 * MS, 300 * MS]
    np.testing.assert_allclose(log.truth.pose, [[0.001234, -5e-6, np.pi], [0.5, 0, np.pi / 2]])
    empty = decode_wire([], ROBOT)
    assert (len(empty.odometry.t_ns), len(empty.readings.sonar), empty.truth) == (0, 0, None)


@given(st.lists(st.binary(min_size=1, max_size=250)), st.integers(1, 50))
def test_no_bytes_raise_and_pieces_do_not_matter(bodies: list[bytes], size: int) -> None:
    stream = b"".join(frame(b"\x32" + body[:200]) + body[200:] for body in bodies)
    whole = decode_wire([(0, "rx", stream)], ROBOT)
    cut = decode_wire([(0, "rx", stream[at : at + size]) for at in range(0, len(stream), size)], ROBOT)
    assert whole.odometry.x_um.tolist() == cut.odometry.x_um.tolist()
    assert whole.readings.heading.tolist() == cut.readings.heading.tolist()


@pytest.mark.skipif(not CAPTURES.is_dir(), reason="the captured byte streams (../shared/data) are not here")
def test_a_captured_turn_of_a_real_simulator() -> None:
    lines = (CAPTURES / "mobilesim_amigo-sh_rotate.jsonl").read_text(encoding="utf-8").splitlines()
    entries = [json.loads(line) for line in lines]
    messages = [(int(e["t"] * 1e9), e["dir"], bytes.fromhex(e["hex"])) for e in entries if "hex" in e]
    log = decode_wire(messages, ROBOT)
    assert len(log.odometry.t_ns) == 139
    assert len(log.readings.t_ns) == 139 * 8
    assert 0.6 < log.odometry.heading[-1] / TURN < 0.7  # 12 s of it at 20°/s
    assert set(log.odometry.session.tolist()) == {0}
