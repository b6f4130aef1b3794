"""A line that is not to be trusted: a proxy between recorder and robot that does what bad cables do, by a seed."""

import fcntl
import os
import random
import select
import socket
import sys
import termios
import threading
import time
import tty
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

FAULTS = ("flip", "drop", "junk", "split", "delay", "silence", "close", "flip commands")
RATES = {"flip": 0.03, "drop": 0.02, "junk": 0.05, "split": 0.3, "delay": 0.05, "flip commands": 0.05}


@dataclass
class Line:
    """One client while it is there: a socket or the robot's end of a pseudo terminal."""

    descriptor: int

    def close(self) -> None:
        os.close(self.descriptor)


class FaultyLine:
    """Between a robot at `socket://HOST:PORT` and a client at `self.url`; `delivered` is what the client was given.

    As a pseudo terminal it is a link in `folder` to a device that is another one each time, as USB adapters are.
    """

    def __init__(self, robot: str, seed: int, faults: tuple[str, ...], folder: Path | None = None) -> None:
        host, port = robot.removeprefix("socket://").split(":")
        self._robot = host, int(port)
        self._chance = random.Random(seed)
        self._faults = faults
        self._folder = folder
        self._listener = None if folder else socket.create_server(("127.0.0.1", 0))
        self.url = f"{folder}/usb-robot" if folder else f"socket://127.0.0.1:{self._port()}"
        self.delivered = bytearray()
        self.closes = 0
        self.mute = False
        self.failure: BaseException | None = None
        self._stop = threading.Event()
        self._unplug = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def _port(self) -> int:
        assert self._listener is not None
        return int(self._listener.getsockname()[1])

    def unplug(self) -> None:
        """Break the line now; it comes back a little later."""
        self._unplug.set()

    def __enter__(self) -> Self:
        self._thread.start()
        while self._folder and not Path(self.url).exists():
            time.sleep(0.01)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stop.set()
        self._thread.join(timeout=10)
        if self._listener:
            self._listener.close()
        assert self.failure is None, self.failure

    def _serve(self) -> None:
        try:
            while not self._stop.is_set():
                self._serve_once()
        except BaseException as error:
            self.failure = error

    def _serve_once(self) -> None:
        client = self._await_client()
        if client is None:
            return
        try:
            with self._connect() as robot:
                self._relay(client.descriptor, robot)
        finally:
            client.close()
            time.sleep(0.1)

    def _await_client(self) -> Line | None:
        if self._listener is None:
            ours, theirs = os.openpty()
            tty.setraw(theirs)
            link = Path(self.url)
            link.unlink(missing_ok=True)
            link.symlink_to(os.ttyname(theirs))
            os.set_blocking(ours, False)
            self._keep = theirs  # else reading ours fails until somebody opens theirs
            return Line(ours)
        if not select.select([self._listener], [], [], 0.1)[0]:
            return None
        client = self._listener.accept()[0]
        client.setblocking(False)
        return Line(client.detach())

    def _connect(self) -> socket.socket:
        for _ in range(100):
            with suppress(ConnectionError):
                return socket.create_connection(self._robot, timeout=2)
            time.sleep(0.05)
        raise ConnectionError("the robot does not listen")

    def _relay(self, client: int, robot: socket.socket) -> None:
        """Until one of them leaves or a fault ends it."""
        silent_until = 0.0
        end = time.monotonic() + (
            self._chance.uniform(0.5, 1.5) if "close" in self._faults and not self.closes else 1e9
        )
        try:
            while not self._stop.is_set() and not self._unplug.is_set() and time.monotonic() < end:
                ready = select.select([client, robot.fileno()], [], [], 0.02)[0]
                if robot.fileno() in ready:
                    data = robot.recv(4096)
                    if not data:
                        return
                    if "silence" in self._faults and silent_until == 0.0 and self._chance.random() < 0.02:
                        silent_until = time.monotonic() + self._chance.uniform(1.2, 2.2)
                    if time.monotonic() >= silent_until and not self.mute:
                        self._deliver(client, self._spoil(data))
                if client in ready:
                    commands = os.read(client, 4096)
                    if not commands:
                        return
                    robot.sendall(self._spoil_commands(commands))
        except OSError:
            return
        finally:
            self.closes += time.monotonic() >= end or self._unplug.is_set()
            self._unplug.clear()
            time.sleep(0.15)
            if self._folder:
                self._wait_until_read()
                os.close(self._keep)

    def _wait_until_read(self) -> None:
        """What a pseudo terminal holds when it is closed is gone, and was never delivered."""
        for _ in range(100):
            if int.from_bytes(fcntl.ioctl(self._keep, termios.FIONREAD, bytes(4)), sys.byteorder) == 0:
                return
            time.sleep(0.02)

    def _happens(self, fault: str) -> bool:
        return fault in self._faults and self._chance.random() < RATES[fault]

    def _spoil(self, data: bytes) -> bytes:
        spoilt = bytearray(data)
        if self._happens("flip"):
            spoilt[self._chance.randrange(len(spoilt))] ^= 1 << self._chance.randrange(8)
        if self._happens("drop"):
            at = self._chance.randrange(len(spoilt))
            del spoilt[at : at + self._chance.randrange(1, 20)]
        if self._happens("junk"):
            at = self._chance.randrange(len(spoilt) + 1)
            spoilt[at:at] = self._chance.randbytes(
                self._chance.randrange(1, 60)
            ) + b"\xfa\xfb" * self._chance.randrange(2)
        if self._happens("delay"):
            time.sleep(self._chance.uniform(0.02, 0.3))
        return bytes(spoilt)

    def _spoil_commands(self, data: bytes) -> bytes:
        if not self._happens("flip commands"):
            return data
        at = self._chance.randrange(len(data))
        return data[:at] + bytes((data[at] ^ 0x40,)) + data[at + 1 :]

    def _deliver(self, client: int, data: bytes) -> None:
        pieces = [data]
        if self._happens("split") and len(data) > 2:
            at = self._chance.randrange(1, len(data))
            pieces = [data[:at], data[at:]]
        for piece in pieces:
            left = piece
            while left and not self._stop.is_set():
                select.select([], [client], [], 0.1)
                with suppress(BlockingIOError):
                    count = os.write(client, left)
                    self.delivered += left[:count]
                    left = left[count:]
            if len(pieces) > 1:
                time.sleep(0.002)
