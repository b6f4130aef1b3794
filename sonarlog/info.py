"""What is in a file: a recording or a run, in facts that a person and a program can read.

Must not know: how it is printed.
"""

import json
import math
from collections import Counter
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from sonarlog.errors import SonarlogError
from sonarlog.log import Log
from sonarlog.mcap_file import McapReader
from sonarlog.recording import layout, open_recording, read_log, recording_digest
from sonarlog.recording.reader import lost_before
from sonarlog.sweeps import cut
from sonarlog.times import BlockTimes, times_in
from sonarlog.words import counted

GAP_NS = 500_000_000
"""So long without odometry is a gap: five packets of a robot that sends ten a second."""

SHOWN_GAPS = 3
SWEEP_NAMES = {"scan": "scan", "driving": "driving sweep"}
SHOWN_IDENTITY = ("NAME", "CLASS", "SUBCLASS", "serial", "imported_from")


class UnknownRun(SonarlogError):
    """A run whose metadata this version does not understand."""

    def __init__(self, path: Path, why: object) -> None:
        super().__init__(f"{path} is a run, but not of a version that this sonarlog knows: {why}")


@dataclass(frozen=True)
class Gap:
    """A stretch without odometry."""

    at_s: float  # since the first packet
    seconds: float


@dataclass(frozen=True)
class RecordingInfo:
    """A recording, in facts."""

    path: str
    bytes: int
    digest: str
    schema_version: str  # "" in a bag that no recorder of ours made
    sonarlog_version: str
    recorded_at: str  # ISO 8601, UTC; "" where no wall clock was
    command_line: str
    robot: str
    calibration: dict[str, Any] | None  # as its robot had it; null for a robot as it was built
    sonars: int
    identity: dict[str, str]
    seconds: float
    sweeps: dict[str, int]  # by kind
    readings: int
    without_echo: int
    counts: dict[str, int]
    gaps: tuple[Gap, ...]
    true_poses: int
    true_world: str
    events: dict[str, int]  # by level
    topics: dict[str, int]
    damage: tuple[str, ...]
    kind: str = "recording"

    def facts(self) -> list[tuple[str, str]]:
        """Label and text, line by line."""
        decoded = [f"{count} {name.replace('_', ' ')}" for name, count in self.counts.items() if count]
        share = f" ({100 * self.without_echo / self.readings:.0f} % without echo)" if self.readings else ""
        identity = ", ".join(self.identity[key] for key in SHOWN_IDENTITY if self.identity.get(key))
        truth = [f"{self.true_poses} poses"] * bool(self.true_poses)
        truth += [f"surfaces of {self.true_world}"] * bool(self.true_world)
        sweeps = [f"{count} {SWEEP_NAMES[kind]}{'' if count == 1 else 's'}" for kind, count in self.sweeps.items()]
        version = f"schema {self.schema_version}, sonarlog {self.sonarlog_version}" if self.schema_version else ""
        return [
            ("recording", f"{self.path}, {self.bytes / 1000:.0f} kB"),
            ("robot", f"{self.robot}, {self.sonars} sonars" + (f" ({identity})" if identity else "")),
            *([("calibrated", _calibration_text(self.calibration))] if self.calibration else []),
            ("recorded", f"{self.seconds:.1f} s" + (f" from {self.recorded_at}" if self.recorded_at else "")),
            ("sweeps", ", ".join(sweeps) or "none"),
            ("readings", f"{self.readings}{share}"),
            ("decoded", ", ".join(decoded) or "nothing"),
            ("gaps", _gaps_text(self.gaps)),
            ("truth", ", ".join(truth) or "unknown"),
            ("events", ", ".join(f"{count} {level}" for level, count in self.events.items()) or "none"),
            ("topics", ", ".join(f"{topic} {count}" for topic, count in self.topics.items())),
            ("made by", ", ".join(filter(None, (self.command_line, version))) or "not sonarlog"),
            ("digest", self.digest),
            *(("damage", sentence) for sentence in self.damage),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class RunInfo:
    """A run, as its metadata has it."""

    path: str
    bytes: int
    digest: str
    sweeps: int
    algorithm: str
    algorithm_version: int
    recording_digest: str
    robot: dict[str, Any] | None  # what the recording was taken to be of, if not of its own robot
    code_digest: str
    config: dict[str, Any]
    counts: dict[str, int]
    machine: dict[str, str]
    times: BlockTimes | None
    damage: tuple[str, ...]
    kind: str = "run"

    def facts(self) -> list[tuple[str, str]]:
        """Label and text, line by line."""
        return [
            ("run", f"{self.path}, {self.bytes / 1000:.0f} kB"),
            ("algorithm", f"{self.algorithm}, version {self.algorithm_version}"),
            ("sweeps", str(self.sweeps)),
            ("used", ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in self.counts.items() if count)),
            ("recording", self.recording_digest),
            *([("robot", _given_text(self.robot))] if self.robot else []),
            ("code", self.code_digest),
            ("machine", ", ".join(f"{name} {value}" for name, value in self.machine.items())),
            ("times", self.times.told() if self.times else "not kept"),
            ("digest", self.digest),
            *(("damage", sentence) for sentence in self.damage),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {**vars(self), "times": self.times and self.times.as_dict()}


def info(path: Path | str) -> RecordingInfo | RunInfo:
    """What is in the file. Raises CannotRead, NotMcap, UnknownRun, and what `read_log` raises for anything else."""
    file = McapReader(path)
    if "run" not in file.metadata:
        return _recording_info(open_recording(path), read_log(path))
    try:
        return _run_info(file)
    except (KeyError, ValueError) as error:
        raise UnknownRun(file.path, f"metadata {error}") from None


def gaps(times_ns: np.ndarray[Any, np.dtype[np.int64]]) -> tuple[Gap, ...]:
    """Stretches of more than GAP_NS between one time and the next."""
    times = times_ns.tolist()
    return tuple(
        Gap((before - times[0]) / 1e9, (after - before) / 1e9)
        for before, after in pairwise(times)
        if after - before > GAP_NS
    )


def _recording_info(file: McapReader, log: Log) -> RecordingInfo:
    made = file.metadata.get(layout.RECORDING, {})
    started_ns = int(made.get("started_wall_ns", 0))
    identity = {k: v for k, v in file.metadata.get(layout.ROBOT, {}).items() if k not in ("parameters", "crc32")}
    times = log.odometry.t_ns
    return RecordingInfo(
        path=str(file.path),
        bytes=file.path.stat().st_size,
        digest=recording_digest(file.path),
        schema_version=made.get("schema_version", ""),
        sonarlog_version=made.get("sonarlog_version", ""),
        recorded_at=_wall_time(started_ns) if started_ns else "",
        command_line=made.get("command_line", ""),
        robot=log.robot.name,
        calibration=_plain(log.robot.calibration.as_dict()) if log.robot.calibration else None,
        sonars=len(log.robot.sonars),
        identity=identity,
        seconds=int(times[-1] - times[0]) / 1e9 if len(times) else 0.0,
        sweeps=dict(Counter(sweep.kind for sweep in cut(log).sweeps)),
        readings=len(log.readings.t_ns),
        without_echo=int(np.count_nonzero(log.readings.range_mm >= log.robot.max_range_mm)),
        counts={name: count for name, count in log.counts.items() if name != "damage"},
        gaps=gaps(times),
        true_poses=len(log.truth.t_ns) if log.truth else 0,
        true_world=log.surfaces.world if log.surfaces else "",
        events=dict(Counter(event.level for event in log.events)),
        topics=dict(sorted(Counter(message.topic for message in file.stream()).items())),
        damage=(*file.damage, *lost_before(file)),
    )


def _run_info(file: McapReader) -> RunInfo:
    run = file.metadata["run"]
    identity = json.loads(run["identity"])
    return RunInfo(
        path=str(file.path),
        bytes=file.path.stat().st_size,
        digest=run["digest"],
        sweeps=int(run["sweeps"]),
        algorithm=identity["algorithm"],
        algorithm_version=identity["algorithm_version"],
        recording_digest=identity["recording_digest"],
        robot=_plain(identity.get("robot")),
        code_digest=identity["code_digest"],
        config=identity["config"],
        counts=json.loads(run["counts"]),
        machine=file.metadata.get("machine", {}),
        times=times_in(file.metadata),
        damage=file.damage,
    )


def _wall_time(t_ns: int) -> str:
    return datetime.fromtimestamp(t_ns // 1_000_000_000, UTC).isoformat()


def _plain(value: Any) -> Any:
    """As JSON has it: a number that was not found is null."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def _given_text(robot: dict[str, Any]) -> str:
    calibration = robot.get("calibration")
    told = _calibration_text(calibration) if calibration else "not calibrated"
    return f"{robot['name']}, given with --robot: {told}"


def _calibration_text(calibration: dict[str, Any]) -> str:
    off = [calibration["ring_deg"] + each for each in calibration["sonar_deg"] or [0.0]]
    sonars = f"{min(off):+.1f}°" + (f" to {max(off):+.1f}°" if len(off) > 1 else "")
    count = len(calibration["recordings"])
    return (
        f"rotation × {calibration['rotation_scale']:.4f}, distance × {calibration['distance_scale']:.4f}, "
        f"drift {calibration['drift_deg_per_m']:+.2f}°/m, sonars turned by {sonars}"
        + (f"; found in {counted(count, 'recording')}" if count else "")
    )


def _gaps_text(found: tuple[Gap, ...]) -> str:
    if not found:
        return "none"
    shown = ", ".join(f"{gap.seconds:.1f} s at {gap.at_s:.1f} s" for gap in found[:SHOWN_GAPS])
    return f"{len(found)}: {shown}" + (", …" if len(found) > SHOWN_GAPS else "")
