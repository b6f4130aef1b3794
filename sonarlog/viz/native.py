"""Starting Rerun's native viewer as a process of its own, listening on this machine only.

Rerun's own `spawn` binds every interface, needs `rerun` on PATH and succeeds without a display. Must not know: what is
shown.
"""

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from sonarlog.errors import SonarlogError

START_S = 20.0
SETTLE_S, SETTLE_TIMES = 0.8, 10.0
"""A viewer listens before it looks for a screen and graphics; one that finds none is gone within this time, or, where
loading it takes long, within so many times what it took to listen."""

INSTEAD = "save with --viz FILE.rrd and open that elsewhere with `rerun FILE.rrd`"


class NoViewer(SonarlogError):
    """The viewer cannot be opened here."""


@dataclass(frozen=True)
class Viewer:
    """A running viewer: where to send to, and its process."""

    url: str
    process: "subprocess.Popen[bytes]"


def require_display(environment: Mapping[str, str] = os.environ, platform: str = sys.platform) -> None:
    """Raise NoViewer on a machine without a screen to open a window on."""
    if platform == "linux" and not (environment.get("DISPLAY") or environment.get("WAYLAND_DISPLAY")):
        raise NoViewer(f"there is no display to open the viewer on; {INSTEAD}")


def start_viewer(*, headless: bool = False) -> Viewer:
    """Start a viewer and wait until it listens; it outlives this process unless headless. Raises NoViewer."""
    if not headless:
        require_display()
    port = _free_port()
    command = [str(_binary()), "--bind", "127.0.0.1", "--port", str(port), "--hide-welcome-screen"]
    command += ["--headless"] if headless else ["--expect-data-soon"]
    with tempfile.TemporaryFile() as said:
        try:
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=said,
                start_new_session=not headless,
                # CI: the viewer's only switch against usage data that is not the user's own settings file.
                env={**os.environ, "CI": "true", "RERUN_APP_ONLY": "true"},
            )
        except OSError as error:
            raise NoViewer(f"the viewer does not start: {error.strerror}; {INSTEAD}") from None
        if not _listens(port, process):
            process.kill()
            process.wait()
            said.seek(0)
            raise NoViewer(f"the viewer does not start ({_reason(said.read())}); {INSTEAD}")
    return Viewer(f"rerun+http://127.0.0.1:{port}/proxy", process)


def _binary() -> Path:
    """The viewer itself: killing the `rerun` script in front of it would orphan it."""
    spec = find_spec("rerun_cli")
    folder = Path(next(iter(spec.submodule_search_locations))) if spec and spec.submodule_search_locations else Path()
    candidates = ("Rerun.app/Contents/MacOS/Rerun", "rerun.exe", "rerun")
    for candidate in candidates:
        if (folder / candidate).is_file():
            return folder / candidate
    raise NoViewer("Rerun's viewer is not installed beside its SDK; reinstall the package rerun-sdk")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _listens(port: int, process: "subprocess.Popen[bytes]") -> bool:
    begin = time.monotonic()
    while time.monotonic() < begin + START_S and process.poll() is None:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return _stays(process, max(SETTLE_S, SETTLE_TIMES * (time.monotonic() - begin)))
        time.sleep(0.05)
    return False


def _stays(process: "subprocess.Popen[bytes]", seconds: float) -> bool:
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return True
    return False


def _reason(said: bytes) -> str:
    """What a viewer that gave up said of it: its error or panic, else its last line."""
    lines = said.decode(errors="replace").strip().splitlines() or ["it says nothing"]
    telling = [line for line in lines if line.startswith("Error:") or " panicked at " in line]
    return (telling or lines[-1:])[0].rpartition(" panicked at ")[2].rpartition(": ")[2].strip(" '")
