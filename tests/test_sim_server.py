"""`sonarlog sim` as other programs meet it: a TCP port, a pseudo terminal, exit codes."""

import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

import pytest

from cli.main import run
from sonarlog.protocol.commands import Command, encode_command
from sonarlog.protocol.framing import Frame, Framer
from sonarlog.protocol.packets import Packet, Sip, Sync, parse_packet


@contextmanager
def simulator(*options: str) -> Iterator[tuple[subprocess.Popen[str], IO[str], str]]:
    """The running command, what it says, and the first line of that."""
    code = "from cli.main import main; main()"
    command = [sys.executable, "-c", code, "sim", "--world", "corridor", "--speed", "20", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        try:
            yield process, process.stdout, process.stdout.readline().strip()
        finally:
            process.kill()


def connect(line: str) -> socket.socket:
    host, port = line.removeprefix("listening on ").split(":")
    return socket.create_connection((host, int(port)), timeout=5)


def talk(line: int, commands: list[tuple[int, int | None]], sips: int) -> list[Packet]:
    """Say these, then listen until so many SIPs have come."""
    framer = Framer()
    packets: list[Packet] = []
    deadline = time.monotonic() + 5
    for command, argument in commands:
        os.write(line, encode_command(command, argument))
    while sum(isinstance(packet, Sip) for packet in packets) < sips and time.monotonic() < deadline:
        if select.select([line], [], [], 0.2)[0]:
            pieces = framer.feed(os.read(line, 4096), 0)
            packets += [parse_packet(piece.body) for piece in pieces if isinstance(piece, Frame)]
    return packets


HELLO: list[tuple[int, int | None]] = [(0, None), (1, None), (2, None), (Command.OPEN, 1)]


def test_tcp_serves_one_client_after_another_and_hangs_up_at_close() -> None:
    with simulator("--listen", "127.0.0.1:0") as (process, said, line):
        for _ in range(2):
            with connect(line) as client:
                packets = talk(client.fileno(), HELLO, 5)
                assert [type(packet) for packet in packets[:4]] == [Sync, Sync, Sync, Sip]
                with pytest.raises(ConnectionRefusedError):
                    connect(line)
                client.sendall(encode_command(Command.CLOSE, 1))
                while client.recv(4096):
                    pass  # until the server ends the connection
            assert said.readline().startswith("client ")
            assert said.readline().strip() == line
        with connect(line) as client:
            talk(client.fileno(), [*HELLO, (Command.ENABLE, 1), (Command.VEL, 100)], 3)  # and is gone without CLOSE
        assert said.readline().startswith("client ")
        assert said.readline().strip() == line
        process.send_signal(signal.SIGTERM)
        assert process.wait(5) == 130


def test_pty_names_its_device_and_stays_open_like_a_serial_line() -> None:
    with simulator("--pty") as (process, _, device):
        line = os.open(device, os.O_RDWR | os.O_NOCTTY)
        assert sum(isinstance(packet, Sip) for packet in talk(line, HELLO, 3)) >= 3
        os.close(line)
        line = os.open(device, os.O_RDWR | os.O_NOCTTY)
        assert talk(line, [(0, None)], 1)  # still open: SYNC0 is a PULSE to it, and SIPs go on
        os.close(line)
        process.send_signal(signal.SIGINT)
        assert process.wait(5) == 130


def test_a_port_that_is_taken_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert run(["sim", "--world", "corridor", "--listen", f"127.0.0.1:{port}"]) == 2
    assert "cannot listen on 127.0.0.1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ([], "--list shows them"),
        (["--world", "corridoor"], "known are bend"),
        (["--world", "loop", "--listen", "8101"], "HOST:PORT"),
        (["--world", "loop", "--speed", "0"], "speed 0"),
        (["--world", "loop", "--odometry", "x"], "odometry 'x'"),
        (["--world", "loop", "--robot", "roomba"], "amigo-sh"),
    ],
)
def test_what_cannot_be_simulated_is_one_sentence(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["sim", *arguments]) == 2
    assert complaint in capsys.readouterr().err


def test_list_names_the_worlds(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["sim", "--list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == [
        "bend", "clutter", "corridor", "loop", "office",
    ]  # fmt: skip
