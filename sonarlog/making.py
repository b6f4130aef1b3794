"""The runs that sides of a diff ask for: read where they are files, replayed where they are not, and kept.

Must not know: how sides are written, what becomes of the runs.
"""

import hashlib
import json
from pathlib import Path

from slam.algorithms import DEFAULT, algorithm
from sonarlog.cache import RunCache
from sonarlog.errors import SonarlogError
from sonarlog.replay import Watcher, replay
from sonarlog.revision import HOME, NoSuchCode, code_key, code_of, key_of, replay_with, repository
from sonarlog.robot import load_robot
from sonarlog.runs import BadRun, Run, read_run
from sonarlog.sides import RunFile, Version
from sonarlog.times import Clock


class CannotReplay(SonarlogError):
    """A side of a diff that could not be replayed."""


def run_of(side: RunFile | Version, cache: RunCache, watcher: Watcher | None = None, clock: Clock | None = None) -> Run:
    """The run, from its file, from the cache, or made now and kept.

    `watcher` follows a replay with the code at hand, and `clock` times it. Raises what reading and replaying raise, and
    NoSuchCode.
    """
    if isinstance(side, RunFile):
        return read_run(side.path)
    key = run_key(side)
    kept = cache.get(key)
    if kept is not None:
        try:
            return read_run(kept)
        except SonarlogError:  # damaged on the disk, or of a newer version
            cache.drop(key)
    with cache.making(key) as path:
        _make(side, path, watcher, clock)
    kept = cache.get(key)
    if kept is None:
        raise BadRun(f"the run of {side.recording} was dropped from {cache.folder} while it was made: try again")
    return read_run(kept)


def run_key(version: Version) -> str:
    """Hex digest of all that decides the run: the recording's bytes, the code, the algorithm, the settings, the robot.

    Raises NoSuchCode, BadRobot, and CannotReplay for a recording that cannot be read.
    """
    try:
        with version.recording.open("rb") as file:
            recording = hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()
    except OSError as error:
        raise CannotReplay(f"cannot read {version.recording}: {error.strerror or error}") from None
    code = code_key() if version.revision is None else key_of(version.revision, repository())
    asked = {
        "recording": recording,
        "code": code,
        "algorithm": version.algorithm,
        "settings": dict(version.settings),
        **({"robot": load_robot(version.robot).as_dict()} if version.robot else {}),
    }
    return hashlib.blake2b(json.dumps(asked, sort_keys=True).encode(), digest_size=16).hexdigest()


def _make(version: Version, path: Path, watcher: Watcher | None, clock: Clock | None) -> None:
    settings = dict(version.settings)
    where = repository()
    if version.revision is None or key_of(version.revision, where) == code_key(HOME):
        chosen = algorithm(version.algorithm or DEFAULT).configured(settings)
        robot = load_robot(version.robot) if version.robot else None
        replay(version.recording, chosen, path, watcher=watcher, clock=clock, robot=robot)
        return
    with code_of(version.revision, where) as code:
        try:
            unknown = replay_with(code, version.recording, version.algorithm, settings, path, version.robot)
        except NoSuchCode as error:
            raise NoSuchCode(f"{version.recording}@git:{version.revision}: {error}") from None
    if unknown:
        path.unlink(missing_ok=True)
        raise NoSuchCode(f"revision {version.revision!r} knows no setting {', '.join(unknown)}")
