"""Replaying with the code of another git revision: its files in a folder, a process of their own, no installation."""

import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from sonarlog.errors import SonarlogError

HOME = Path(__file__).resolve().parent.parent
START = "from cli.main import main; main()"


class NoSuchCode(SonarlogError):
    """The revision cannot be had, or it cannot replay this."""


@contextmanager
def code_of(revision: str) -> Iterator[Path]:
    """A folder with the files of that revision; it goes when the block ends. Raises NoSuchCode."""
    command = ["git", "-C", str(HOME), "archive", "--format=tar", f"{revision}^{{commit}}"]
    try:
        made = subprocess.run(command, capture_output=True, check=True, timeout=60)
    except OSError as error:
        raise NoSuchCode(f"cannot run git: {error.strerror or error}") from None
    except subprocess.CalledProcessError as error:
        said = error.stderr.decode(errors="replace").strip().splitlines()
        raise NoSuchCode(f"no code of revision {revision!r}: {said[-1] if said else 'git refuses'}") from None
    with tempfile.TemporaryDirectory(prefix="sonarlog-code-") as folder:
        with tarfile.open(fileobj=io.BytesIO(made.stdout)) as archive:
            archive.extractall(folder, filter="data")
        yield Path(folder)


def replay_with(code: Path, recording: Path, algorithm: str, settings: Mapping[str, object], output: Path) -> list[str]:
    """Replay with the code in that folder; the settings that it does not know, which it went without.

    Raises NoSuchCode with what it said, if it could not.
    """
    known = json.loads(_run(code, ["algorithms", algorithm, "--json"]))[algorithm]["config"]
    sheet = output.with_suffix(".toml")
    lines = (f"{name} = {_toml(value)}\n" for name, value in settings.items() if name in known)
    sheet.write_text("".join(lines), encoding="utf-8")
    words = ["replay", str(recording.resolve()), "--algorithm", algorithm, "--config", str(sheet), "-o", str(output)]
    _run(code, words)
    return [name for name in settings if name not in known]


def _run(code: Path, words: list[str]) -> str:
    """What that code's `sonarlog` says on stdout."""
    environment = {**os.environ, "PYTHONPATH": str(code), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", START, *words]
    made = subprocess.run(command, cwd=code, env=environment, capture_output=True, text=True, check=False)
    if made.returncode != 0:
        said = made.stderr.strip().splitlines()
        raise NoSuchCode(f"that revision's `sonarlog {words[0]}` fails: {said[-1] if said else 'it says nothing'}")
    return made.stdout


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else repr(value)
