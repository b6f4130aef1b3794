"""What a side of a diff may be: a run, or a recording with the version that replays it.

`RUN`, `RECORDING`, `RECORDING@ALGORITHM[:key=value,…]`, `RECORDING@git:REV[:ALGORITHM[:key=value,…]]`. Must not know:
how runs are made.
"""

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

from sonarlog.errors import SonarlogError

GIT = "git:"


class BadSide(SonarlogError):
    """What was asked for is no side of a diff."""


@dataclass(frozen=True)
class RunFile:
    """A run that is there."""

    path: Path

    def __str__(self) -> str:
        return str(self.path)

    @property
    def label(self) -> str:
        """What tells it from other sides."""
        return self.path.name


@dataclass(frozen=True)
class Version:
    """A recording, and what is to replay it: None stands for the default algorithm, and for the code at hand.

    `robot` is the name or the file of the robot that it is taken to be of, None for its own.
    """

    recording: Path
    algorithm: str | None = None
    settings: tuple[tuple[str, object], ...] = ()
    revision: str | None = None
    robot: str | None = None

    def __str__(self) -> str:
        asked = self._asked()
        return f"{self.recording}@{asked}" if asked else str(self.recording)

    @property
    def label(self) -> str:
        """What tells it from other versions: `git:v0.1:paper`; `now` for what the code at hand does by itself."""
        return self._asked() or "now"

    def _asked(self) -> str:
        revision = f"git:{self.revision}" if self.revision else ""
        changes = ",".join(f"{name}={value}" for name, value in self.settings)
        return ":".join(filter(None, (revision, self.algorithm, changes)))

    def at(self, revision: str) -> "Version":
        """The same with the code of another revision."""
        return replace(self, revision=revision)


def parse_side(text: str) -> RunFile | Version:
    """What is asked for. Raises BadSide; whether a file is a run or a recording is told when it is read."""
    whole = Path(text)
    if "@" not in text or whole.exists():
        if not whole.exists():
            raise BadSide(f"there is no {text}: a side is a run, or RECORDING@ALGORITHM, or RECORDING@git:REV")
        return RunFile(whole)
    # Names of files and of revisions (HEAD@{1}) may hold an @ themselves.
    places = [k for k, letter in enumerate(text) if letter == "@"]
    place = next((k for k in places if Path(text[:k]).is_file()), places[0])
    recording, asked = Path(text[:place]), text[place + 1 :]
    if not recording.is_file():
        raise BadSide(f"there is no recording {recording}")
    if not asked:
        raise BadSide(f"{text}: which version? an algorithm, or git:REV")
    return version(recording, asked, text)


def version(recording: Path, asked: str, text: str = "") -> Version:
    """The version that `ALGORITHM[:key=value,…]` or `git:REV[:ALGORITHM[:key=value,…]]` names. Raises BadSide."""
    text = text or asked
    revision: str | None = None
    rest = asked
    if asked.startswith(GIT):
        revision, _, rest = asked.removeprefix(GIT).partition(":")
        if not revision:
            raise BadSide(f"{text}: which revision? git:REV, or git:WORKTREE for the files as they are now")
    algorithm, _, changes = rest.partition(":")
    if "=" in algorithm or (not algorithm and changes):
        raise BadSide(f"{text}: the algorithm comes first, as in {recording}@paper:association.d1_m=0.1")
    return Version(recording, algorithm or None, _settings(changes, text), revision)


def _settings(changes: str, text: str) -> tuple[tuple[str, object], ...]:
    found = {}
    for change in filter(None, changes.split(",")):
        name, equals, value = change.partition("=")
        if not equals or not name.strip():
            raise BadSide(f"{text}: settings are written key=value, not {change!r}")
        try:
            found[name.strip()] = tomllib.loads(f"value = {value.strip()}")["value"]
        except tomllib.TOMLDecodeError:
            found[name.strip()] = value.strip()
    return tuple(sorted(found.items()))
