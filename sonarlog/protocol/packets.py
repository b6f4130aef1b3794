"""Packets: what the robot says; each class has `encode` beside `parse`, fields in the order of the wire.

Must not know: framing, units beyond the raw ones named here, what came before.
"""

import struct
from dataclasses import dataclass
from typing import ClassVar

from sonarlog.protocol.fields import Field, Value, encode_fields, field_value, parse_fields

STOPPED, MOVING = 0x32, 0x33
MOTORS, SONAR, STOP_BUTTON, E_STALL = 1 << 0, 0b1111 << 1, 1 << 5, 1 << 6  # bits of Sip.flags


@dataclass(frozen=True)
class Sync:
    """The robot's echo in the handshake; that of SYNC2 carries (name, class, subclass)."""

    number: int  # 0, 1, 2
    strings: tuple[str, ...] = ()

    def encode(self) -> bytes:
        """Body: number, NUL-terminated strings."""
        return bytes((self.number,)) + b"".join(s.encode("latin-1", "replace") + b"\0" for s in self.strings)

    @classmethod
    def parse(cls, body: bytes) -> "Sync":
        """From a body whose type is 0, 1 or 2."""
        strings = body[1:].split(b"\0")
        if strings[-1] == b"":  # what follows the last terminator
            strings.pop()
        return cls(body[0], tuple(s.decode("latin-1") for s in strings))


@dataclass(frozen=True)
class Sip:
    """The standard packet. Positions and speeds in robot units (Robot has the factors), battery in 0.1 V.

    `sonar`: the readings new since the last SIP, (disc, range in robot units), in order of firing.
    `missing`: readings announced that the packet has no room for. `tail`: the optional fields after the sonar list
    (TAIL), as many as there are; `rest`: whatever follows.
    """

    HEAD: ClassVar[struct.Struct] = struct.Struct("<BHHhhhBHhHBB")
    TAIL: ClassVar[tuple[Field, ...]] = (
        ("grip_state", "u8"),
        ("analog_port", "u8"),
        ("analog", "u8"),
        ("digital_in", "u8"),
        ("digital_out", "u8"),  # H8 AmigOS ends here
        ("battery_x10", "u16"),
        ("charge_state", "u8"),  # AmigoBot-SH ends here
        ("turn_rate", "s16"),  # 0.1°/s
        ("fault_flags", "u16"),
        ("lateral_velocity", "s16"),
        ("temperature", "s8"),
        ("state_of_charge", "s8"),  # MobileSim ends here
        ("time_us", "u32"),
        ("flags3", "u32"),
    )

    x: int = 0  # u16, of which 15 bits count
    y: int = 0
    heading: int = 0  # s16
    left: int = 0  # s16 wheel speed
    right: int = 0
    battery: int = 0  # u8
    stall_bumps: int = 0  # low byte: left wheel, rear bumpers; high byte: right wheel, front bumpers
    control: int = 0
    flags: int = 0
    compass: int = 0
    sonar: tuple[tuple[int, int], ...] = ()
    tail: tuple[Value, ...] = ()
    type: int = STOPPED
    missing: int = 0
    rest: bytes = b""

    @property
    def stalled(self) -> bool:
        """One of the wheels is stalled."""
        return bool(self.stall_bumps & 0x0101)

    def extra(self, name: str) -> int | None:
        """A field of the tail by name, None where the packet ended before it."""
        value = field_value(self.TAIL, self.tail, name)
        return value if isinstance(value, int) else None

    def encode(self) -> bytes:
        """Body."""
        head = (self.x, self.y, self.heading, self.left, self.right, self.battery, self.stall_bumps, self.control)
        count = len(self.sonar) + self.missing
        return (
            self.HEAD.pack(self.type, *head, self.flags, self.compass, count)
            + b"".join(struct.pack("<BH", disc, distance) for disc, distance in self.sonar)
            + encode_fields(self.TAIL, self.tail)
            + self.rest
        )

    @classmethod
    def parse(cls, body: bytes) -> "Sip | Malformed":
        """From a body whose type is 0x3?."""
        if len(body) < cls.HEAD.size:
            return Malformed(body)
        kind, x, y, heading, left, right, battery, bumps, control, flags, compass, count = cls.HEAD.unpack_from(body)
        held = min(count, (len(body) - cls.HEAD.size) // 3)
        end = cls.HEAD.size + 3 * held
        sonar = tuple(struct.iter_unpack("<BH", body[cls.HEAD.size : end]))
        # Where readings are missing the bytes left over are part of one, not a tail.
        tail, rest = parse_fields(cls.TAIL, body[end:]) if held == count else ((), body[end:])
        return cls(
            x, y, heading, left, right, battery, bumps, control, flags, compass, sonar, tail, kind, count - held, rest
        )


@dataclass(frozen=True)
class ConfigPacket:
    """CONFIGpac: what the robot's FLASH says; `values` in the order of LAYOUT, as many as the packet holds."""

    TYPE: ClassVar[int] = 0x20
    LAYOUT: ClassVar[tuple[Field, ...]] = (
        *(("type", "str"), ("subtype", "str"), ("serial", "str"), ("four_motors", "u8")),
        *((name, "u16") for name in ("rotveltop", "transveltop", "rotacctop", "transacctop", "pwmmax")),
        *(("name", "str"), ("sip_cycle_ms", "u8"), ("hostbaud", "u8"), ("aux1baud", "u8"), ("gripper", "u16")),
        *(("front_sonar", "u16"), ("rear_sonar", "u8"), ("low_battery", "u16"), ("rev_count", "u16")),
        *(("watchdog_ms", "u16"), ("p2mpacs", "u8")),
        *((name, "u16") for name in ("stallval", "stallcount", "joyvel", "joyrvel", "rotvelmax", "transvelmax")),
        *((name, "u16") for name in ("rotacc", "rotdecel", "rotkp", "rotkv", "rotki")),
        *((name, "u16") for name in ("transacc", "transdecel", "transkp", "transkv", "transki")),
        *((name, "u8") for name in ("front_bumps", "rear_bumps", "charger", "sonar_cycle_ms", "autobaud", "has_gyro")),
        *(("drift_factor", "s16"), ("aux2baud", "u8"), ("aux3baud", "u8"), ("ticks_mm", "u16")),
        *(("shutdown_volts", "u16"), ("version", "str"), ("gyro_cw", "u16"), ("gyro_ccw", "u16")),
        ("kinematics_delay_ms", "u8"),
        *((name, "u16") for name in ("latveltop", "latacctop", "latvelmax", "latacc", "latdecel", "charge_threshold")),
    )

    values: tuple[Value, ...]
    rest: bytes = b""

    def get(self, name: str) -> Value | None:
        """A field by name, None where the packet ended before it. Raises KeyError for an unknown name."""
        return field_value(self.LAYOUT, self.values, name)

    def encode(self) -> bytes:
        """Body."""
        return bytes((self.TYPE,)) + encode_fields(self.LAYOUT, self.values) + self.rest

    @classmethod
    def parse(cls, body: bytes) -> "ConfigPacket":
        """From a body whose type is 0x20."""
        return cls(*parse_fields(cls.LAYOUT, body[1:]))


@dataclass(frozen=True)
class SimStat:
    """A simulator's answer to SIM_STAT: where the robot really is, mm and whole degrees.

    `exact` is the embedded robot's own addition: x µm, y µm, heading in 2^-20 of a turn.
    """

    TYPE: ClassVar[int] = 0x62
    POSE: ClassVar[struct.Struct] = struct.Struct("<iiii")
    EXACT: ClassVar[struct.Struct] = struct.Struct("<iii")
    POSE_AT: ClassVar[int] = 13
    EXACT_AT: ClassVar[int] = 13 + 16

    x_mm: int
    y_mm: int
    z_mm: int
    heading_deg: int
    exact: tuple[int, int, int] | None = None
    head: bytes = bytes(12)  # the simulator's own state, which nobody here reads

    def encode(self) -> bytes:
        """Body."""
        tail = self.EXACT.pack(*self.exact) if self.exact else b""
        return bytes((self.TYPE,)) + self.head + self.POSE.pack(*self._pose) + tail

    @property
    def _pose(self) -> tuple[int, int, int, int]:
        return self.x_mm, self.y_mm, self.z_mm, self.heading_deg

    @classmethod
    def parse(cls, body: bytes) -> "SimStat | Malformed":
        """From a body whose type is 0x62."""
        if len(body) < cls.EXACT_AT:
            return Malformed(body)
        x, y, z, heading = cls.POSE.unpack_from(body, cls.POSE_AT)
        exact = None
        if len(body) >= cls.EXACT_AT + cls.EXACT.size:
            exact = cls.EXACT.unpack_from(body, cls.EXACT_AT)
        return cls(x, y, z, heading, exact, body[1 : cls.POSE_AT])


@dataclass(frozen=True)
class Reset:
    """The controller was reset (0xFF), or says the handshake is out of sequence."""

    type: int = 0xFF

    def encode(self) -> bytes:
        """Body."""
        return bytes((self.type,))


@dataclass(frozen=True)
class Unknown:
    """A packet of a type that is not read here."""

    body: bytes

    def encode(self) -> bytes:
        """Body."""
        return self.body


@dataclass(frozen=True)
class Malformed:
    """A packet of a known type, with a good checksum, that is too short to be one."""

    body: bytes

    def encode(self) -> bytes:
        """Body."""
        return self.body


Packet = Sip | Sync | ConfigPacket | SimStat | Reset | Unknown | Malformed


def parse_packet(body: bytes) -> Packet:
    """The packet in a frame's body. Never raises; an empty body is Malformed."""
    if not body:
        return Malformed(body)
    kind = body[0]
    packet: Packet
    if kind & 0xF0 == 0x30:
        packet = Sip.parse(body)
    elif kind <= 2:
        packet = Sync.parse(body)
    elif kind == ConfigPacket.TYPE:
        packet = ConfigPacket.parse(body)
    elif kind == SimStat.TYPE:
        packet = SimStat.parse(body)
    elif kind in (0xFE, 0xFF):
        packet = Reset(kind)
    else:
        packet = Unknown(body)
    return packet
