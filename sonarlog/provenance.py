"""Where a result comes from: the algorithm's own code, and, kept apart, the machine that ran it."""

import hashlib
import platform
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from types import ModuleType

import slam
from sonarlog import __version__


def code_digest(package: ModuleType = slam) -> str:
    """Hex digest of a package's source: file names and contents, in order of name."""
    state = hashlib.blake2b(digest_size=16)
    root = Path(package.__path__[0])
    for name in sorted(path.relative_to(root).as_posix() for path in root.rglob("*.py")):
        data = (root / name).read_bytes()
        state.update(f"{name}:{len(data)};".encode() + data)
    return state.hexdigest()


def machine_facts() -> dict[str, str]:
    """Versions, platform and git state: true of this run, and no part of its result.

    `host` tells one machine from another without naming it.
    """
    return {
        "sonarlog": __version__,
        "python": platform.python_version(),
        "numpy": metadata.version("numpy"),
        "platform": f"{sys.platform} {platform.machine()}",
        "host": hashlib.blake2b(platform.node().encode(), digest_size=4).hexdigest(),
        **_git_facts(Path(slam.__path__[0])),
    }


def _git_facts(folder: Path) -> dict[str, str]:
    """Commit of the checkout that holds the code, and whether slam/ was changed since; nothing outside a checkout."""

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(folder), *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()

    try:
        commit = git("rev-parse", "HEAD")
        dirty = bool(git("status", "--porcelain", "--", str(folder)))
    except (OSError, subprocess.SubprocessError):
        return {}
    return {"git_commit": commit, "git_dirty": str(dirty).lower()}
