"""The line to the robot: a serial port, a TCP socket or the embedded robot, all the same four methods.

Must not know: packets, commands, what the bytes mean. The only door to pyserial.
"""

import contextlib
import errno
import os
import select
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from sonarlog.errors import SonarlogError

CHUNK = 4096
BY_ID = Path("/dev/serial/by-id")
SETTLE_S = 0.02  # between the last byte at one baud rate and the first at another


class Link(Protocol):
    """A line to a robot. Times are the robot's: a simulator may run faster than the clock on the wall."""

    @property
    def waits(self) -> bool:
        """Whether the robot's time stands still while nobody reads: then nothing is lost by being slow."""

    def read(self, timeout_s: float) -> bytes:
        """What has come, as soon as anything has; nothing once the timeout has passed. Raises LinkLost."""

    def write(self, data: bytes) -> None:
        """Send. Raises LinkLost."""

    @property
    def baud(self) -> int | None:
        """The rate in use; None where a line has none."""

    def set_baud(self, baud: int) -> None:
        """Go on at that rate once everything is sent; for lines that have one. Raises LinkLost."""

    def close(self) -> None:
        """Let the line go; a second time does nothing."""

    def now_ns(self) -> int:
        """Nanoseconds since the line was opened, never going back."""


class PortNotOpened(SonarlogError):
    """The port cannot be opened."""

    def __init__(self, url: str, error: Exception) -> None:
        super().__init__(f"port {url}: {_why(error)}")


class LinkLost(SonarlogError):
    """The line broke while it was in use."""

    def __init__(self, url: str, error: Exception) -> None:
        super().__init__(f"port {url}: the line to the robot broke ({error})")


def _why(error: Exception) -> str:
    cause = error.__context__ if isinstance(error.__context__, OSError) else error
    number = cause.errno if isinstance(cause, OSError) else None
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return "there is no such port; is the adapter plugged in? (ls /dev/ttyUSB* /dev/serial/by-id)"
    if number in (errno.EACCES, errno.EPERM):
        return "no permission; add yourself to the group that owns it (usually dialout) and log in again"
    if number in (errno.EBUSY, errno.EAGAIN):
        return "another program has it open; end that one first"
    if number in (errno.ECONNREFUSED, errno.EHOSTUNREACH, errno.ENETUNREACH):
        return "nobody listens there, or the robot has a client already; is the robot (or `sonarlog sim`) running?"
    if isinstance(cause, TimeoutError | socket.gaierror):
        return f"no such host, or it does not answer ({cause})"
    return f"cannot be opened: {error}"


class SerialLink:
    """Any port pyserial knows: a device, `socket://host:port`, `rfc2217://…`."""

    waits = False

    def __init__(self, url: str, baud: int, clock_ns: Callable[[], int], rate: float, start_ns: int | None) -> None:
        import serial

        self._url = url
        self._rate = rate
        self._clock_ns = clock_ns
        try:
            self._port = serial.serial_for_url(url, baudrate=baud, timeout=0, write_timeout=2, do_not_open=True)
            self._port.exclusive = None if "://" in url else True
            self._port.open()
        except (serial.SerialException, ValueError, OSError) as error:
            raise PortNotOpened(url, error) from None
        self._lost = (serial.SerialException, OSError)
        with contextlib.suppress(AttributeError, ValueError, OSError):
            self._port.set_low_latency_mode(True)  # else USB adapters hand over bytes every 16 ms
        if url.startswith("socket://"):
            self._send_at_once()
        # pyserial's own read would throw away what came just before the line broke.
        self._descriptor = None
        with contextlib.suppress(AttributeError, OSError):
            self._descriptor = self._port.fileno() if os.name == "posix" else None
        self._start_ns = clock_ns() if start_ns is None else start_ns

    def _send_at_once(self) -> None:
        with socket.socket(fileno=os.dup(self._port.fileno())) as shared:
            shared.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self, timeout_s: float) -> bytes:
        """Wait for the first byte, then take what is there."""
        try:
            if self._descriptor is None:
                return self._read_by_pyserial(timeout_s / self._rate)
            if not select.select([self._descriptor], [], [], timeout_s / self._rate)[0]:
                return b""
            data = os.read(self._descriptor, CHUNK)
        except (*self._lost, ValueError) as error:  # ValueError: the descriptor is closed
            raise LinkLost(self._url, error) from None
        if not data:
            raise LinkLost(self._url, EOFError("the other end hung up"))
        return data

    def _read_by_pyserial(self, timeout_s: float) -> bytes:
        """Where there is no descriptor (RFC 2217, Windows): what came before an error is not lost with it."""
        self._port.timeout = timeout_s
        first = bytes(self._port.read(1))
        self._port.timeout = 0
        with contextlib.suppress(*self._lost):
            return first + bytes(self._port.read(CHUNK) if first else b"")
        return first

    def write(self, data: bytes) -> None:
        """Send; a line that takes nothing for 2 s is lost."""
        try:
            self._port.write(data)
        except self._lost as error:
            raise LinkLost(self._url, error) from None

    @property
    def baud(self) -> int | None:
        """A device's; TCP has none."""
        return None if "://" in self._url else int(self._port.baudrate)

    def set_baud(self, baud: int) -> None:
        """Drain, let the robot change too, change."""
        try:
            self._port.flush()
            time.sleep(SETTLE_S)
            self._port.baudrate = baud
        except self._lost as error:
            raise LinkLost(self._url, error) from None

    def close(self) -> None:
        """Close the port."""
        self._descriptor = None
        with contextlib.suppress(*self._lost):
            self._port.close()

    def now_ns(self) -> int:
        """The given clock since opening, times the rate."""
        return int((self._clock_ns() - self._start_ns) * self._rate)


def stable_name(url: str, by_id: Path = BY_ID) -> str:
    """The name of that device that stays the same when it is plugged in again, where udev gives it one."""
    if "://" in url or not by_id.is_dir():
        return url
    device = os.path.realpath(url)
    names = sorted(str(name) for name in by_id.iterdir() if os.path.realpath(name) == device)
    return names[0] if names else url


def open_link(
    url: str, clock_ns: Callable[[], int], *, rate: float = 1.0, baud: int = 9600, start_ns: int | None = None
) -> Link:
    """The line to the robot at a pyserial URL, or to the embedded robot at `sim://WORLD?seed=1&speed=10`.

    `clock_ns` is a monotonic clock; `rate` says how much faster than it the robot at the port lives (a simulator may).
    `start_ns`: what that clock said when the line was opened first, if this is not the first time.
    The embedded robot brings its own time. Raises PortNotOpened, and whatever the simulator finds wrong with its URL.
    """
    if url.startswith("sim://"):
        from sonarlog.sim.link import open_sim

        link: Link = open_sim(url)
        return link
    return SerialLink(url, baud, clock_ns, rate, start_ns)
