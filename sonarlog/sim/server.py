"""The embedded robot on a TCP port or a pseudo terminal, living at a multiple of the given clock.

Speed changes when a byte goes out, never which. Must not know: packets, worlds, what is printed where.
"""

import os
import select
import socket
import tty
from collections.abc import Callable
from dataclasses import dataclass

from sonarlog.errors import SonarlogError
from sonarlog.sim.amigobot import AmigoBot
from sonarlog.sim.drive import TICK_NS

_CHUNK = 4096
_STRIDE_NS = 10 * TICK_NS  # a machine too slow for the speed still hears its client this often
_UNREAD = 1 << 16  # bytes a client may leave unread
Say = Callable[[str], None]


class PortBusy(SonarlogError):
    """The address cannot be listened on."""

    def __init__(self, host: str, port: int, error: OSError) -> None:
        why = (error.strerror or str(error)).split(" (while attempting")[0]
        super().__init__(f"cannot listen on {host}:{port}: {why}; name another one with --listen")


@dataclass(frozen=True)
class Pace:
    """Robot time against a monotonic clock: `speed` seconds a second."""

    clock_ns: Callable[[], int]
    speed: float

    def __post_init__(self) -> None:
        if not self.speed > 0:
            raise PaceTooFast(self.speed)


class PaceTooFast(SonarlogError):
    """A server has a client to keep pace with."""

    def __init__(self, speed: float) -> None:
        super().__init__(f"a served robot cannot live at speed {speed:g}; name one above 0, such as 10")


def serve_tcp(robot: AmigoBot, host: str, port: int, pace: Pace, say: Say) -> None:
    """One client after another, for ever; while one is served nobody listens, as at the real robot's port.

    Robot time stands still between clients. Raises PortBusy.
    """
    while True:
        with _listen(host, port) as listener:
            port = listener.getsockname()[1]
            say(f"listening on {host}:{port}")
            client, address = listener.accept()
        with client:
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            say(f"client {address[0]}:{address[1]}")
            _talk(robot, client.fileno(), pace, until_closed=True)
            robot.hang_up()


def serve_pty(robot: AmigoBot, pace: Pace, announce: Say) -> None:
    """A serial line, for ever; `announce` gets the device's path. Nobody sees a client leave: the watchdog does."""
    ours, theirs = os.openpty()
    try:
        tty.setraw(theirs)
        announce(os.ttyname(theirs))
        _talk(robot, ours, pace, until_closed=False)
    finally:
        os.close(ours)
        os.close(theirs)


def _listen(host: str, port: int) -> socket.socket:
    try:
        return socket.create_server((host, port), backlog=1)
    except OSError as error:
        raise PortBusy(host, port, error) from None


def _talk(robot: AmigoBot, line: int, pace: Pace, *, until_closed: bool) -> None:
    """Let the robot live on that descriptor; return when the client has left, or CLOSE has ended its session."""
    os.set_blocking(line, False)
    start_ns, born_ns = pace.clock_ns(), robot.now_ns
    unsent = b""
    while True:
        now_ns = born_ns + int((pace.clock_ns() - start_ns) * pace.speed)
        robot.advance(min(now_ns, robot.now_ns + _STRIDE_NS))
        unsent = _send(line, (unsent + robot.read())[-_UNREAD:])
        wait_s = max(robot.now_ns + TICK_NS - now_ns, 0) / pace.speed / 1e9
        if line in select.select([line], [], [], wait_s)[0]:
            was_open = robot.is_open
            data = _receive(line)
            robot.write(data)
            if until_closed and (not data or (was_open and not robot.is_open)):
                return


def _receive(line: int) -> bytes:
    try:
        return os.read(line, _CHUNK)
    except OSError:  # reset by the peer
        return b""


def _send(line: int, data: bytes) -> bytes:
    """What could not be sent yet."""
    try:
        return data[os.write(line, data) :] if data else data
    except BlockingIOError:
        return data
    except OSError:  # the client has left; reading will say so
        return b""
