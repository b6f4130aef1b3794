"""Code of another git revision: what it is, its files in a folder, and replaying with them in a process of their own.

Nothing is installed: the files stand first on that process's path. Must not know: what its runs are compared with.
"""

import hashlib
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
PACKAGES = ("slam", "sonarlog")
"""What decides a run: the command line does not."""
WORKTREE = "WORKTREE"
"""The name of the files as they are now, committed or not."""
START = "from cli.main import main; main()"


class NoSuchCode(SonarlogError):
    """The revision cannot be had, or it cannot replay this."""


def repository() -> Path:
    """The checkout that revisions are looked for in: the one around the current folder, else this program's own.

    A checkout that does not hold this program says nothing of the algorithm.
    """
    here = Path.cwd()
    for folder in (here, *here.parents):
        if (folder / ".git").exists():
            return folder if (folder / "slam").is_dir() and (folder / "cli").is_dir() else HOME
    return HOME


def code_key(folder: Path = HOME) -> str:
    """Hex digest of the code in a folder: the same for the same files, wherever they lie, committed or not."""
    paths = [path for package in PACKAGES for path in (folder / package).rglob("*.py")]
    return _key({path.relative_to(folder).as_posix(): _blob(path.read_bytes()) for path in paths})


def key_of(revision: str, repository: Path) -> str:
    """The same of a revision's code. Raises NoSuchCode, also for a revision that has no slam/."""
    if revision == WORKTREE:
        _check_slam((repository / "slam").is_dir(), revision)
        return code_key(repository)
    listed = git(repository, revision, "ls-tree", "-r", "-z", f"{revision}^{{commit}}", "--", *PACKAGES)
    entries = (line.partition(b"\t") for line in listed.split(b"\0") if line.endswith(b".py"))
    blobs = {name.decode(): head.split()[2].decode() for head, _, name in entries}
    _check_slam(any(name.startswith("slam/") for name in blobs), revision)
    return _key(blobs)


def _check_slam(there: bool, revision: str) -> None:
    if not there:
        raise NoSuchCode(f"revision {revision!r} has no slam/: there is no algorithm in it to replay with")


def _key(blobs: Mapping[str, str]) -> str:
    listed = json.dumps(sorted(blobs.items()))
    return hashlib.blake2b(listed.encode(), digest_size=16).hexdigest()


def _blob(data: bytes) -> str:
    """The name that git gives a file's contents."""
    return hashlib.sha1(b"blob %d\0" % len(data) + data, usedforsecurity=False).hexdigest()


def git(repository: Path, revision: str, *arguments: str) -> bytes:
    """What git says on stdout. Raises NoSuchCode that names the revision."""
    command = ["git", "-C", str(repository), *arguments]
    try:
        return subprocess.run(command, capture_output=True, check=True, timeout=60).stdout
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NoSuchCode(f"cannot run git: {getattr(error, 'strerror', None) or error}") from None
    except subprocess.CalledProcessError as error:
        said = error.stderr.decode(errors="replace").strip().splitlines()
        raise NoSuchCode(f"no code of revision {revision!r}: {said[-1] if said else 'git refuses'}") from None


def revisions(good: str, bad: str, repository: Path) -> list[str]:
    """The commits after `good` up to `bad` that change the code, oldest first, along first parents.

    Raises NoSuchCode.
    """
    asked = f"{good}..{bad}"
    for name in (good, bad):
        git(repository, name, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{name}^{{commit}}")
    listed = git(repository, asked, "rev-list", "--first-parent", "--reverse", asked, "--", *PACKAGES)
    return listed.decode().split()


def subject(revision: str, repository: Path) -> str:
    """`781ad21 2026-11-22 The first line of its message`. Raises NoSuchCode."""
    said = git(repository, revision, "log", "-1", "--format=%h %cs %s", f"{revision}^{{commit}}")
    return said.decode(errors="replace").strip()


@contextmanager
def code_of(revision: str, repository: Path = HOME) -> Iterator[Path]:
    """A folder with the files of that revision; it goes when the block ends. Raises NoSuchCode."""
    if revision == WORKTREE:
        yield repository
        return
    made = git(repository, revision, "archive", "--format=tar", f"{revision}^{{commit}}")
    with tempfile.TemporaryDirectory(prefix="sonarlog-code-") as folder:
        with tarfile.open(fileobj=io.BytesIO(made)) as archive:
            archive.extractall(folder, filter="data")
        yield Path(folder)


def replay_with(
    code: Path,
    recording: Path,
    algorithm: str | None,
    settings: Mapping[str, object],
    output: Path,
    robot: str | None = None,
) -> list[str]:
    """Replay with the code in that folder (None: its default algorithm); the settings that it does not know.

    It goes without those. Raises NoSuchCode with what it said, if it could not.
    """
    words = ["replay", str(recording.resolve()), "-o", str(output.resolve())]
    known: Mapping[str, object] = {}
    if algorithm is not None:
        words += ["--algorithm", algorithm]
    if robot is not None:
        words += ["--robot", str(Path(robot).resolve()) if Path(robot).exists() else robot]
    if settings:
        listed = json.loads(_run(code, ["algorithms", *([algorithm] if algorithm else []), "--json"]))
        known = listed[algorithm]["config"] if algorithm else next(iter(listed.values()))["config"]
        sheet = output.with_suffix(".toml")
        lines = (f"{name} = {_toml(value)}\n" for name, value in settings.items() if name in known)
        sheet.write_text("".join(lines), encoding="utf-8")
        words += ["--config", str(sheet.resolve())]
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
