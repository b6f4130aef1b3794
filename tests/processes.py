"""Real processes for the tests: the command line, and the embedded robot at a port."""

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

SPEED = "40"


def start(*arguments: str, largest_file: int | None = None) -> subprocess.Popen[str]:
    """`sonarlog ARGUMENTS`; `largest_file` is the nearest to a full disk that needs no rights."""
    code = "from cli.main import main; main()"
    if largest_file is not None:
        code = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({largest_file},) * 2); {code}"
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@contextmanager
def robot(*arguments: str, speed: str = SPEED) -> Iterator[str]:
    """The embedded robot; yields the URL of its port."""
    process = start("sim", "--world", "corridor", "--speed", speed, *arguments)
    stream = process.stdout if "--pty" in arguments else process.stderr
    assert stream is not None
    try:
        line = stream.readline()
        found = re.search(r"(/dev/\S+|127\.0\.0\.1:\d+)", line)
        assert found, line + (process.stderr.read() if process.stderr else "")
        yield found[0] if found[0].startswith("/") else f"socket://{found[0]}"
    finally:
        process.terminate()
        process.communicate(timeout=10)
