"""Commands: what a client says to the robot.

Must not know: which commands a session needs, and when.
"""

from enum import IntEnum
from typing import NamedTuple

from sonarlog.errors import SonarlogError
from sonarlog.protocol.framing import frame

POSITIVE, NEGATIVE, STRING = 0x3B, 0x1B, 0x2B  # the byte before an argument says its kind
MAGNITUDES = range(-32767, 65536)  # -32768 has no positive twin on the robot's 16-bit side


class BadArgument(SonarlogError):
    """An argument that the line cannot carry."""

    def __init__(self, command: int, argument: int | bytes) -> None:
        what = f"{argument}" if isinstance(argument, int) else f"{len(argument)} bytes"
        super().__init__(f"command {command} cannot carry {what}: integers from -32767 to 65535 or up to 199 bytes")


class Command(IntEnum):
    """Command numbers. 0, 1, 2 are SYNC0, SYNC1, SYNC2 until the robot is open."""

    PULSE = 0
    OPEN = 1
    CLOSE = 2
    POLLING = 3
    ENABLE = 4
    SETA = 5
    SETV = 6
    SETO = 7
    MOVE = 8
    ROTATE = 9
    SETRV = 10
    VEL = 11
    HEAD = 12
    DHEAD = 13
    SAY = 15
    CONFIG = 18
    ENCODER = 19
    RVEL = 21
    DCHEAD = 22
    SETRA = 23
    SONAR = 28
    STOP = 29
    VEL2 = 32
    ADSEL = 35
    IOREQUEST = 40
    BUMPSTALL = 44
    JOYDRIVE = 47
    SONAR_CYCLE = 48
    HOSTBAUD = 50
    E_STOP = 55
    GYRO = 58
    BATTERYINFO = 62
    SOUND = 90
    PLAYLIST = 91
    SOUNDTOG = 92
    SIM_SET_POSE = 224
    SIM_RESET = 225
    SIM_STAT = 237


SYNC0, SYNC1, SYNC2 = Command.PULSE, Command.OPEN, Command.CLOSE


class Call(NamedTuple):
    """A command as it arrived: `number` may be none of Command's; an argument of unknown form stays raw bytes."""

    number: int
    argument: int | bytes | None


def encode_command(command: int, argument: int | bytes | None = None) -> bytes:
    """The framed command: integers as magnitude with a sign type, bytes as a counted string.

    Raises BadArgument for an integer outside -32767..65535 or more than 199 bytes.
    """
    body = bytes((command,))
    if isinstance(argument, int):
        if argument not in MAGNITUDES:
            raise BadArgument(command, argument)
        body += bytes((NEGATIVE if argument < 0 else POSITIVE,)) + abs(argument).to_bytes(2, "little")
    elif argument is not None:
        if len(argument) > 199:
            raise BadArgument(command, argument)
        body += bytes((STRING, len(argument))) + argument
    return frame(body)


def parse_command(body: bytes) -> Call:
    """The command in a frame's body. Never raises; an empty body is refused by the framing before."""
    number, rest = body[0], body[1:]
    if not rest:
        return Call(number, None)
    if rest[0] in (POSITIVE, NEGATIVE) and len(rest) == 3:
        magnitude = int.from_bytes(rest[1:], "little")
        return Call(number, -magnitude if rest[0] == NEGATIVE else magnitude)
    if rest[0] == STRING and len(rest) >= 2 and len(rest) == rest[1] + 2:
        return Call(number, rest[2:])
    return Call(number, rest)


def join_wheels(left: int, right: int) -> int:
    """VEL2's argument for wheel speeds in 20 mm/s steps, -128..127: one signed word, negated as a whole when sent."""
    word = ((left & 0xFF) << 8) | (right & 0xFF)
    return word - 0x10000 if word & 0x8000 else word


def split_wheels(argument: int) -> tuple[int, int]:
    """(left, right) in 20 mm/s steps, from VEL2's argument."""
    left, right = (argument >> 8) & 0xFF, argument & 0xFF
    return left - 256 if left > 127 else left, right - 256 if right > 127 else right


def encode_set_pose(x_mm: int, y_mm: int, heading_deg: int) -> bytes:
    """SIM_SET_POSE, framed: the one command with three 32-bit integers."""
    numbers = b"".join(value.to_bytes(4, "little", signed=True) for value in (x_mm, y_mm, heading_deg))
    return frame(bytes((Command.SIM_SET_POSE, POSITIVE)) + numbers)


def parse_set_pose(argument: int | bytes | None) -> tuple[int, int, int] | None:
    """(x mm, y mm, heading °) from SIM_SET_POSE's raw argument, None if it is not one."""
    if not isinstance(argument, bytes) or len(argument) != 13:
        return None
    x, y, heading = (int.from_bytes(argument[at : at + 4], "little", signed=True) for at in (1, 5, 9))
    return x, y, heading
