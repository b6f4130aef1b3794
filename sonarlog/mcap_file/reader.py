"""Read an MCAP file with every checksum on: what is whole is used, what is not is named.

Must not know: what the messages mean, robots, runs.
"""

import os
import struct
import zlib
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import breakup_chunk, get_chunk_data_stream

from sonarlog.errors import SonarlogError
from sonarlog.mcap_file.walk import BROKEN, MAGIC, RECORD_HEAD, walk
from sonarlog.mcap_file.writer import partial_path

MESSAGE_HEAD = struct.Struct("<H4xQ8x")  # channel, sequence number, log time, publish time
FOOTER = struct.Struct("<BQQQI")  # opcode, length, summary's begin, its offsets' begin, its CRC

R = TypeVar("R")
Watch = Callable[[int, int], None]
"""Hears how much is done, and of how much."""


class CannotRead(SonarlogError):
    """There is no such file, or it may not be read."""

    def __init__(self, path: Path, error: OSError) -> None:
        part = partial_path(path)
        hint = (
            f" ({part.name} is there: a recording that was never finished, readable as it is)" if part.exists() else ""
        )
        super().__init__(f"cannot read {path}: {error.strerror or error}{hint}")


class NotMcap(SonarlogError):
    """The file is something else."""

    def __init__(self, path: Path, *, empty: bool) -> None:
        what = "it is empty" if empty else "it does not begin as one"
        super().__init__(f"{path} is no MCAP file: {what}")


class McapMessage(NamedTuple):
    """One message as it lies in the file."""

    topic: str
    schema: str
    encoding: str
    log_time_ns: int
    data: bytes


@dataclass(frozen=True)
class StoredFile:
    """An attachment."""

    media_type: str
    data: bytes


class McapReader:
    """An MCAP file, wholly checked when it is opened.

    `metadata` (records of one name merged, later keys win), `attachments` by name, and `damage`: one sentence for each
    thing missing or unreadable, empty for a sound file. What is whole is readable whatever the damage.
    Raises CannotRead and NotMcap.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, StoredFile] = {}
        self.damage: tuple[str, ...] = ()
        self._schemas: dict[int, str] = {}  # what the summary repeats: the first chunk may be the damaged one
        self._channels: dict[int, Channel] = {}
        try:
            with self.path.open("rb") as stream:
                begin = stream.read(len(MAGIC))
        except OSError as error:
            raise CannotRead(self.path, error) from None
        if begin != MAGIC:
            raise NotMcap(self.path, empty=not begin)
        damage: list[str] = []
        for record in self._records(_checked, damage):
            if isinstance(record, Metadata):
                self.metadata.setdefault(record.name, {}).update(record.metadata)
            elif isinstance(record, Attachment):
                self.attachments[record.name] = StoredFile(record.media_type, record.data)
            elif isinstance(record, Schema):
                self._schemas[record.id] = record.name
            elif isinstance(record, Channel):
                self._channels[record.id] = record
        if not damage and not _summary_is_whole(self.path):
            damage.append(f"{self.path}: the index at its end fails its checksum; all messages are there")
        self.damage = tuple(damage)

    def messages(self, topics: Collection[str] | None = None) -> list[McapMessage]:
        """Messages of these topics (None: all) in ascending log_time, ties in file order."""
        return sorted(self.stream(topics), key=lambda message: message.log_time_ns)

    def stream(self, topics: Collection[str] | None = None, watch: Watch | None = None) -> Iterator[McapMessage]:
        """Messages of these topics (None: all) in file order, without holding the file in memory.

        `watch` hears at every chunk how many of the file's bytes are read.
        """
        schemas, channels = dict(self._schemas), dict(self._channels)
        for record in self._records(_plain, [], watch):
            if isinstance(record, Message | _Plain):
                channel = channels.get(record.channel_id)
                if channel is not None and (topics is None or channel.topic in topics):
                    schema = schemas.get(channel.schema_id, "")
                    yield McapMessage(channel.topic, schema, channel.message_encoding, record.log_time, record.data)
            elif isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = record

    def records(self) -> Iterator[McapRecord]:
        """Every whole record in file order, chunks as what is in them: for a copy."""
        return self._records(partial(breakup_chunk, validate_crc=True), [])

    def _records(
        self, chunk: Callable[[Chunk], list[R]], damage: list[str], watch: Watch | None = None
    ) -> Iterator[R | McapRecord]:
        """All records in file order, for a chunk what `chunk` makes of it; `damage` gets what had to be left out."""
        with self.path.open("rb") as stream:
            size = os.fstat(stream.fileno()).st_size
            for begin, record in walk(self.path, stream, damage):
                if not isinstance(record, Chunk):
                    yield record
                    continue
                if watch:
                    watch(begin, size)
                try:
                    inside = chunk(record)
                except BROKEN:
                    damage.append(f"{self.path}: the chunk at byte {begin} is damaged; its messages are missing")
                else:
                    yield from inside


class _Plain(NamedTuple):
    """A message record without what nobody asks for."""

    channel_id: int
    log_time: int
    data: bytes


def _plain(chunk: Chunk) -> list[_Plain | McapRecord]:
    """What is in a chunk, messages in a third of the time that `breakup_chunk` takes. Raises one of BROKEN."""
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    data = stream.read(size)
    found: list[_Plain | McapRecord] = []
    at = 0
    while at < size:
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        begin = at + RECORD_HEAD.size
        at = begin + length
        if at > size:
            raise struct.error(f"a record ends {at - size} bytes behind its chunk")
        if opcode == Opcode.MESSAGE:
            channel, log_time = MESSAGE_HEAD.unpack_from(data, begin)
            found.append(_Plain(channel, log_time, data[begin + MESSAGE_HEAD.size : at]))
        elif opcode in (Opcode.CHANNEL, Opcode.SCHEMA):
            kind = Channel if opcode == Opcode.CHANNEL else Schema
            found.append(kind.read(ReadDataStream(BytesIO(data[begin:at]))))
    return found


def _checked(chunk: Chunk) -> list[McapRecord]:
    """Nothing, after the check that `breakup_chunk` makes; ten times faster. Raises one of BROKEN."""
    get_chunk_data_stream(chunk, validate_crc=True)
    return []


def _summary_is_whole(path: Path) -> bool:
    """Whether the CRC in the footer, if there is one, is that of the summary before it."""
    data = path.read_bytes()
    footer = len(data) - len(MAGIC) - FOOTER.size
    _, _, begin, _, crc = FOOTER.unpack_from(data, footer)
    return bool(crc == 0 or (begin <= footer and zlib.crc32(data[begin or footer : -len(MAGIC) - 4]) == crc))
