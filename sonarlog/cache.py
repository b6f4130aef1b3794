"""Runs that were made on the way, kept by what decides them, so that nothing is replayed twice.

The least recently used go when the folder holds more than its limit. Must not know: how runs are made or read.
"""

import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from sonarlog.errors import SonarlogError

SUFFIX = ".run.mcap"
LIMIT = 1 << 30


class NoCache(SonarlogError):
    """The folder for the runs cannot be used."""

    def __init__(self, folder: Path, why: str) -> None:
        self.folder, self.why = folder, why
        super().__init__(f"cannot keep runs in {folder}: {why}; name another folder in SONARLOG_CACHE")

    def __reduce__(self) -> tuple[type["NoCache"], tuple[Path, str]]:
        return NoCache, (self.folder, self.why)


@dataclass(frozen=True)
class Kept:
    """One run in the cache, its size, and when it was last used."""

    path: Path
    bytes: int
    used_ns: int


class RunCache:
    """Runs in a folder, by key. Nothing that this object handed out is dropped while it lives."""

    def __init__(self, folder: Path, limit: int = LIMIT) -> None:
        self.folder, self.limit = folder, limit
        self._out: set[Path] = set()
        self._made: set[Path] = set()

    @classmethod
    def of(cls, environment: Mapping[str, str]) -> "RunCache":
        """The user's: in SONARLOG_CACHE, or XDG_CACHE_HOME/sonarlog, or ~/.cache/sonarlog; SONARLOG_CACHE_MB bounds it.

        Raises NoCache for a bound that is no number.
        """
        home = Path(environment.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folder = Path(environment.get("SONARLOG_CACHE") or home / "sonarlog")
        megabytes = environment.get("SONARLOG_CACHE_MB", str(LIMIT >> 20))
        if not megabytes.isdecimal():
            raise NoCache(folder, f"SONARLOG_CACHE_MB is {megabytes!r}, no number")
        return cls(folder, int(megabytes) << 20)

    def get(self, key: str) -> Path | None:
        """The run of that key, now the most recently used one; None if there is none."""
        path = self.folder / f"{key}{SUFFIX}"
        try:
            os.utime(path)
        except OSError:
            return None
        self._out.add(path)
        return path

    @contextmanager
    def making(self, key: str) -> Iterator[Path]:
        """Where to write the run of that key; it is kept once the block ends, if it was written. Raises NoCache."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            made = tempfile.TemporaryDirectory(prefix="making-", dir=self.folder, ignore_cleanup_errors=True)
        except OSError as error:
            raise NoCache(self.folder, error.strerror or str(error)) from None
        with made as name:
            path = Path(name) / f"{key}{SUFFIX}"
            yield path
            if path.exists():
                os.replace(path, self.folder / path.name)
                self._out.add(self.folder / path.name)
                self._made.add(self.folder / path.name)
        self._shrink()

    def made(self, path: Path) -> bool:
        """Whether that run was made in this object's life, not kept from before."""
        return path in self._made

    def drop(self, key: str) -> None:
        """Forget the run of that key."""
        (self.folder / f"{key}{SUFFIX}").unlink(missing_ok=True)

    def kept(self) -> list[Kept]:
        """What there is, the least recently used first."""
        found = []
        for path in self.folder.glob(f"*{SUFFIX}"):
            try:
                facts = path.stat()
            except OSError:  # another process dropped it
                continue
            found.append(Kept(path, facts.st_size, facts.st_mtime_ns))
        return sorted(found, key=lambda each: (each.used_ns, each.path))

    def clear(self) -> list[Kept]:
        """Drop everything; what there was."""
        found = self.kept()
        for each in found:
            each.path.unlink(missing_ok=True)
        return found

    def _shrink(self) -> None:
        found = self.kept()
        total = sum(each.bytes for each in found)
        for each in found:
            if total <= self.limit:
                break
            if each.path not in self._out:
                each.path.unlink(missing_ok=True)
                total -= each.bytes
