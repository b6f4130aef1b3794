"""Read a recording back: from its wire where it has one, else from its ROS topics.

Must not know: how bytes are decoded, how sweeps are cut.
"""

import hashlib
import json
import struct
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from sonarlog import ros2
from sonarlog.cdr import ENCAPSULATION, BadMessage, decode, type_name
from sonarlog.decode import decode_wire
from sonarlog.errors import SonarlogError
from sonarlog.log import Event, Log, Surfaces, Truth
from sonarlog.mcap_file import McapMessage, McapReader, Watch
from sonarlog.protocol.framing import Frame, Framer
from sonarlog.protocol.packets import Sync, parse_packet
from sonarlog.recording import layout, versions
from sonarlog.recording.topics import log_from_topics
from sonarlog.robot import DEFAULT_ROBOT, Robot, built_in, load_robot

LEVEL_NAMES = {number: name for name, number in ros2.LEVELS.items()}
WIRE_RECORD = struct.Struct("<qBI")
WIRE_HEAD = struct.Struct("<4x8xB3xI")  # of a `Wire` message: encapsulation, stamp, direction, size of the bytes


class NotARecording(SonarlogError):
    """A sound MCAP file, but not one that `read_log` can use."""

    def __init__(self, path: Path, why: str) -> None:
        super().__init__(f"{path} {why}")


def open_recording(path: Path | str) -> McapReader:
    """Open and check the file, its metadata as the newest version has it.

    Raises CannotRead, NotMcap, and NotARecording for a run or a newer schema version.
    """
    file = McapReader(path)
    if "run" in file.metadata:
        raise NotARecording(file.path, "is a run, not a recording; `sonarlog info` says of which")
    made = file.metadata.get(layout.RECORDING)
    if made is None:
        return file  # a bag that no recorder of ours made
    version = made.get("schema_version", "1")
    if not version.isdecimal() or not 1 <= int(version) <= versions.VERSION:
        raise NotARecording(
            file.path,
            f"has recording schema version {version}; this sonarlog reads up to {versions.VERSION}: update it",
        )
    file.metadata = versions.upgrade(file.metadata, int(version))
    altered = [name for name in versions.OWN if not versions.whole(file.metadata.get(name, versions.sealed({})))]
    file.damage += tuple(f"{file.path}: the metadata {name!r} fails its checksum" for name in altered)
    if layout.ROBOT not in file.metadata:
        _assume_robot(file)
    return file


def _assume_robot(file: McapReader) -> None:
    """For a wire whose robot never said who it is, or whose metadata is lost: what the handshake says, or the default.

    It is damage, so that nobody takes the parameters for known.
    """
    wire = found = False
    known = DEFAULT_ROBOT
    framer = Framer()
    with suppress(BadMessage):
        for t_ns, direction, data in read_wire(file):
            wire = True
            for piece in framer.feed(data, t_ns) if direction == "rx" else ():
                packet = parse_packet(piece.body) if isinstance(piece, Frame) else None
                if isinstance(packet, Sync) and len(packet.strings) == 3 and packet.strings[2].lower() in built_in():
                    known, found = packet.strings[2], True
            if found:
                break
    if not wire:
        return
    parameters = json.dumps(load_robot(known).as_dict(), sort_keys=True)
    file.metadata[layout.ROBOT] = {"parameters": parameters}
    file.damage += (f"{file.path}: it does not say of which robot it is; {known} is assumed",)


def robot_of(file: McapReader) -> Robot | None:
    """The robot whose parameters the recording carries. Raises BadRobot, NotARecording."""
    parameters = file.metadata.get(layout.ROBOT, {}).get("parameters")
    if parameters is None:
        return None
    try:
        data = json.loads(parameters)
    except ValueError:
        raise _unreadable(file, "robot parameters") from None
    return Robot.from_dict(data, f"robot of {file.path}")


def read_wire(file: McapReader) -> Iterator[tuple[int, str, bytes]]:
    """(t_ns on the recorder's clock, "rx" or "tx", bytes) in order of writing; nothing where there is no wire."""
    return _wire(file, {})


def lost_before(file: McapReader) -> tuple[str, ...]:
    """What a recovery had to leave out of this file, in sentences."""
    missing = file.metadata.get(layout.RECOVERED, {}).get("missing", "")
    return tuple(f"{file.path} was recovered; of the original, {line}" for line in missing.splitlines())


def started_wall_ns(file: McapReader) -> int:
    """What has to be subtracted from log_time to have the recorder's own clock; 0 where no recorder was.

    Raises NotARecording.
    """
    started = file.metadata.get(layout.RECORDING, {}).get("started_wall_ns", "0")
    if not started.removeprefix("-").isdecimal():
        raise _unreadable(file, "clock tie")
    return int(started)


def _unreadable(file: McapReader, what: str) -> NotARecording:
    return NotARecording(file.path, f"has an unreadable {what}" + "".join(f" ({text})" for text in file.damage))


def read_log(path: Path | str, robot: Robot | None = None, watch: Watch | None = None) -> Log:
    """A recording, decoded, as of the robot given, else of the recording's own.

    Times are on the recorder's clock, or absolute in a bag that no recorder of ours made. What is missing of a damaged
    file is told in `events` and counted in `counts["damage"]`. `watch` hears how much of the file is decoded. Raises
    NotARecording, MissingTopics, BadRobot, and what `open_recording` raises.
    """
    file = open_recording(path)
    try:
        log = _decoded(file, robot, watch)
    except BadMessage as error:
        raise NotARecording(file.path, f"cannot be read: {error}") from None
    last = int(log.odometry.t_ns[-1]) if len(log.odometry.t_ns) else 0
    lost = (*file.damage, *lost_before(file))
    events = log.events + tuple(Event(last, "warn", sentence) for sentence in lost)
    counts = log.counts | ({"damage": len(lost)} if lost else {})
    return replace(log, surfaces=_surfaces(file), events=events, counts=counts, missing=lost)


def recording_digest(path: Path | str) -> str:
    """What a recording is, whatever its file's bytes: a hash of the robot's parameters and of the wire.

    Without a wire it hashes what the replay gets: odometry and readings as `read_log` gives them.
    """
    file = open_recording(path)
    known = _Fingerprint(robot_of(file))
    for message in known.watched(read_wire(file)):
        del message
    if not known.wire:
        known.take_topics(log_from_topics(file, robot_of(file), started_wall_ns(file)))
    return known.hexdigest()


class _Fingerprint:
    """The digest of a recording, made while it is read; `wire` tells whether anything was on the wire."""

    def __init__(self, robot: Robot | None) -> None:
        self.wire = False
        self._digest = hashlib.blake2b(digest_size=16, person=b"recording")
        self._digest.update(json.dumps(robot and robot.as_dict(), sort_keys=True).encode())
        self.hexdigest = self._digest.hexdigest

    def watched(self, messages: Iterable[tuple[int, str, bytes]]) -> Iterator[tuple[int, str, bytes]]:
        """The same messages, each taken in as it passes."""
        update, pack, ways = self._digest.update, WIRE_RECORD.pack, layout.DIRECTIONS.index
        for message in messages:
            t_ns, direction, data = message
            update(pack(t_ns, ways(direction), len(data)) + data)
            yield message
            self.wire = True

    def take_topics(self, log: Log) -> None:
        """Of a recording without a wire: what the replay gets."""
        for table in (log.odometry, log.readings):
            for column in vars(table).values():
                self._digest.update(np.ascontiguousarray(column, dtype="<i8").tobytes())


def _decoded(file: McapReader, given: Robot | None, watch: Watch | None) -> Log:
    """By the wire, else by the topics; events and, where the wire has none, truth are read beside it."""
    beside: dict[str, list[McapMessage]] = {layout.EVENTS: [], layout.TRUTH: [], layout.DECISIONS: []}
    own = robot_of(file)
    known = _Fingerprint(own)
    log = decode_wire(known.watched(_wire(file, beside, watch)), given or own or load_robot(DEFAULT_ROBOT))
    if not known.wire:
        log = log_from_topics(file, own, started_wall_ns(file), given)
        known.take_topics(log if given is None else log_from_topics(file, own, started_wall_ns(file)))
    events = tuple(_events(file, beside[layout.EVENTS]))
    truth = log.truth or _truth(file, beside[layout.TRUTH])
    decisions = tuple(_decisions(beside[layout.DECISIONS]))
    return replace(log, truth=truth, events=events, decisions=decisions, digest=known.hexdigest())


def _wire(
    file: McapReader, beside: dict[str, list[McapMessage]], watch: Watch | None = None
) -> Iterator[tuple[int, str, bytes]]:
    """(t_ns on the recorder's clock, "rx" or "tx", bytes) in order of writing; `beside` gets its topics' messages."""
    start = started_wall_ns(file)
    for message in file.stream({layout.WIRE, *beside}, watch):
        if message.topic == layout.WIRE:
            direction, data = _moved(message.data)
            yield message.log_time_ns - start, layout.DIRECTIONS[direction & 1], data
        else:
            beside[message.topic].append(message)


def _moved(data: bytes) -> tuple[int, bytes]:
    """Direction and bytes of a `Wire` message; `decode` does the same in six times the time. Raises BadMessage."""
    if data[:2] == ENCAPSULATION[:2] and len(data) >= WIRE_HEAD.size:
        direction, size = WIRE_HEAD.unpack_from(data)
        if WIRE_HEAD.size + size <= len(data):
            return direction, data[WIRE_HEAD.size : WIRE_HEAD.size + size]
    wire = decode(ros2.Wire, data)
    return wire.direction, wire.data


def _events(file: McapReader, messages: Iterable[McapMessage]) -> Iterator[Event]:
    start = started_wall_ns(file)
    for message in messages:
        if message.schema == type_name(ros2.Log):
            line = decode(ros2.Log, message.data)
            yield Event(message.log_time_ns - start, LEVEL_NAMES.get(line.level, "info"), line.msg)


def _decisions(messages: Iterable[McapMessage]) -> Iterator[str]:
    for message in messages:
        if message.schema == type_name(ros2.StringMessage):
            yield decode(ros2.StringMessage, message.data).data


def _truth(file: McapReader, messages: Iterable[McapMessage]) -> Truth | None:
    start = started_wall_ns(file)
    times, poses = [], []
    for message in messages:
        if message.schema == type_name(ros2.PoseStamped):
            pose = decode(ros2.PoseStamped, message.data).pose
            times.append(message.log_time_ns - start)
            poses.append((pose.position.x, pose.position.y, layout.yaw(pose.orientation)))
    return Truth(np.array(times, dtype=np.int64), np.array(poses, dtype=np.float64)) if times else None


def _surfaces(file: McapReader) -> Surfaces | None:
    stored = file.attachments.get(layout.SURFACES)
    try:
        return None if stored is None else Surfaces.from_json(stored.data)
    except (ValueError, KeyError, TypeError):
        raise _unreadable(file, layout.SURFACES) from None
