"""One table of packets and one of commands drive parsing and encoding, fed whole, in pieces and among rubbish."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sonarlog.protocol.commands import (
    BadArgument,
    Command,
    encode_command,
    encode_set_pose,
    join_wheels,
    parse_command,
    parse_set_pose,
    split_wheels,
)
from sonarlog.protocol.framing import BadBody, BadFrame, Frame, Framer, Junk, Piece, checksum, frame
from sonarlog.protocol.packets import (
    ConfigPacket,
    Malformed,
    Packet,
    Reset,
    SimStat,
    Sip,
    Sync,
    Unknown,
    parse_packet,
)

CAPTURES = Path(__file__).parents[2] / "shared" / "data" / "arcos_captures"

COMMANDS: list[tuple[int, int | bytes | None, str]] = [
    (Command.PULSE, None, "fafb03000000"),
    (Command.OPEN, None, "fafb03010001"),
    (Command.CLOSE, None, "fafb03020002"),
    (Command.OPEN, 1, "fafb06013b0100023b"),
    (Command.ENABLE, 1, "fafb06043b0100053b"),
    (Command.CONFIG, 1, "fafb06123b0100133b"),
    (Command.VEL, -150, "fafb060b1b9600a11b"),
    (Command.POLLING, b"\x01\x03", "fafb07032b020103052f"),
    (200, 65535, "fafb06c83bffffc83a"),
]

PACKETS: list[tuple[Packet, str]] = [
    (Sync(0), "fafb03000000"),
    (Sync(1), "fafb03010001"),
    (
        Sync(2, ("MobileSim", "Pioneer", "amigo-sh")),
        "fafb1e024d6f62696c6553696d0050696f6e65657200616d69676f2d736800521d",
    ),
    (  # as MobileSim sent it: eight readings, tail to the state of charge
        Sip(
            battery=130,
            flags=0x1E,
            sonar=((0, 1099), (1, 5000), (2, 4619), (3, 5000), (4, 4398), (5, 2412), (6, 5000), (7, 629)),
            tail=(0, 0, 0, 255, 255, 130, 0, 0, 0, 0, -127, 0),
        ),
        "fafb3e320000000000000000000082000000001e000008004b04018813020b12038813042e11056c0906881307750200"
        "0000ffff82000000000000000081000a58",
    ),
    (  # an H8 robot, moving backwards to the right: negative numbers, two readings, the short tail
        Sip(32767, 1, -2048, -150, 31, 119, 0x0101, -1, 3, 90, ((2, 812), (5, 5000)), (1, 2, 3, 4, 5), 0x33),
        "fafb2133ff7f010000f86aff1f00770101ffff03005a02022c0305881301020304059a49",
    ),
    (Sip(), "fafb16" + "32" + "00" * 19 + "3200"),
    (Sip(missing=3, rest=b"\x07"), "fafb17" + "32" + "00" * 18 + "03" + "07" + "3204"),
    (SimStat(560, -12, 0, 90), "fafb1f62" + "00" * 12 + "30020000f4ffffff000000005a000000647d"),
    (
        SimStat(-1, 2, 0, -180, (-1234, 2345, 1 << 20)),
        "fafb2b62" + "00" * 12 + "ffffffff02000000000000004cffffff2efbffff290900000000100065b1",
    ),
    (
        ConfigPacket(("Pioneer", "amigo-sh", "SIM", 0, 300)),
        "fafb1b2050696f6e65657200616d69676f2d73680053494d00002c0168b6",
    ),
    (Reset(0xFF), "fafb03ff00ff"),
    (Reset(0xFE), "fafb03fe00fe"),
    (Unknown(bytes((0x90, 1, 2, 3))), "fafb0690010203" + "9204"),
    (Malformed(bytes((0x32, 1))), "fafb0432013201"),
]

RUBBISH = [b"", b"WMS2\r", b"\xfa", b"\xfa\xfb\x02", b"\xfa\xfb\xff\x00", b"\xfa\xfa\xfb", b"\0\xfb\xfa\xfb\3\1\0"]


def wire_bytes(pieces: list[Piece]) -> bytes:
    return b"".join(frame(p.body) if isinstance(p, Frame) else p.data for p in pieces)


def bodies(pieces: list[Piece]) -> list[bytes]:
    return [piece.body for piece in pieces if isinstance(piece, Frame)]


def cut(stream: bytes, size: int) -> list[Piece]:
    framer = Framer()
    pieces = [p for at in range(0, len(stream), size) for p in framer.feed(stream[at : at + size], at)]
    return pieces + framer.finish()


@pytest.mark.parametrize(("command", "argument", "hexadecimal"), COMMANDS)
def test_commands_both_ways(command: int, argument: int | bytes | None, hexadecimal: str) -> None:
    assert encode_command(command, argument).hex() == hexadecimal
    assert parse_command(bytes.fromhex(hexadecimal)[3:-2]) == (command, argument)


@pytest.mark.parametrize(("packet", "hexadecimal"), PACKETS)
def test_packets_both_ways(packet: Packet, hexadecimal: str) -> None:
    assert frame(packet.encode()).hex() == hexadecimal
    assert parse_packet(bytes.fromhex(hexadecimal)[3:-2]) == packet


@pytest.mark.parametrize("size", [1, 2, 7, 1 << 16])
@pytest.mark.parametrize("rubbish", RUBBISH)
def test_packets_are_found_whole_in_pieces_and_among_rubbish(rubbish: bytes, size: int) -> None:
    stream = rubbish + rubbish.join(bytes.fromhex(h) for _, h in PACKETS) + rubbish
    pieces = cut(stream, size)
    assert [parse_packet(body) for body in bodies(pieces)] == [packet for packet, _ in PACKETS]
    assert wire_bytes(pieces) == stream


def test_a_flipped_byte_costs_one_packet() -> None:
    whole = [bytes.fromhex(h) for _, h in PACKETS]
    damaged = bytearray(whole[3])
    damaged[20] ^= 0x10
    pieces = cut(b"".join([*whole[:3], bytes(damaged), *whole[4:]]), 5)
    assert [parse_packet(body) for body in bodies(pieces)] == [p for i, (p, _) in enumerate(PACKETS) if i != 3]
    assert [piece.data for piece in pieces if isinstance(piece, BadFrame)] == [bytes(damaged)]


def test_a_frame_bears_the_time_of_its_first_byte() -> None:
    framer = Framer()
    pulse = encode_command(Command.PULSE)
    assert framer.feed(b"x" + pulse[:2], 10) == [Junk(10, b"x")]
    assert framer.feed(pulse[2:4], 20) == []
    assert framer.feed(pulse[4:] + pulse, 30) == [Frame(10, b"\0"), Frame(30, b"\0")]


def test_a_head_whose_end_never_comes_does_not_hold_up_the_line() -> None:
    framer = Framer()
    assert framer.feed(b"\xfa\xfb\xf0", 0) == []
    pulse = encode_command(Command.PULSE)
    assert bodies(framer.feed(pulse, 1_000_000_000)) == []
    assert bodies(framer.feed(pulse, 2_100_000_000)) == [b"\0", b"\0"]


def test_what_no_frame_carries_is_refused() -> None:
    with pytest.raises(BadBody, match="248 bytes"):
        frame(bytes(248))
    for argument in (-32768, 65536, bytes(200)):
        with pytest.raises(BadArgument, match="command 11"):
            encode_command(Command.VEL, argument)


def test_simulator_commands_with_unusual_arguments() -> None:
    number, argument = parse_command(encode_set_pose(-1000, 2000, -90)[3:-2])
    assert (number, parse_set_pose(argument)) == (Command.SIM_SET_POSE, (-1000, 2000, -90))
    assert parse_set_pose(5) is None
    assert [split_wheels(join_wheels(*pair)) for pair in ((-1, 1), (127, -128), (0, 0))] == [
        (-1, 1),
        (127, -128),
        (0, 0),
    ]


@given(st.binary(max_size=600), st.integers(1, 40))
def test_no_bytes_raise_and_every_byte_is_accounted_for(data: bytes, size: int) -> None:
    # Heads are common in the stream, so that bad lengths and checksums are met.
    stream = data.replace(b"\x01", b"\xfa\xfb").replace(b"\x02", b"\xfa\xfb\x05")
    pieces = cut(stream, size)
    assert wire_bytes(pieces) == stream
    assert bodies(pieces) == bodies(cut(stream, 1))


@given(st.binary(min_size=1, max_size=247))
def test_any_body_parses_and_survives_the_frame(body: bytes) -> None:
    assert cut(frame(body), 3) == [Frame(0, body)]
    assert checksum(body) < 1 << 16
    parse_command(body)
    packet = parse_packet(body)
    assert parse_packet(packet.encode()) == packet


def whole(kind: str) -> st.SearchStrategy[int]:
    bits = int(kind[1:])
    return st.integers(0, (1 << bits) - 1) if kind[0] == "u" else st.integers(-(1 << bits - 1), (1 << bits - 1) - 1)


SIP_FIELDS = {
    **dict.fromkeys(("x", "y", "stall_bumps", "flags"), "u16"),
    **dict.fromkeys(("heading", "left", "right", "control"), "s16"),
    **dict.fromkeys(("battery", "compass"), "u8"),
}


@given(
    st.builds(
        Sip,
        **{name: whole(kind) for name, kind in SIP_FIELDS.items()},
        sonar=st.lists(st.tuples(whole("u8"), whole("u16")), max_size=64).map(tuple),
        tail=st.integers(0, len(Sip.TAIL)).flatmap(lambda n: st.tuples(*(whole(kind) for _, kind in Sip.TAIL[:n]))),
    )
)
def test_sips_round_trip(sip: Sip) -> None:
    assert parse_packet(sip.encode()) == sip


@pytest.mark.skipif(not CAPTURES.is_dir(), reason="the captured byte streams (../shared/data) are not here")
def test_captured_streams_decode_without_a_bad_packet() -> None:
    counts: dict[str, dict[str, int]] = {}
    for path in sorted(CAPTURES.glob("*.jsonl")):
        framers = {"rx": Framer(), "tx": Framer()}
        pieces: dict[str, list[Piece]] = {"rx": [], "tx": []}
        streams = {"rx": b"", "tx": b""}
        for line in path.read_text(encoding="utf-8").splitlines():
            entry = json.loads(line)
            if "hex" in entry:
                data = bytes.fromhex(entry["hex"])
                streams[entry["dir"]] += data
                pieces[entry["dir"]] += framers[entry["dir"]].feed(data, int(entry["t"] * 1e9))
        for way in ("rx", "tx"):
            pieces[way] += framers[way].finish()
            assert wire_bytes(pieces[way]) == streams[way]
            assert not [p for p in pieces[way] if isinstance(p, BadFrame)]
        packets = [parse_packet(body) for body in bodies(pieces["rx"])]
        assert not [p for p in packets if isinstance(p, Malformed)]
        counts[path.stem] = {"packets": len(packets), "sips": sum(isinstance(p, Sip) for p in packets)}
        junk = [p.data for way in ("rx", "tx") for p in pieces[way] if isinstance(p, Junk)]
        assert b"".join(junk) == (b"WMS2\r" if "serial" in path.stem else b"")
    assert counts["mobilesim_amigo-sh_rotate"] == {"packets": 143, "sips": 139}
