"""Write an MCAP file, whole or recognisably not: schemas first, chunks on demand, its name last.

Must not know: what the messages mean, robots, runs.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Self

from mcap.writer import IndexType, Writer

from sonarlog.errors import SonarlogError

PROFILE = "ros2"
LIBRARY = "sonarlog"  # the default embeds the mcap version; the same input must give the same file
CHUNK_BYTES = 4 << 20
PARTIAL = ".part"


class OutputExists(SonarlogError):
    """The file to be written is there already."""

    def __init__(self, path: Path, kept: Path | None = None) -> None:
        what = " (never finished, or still being written)" if path.suffix == PARTIAL else ""
        rest = f"; what was written is in {kept}" if kept else ": choose another name, or give --force"
        if path.suffix == PARTIAL and not kept:
            rest += f" (`sonarlog recover {path} -o NEW` saves what is in it)"
        super().__init__(f"{path} exists{what} and is not overwritten{rest}")


class CannotWrite(SonarlogError):
    """The disk, a quota or a permission refused the file."""

    def __init__(self, path: Path, error: OSError, *, kept: bool = False) -> None:
        rest = "; what was written before is kept there, whole: `sonarlog recover` finishes it" if kept else ""
        super().__init__(f"cannot write {path}: {error.strerror or error}{rest}")


def partial_path(path: Path) -> Path:
    """Where `path` is while it is being written; a file of this name was never finished."""
    return path.with_name(path.name + PARTIAL)


class McapWriter:
    """Write one MCAP file as `PATH.part`; `finish` gives it its name, `abandon` removes it.

    As a context manager it finishes, or abandons the file when the block raised. The same calls give the same bytes.
    Raises OutputExists before anything is written, CannotWrite whenever the disk refuses; with `keep` what was written
    up to there stays in `PATH.part`, sound up to its last whole chunk.
    """

    def __init__(
        self,
        path: Path | str,
        *,
        force: bool = False,
        message_index: bool = True,
        keep: bool = True,
        partial: Path | None = None,
    ) -> None:
        """`message_index` costs 16 bytes a message; Lichtblick and rosbags need it, Rerun and sonarlog do not.

        `keep`: half a file is worth keeping, for what is in it cannot be made again. `partial`: where it is while it is
        being written, if not at `PATH.part`.
        """
        self.path = Path(path)
        self.partial = partial or partial_path(self.path)
        self._force = force
        self._keep = keep
        self._schemas: dict[str, int] = {}
        self._state = "open"
        self._whole_bytes = self._head_bytes = 0  # what has been flushed ends with a whole record
        for taken in () if force else (self.path, self.partial):
            if taken.exists():
                raise OutputExists(taken)
        try:
            self._stream: BinaryIO = self.partial.open("wb" if force else "xb")
        except OSError as error:
            raise CannotWrite(self.partial, error) from None
        index = IndexType.ALL if message_index else IndexType.ALL & ~IndexType.MESSAGE
        self._writer = Writer(self._stream, CHUNK_BYTES, index_types=index, enable_data_crcs=True)
        with self._guard():
            self._writer.start(PROFILE, LIBRARY)
            self._stream.flush()
            self._whole_bytes = self._head_bytes = self._stream.tell()
            _sync_folder(self.partial)

    @property
    def closed(self) -> bool:
        """Whether nothing can be written any more: finished, abandoned or failed."""
        return self._state != "open"

    def channel(self, topic: str, schema: str, definition: str, *, encoding: str = "cdr") -> int:
        """Register a topic and return the channel's id.

        `encoding` is "cdr" (ros2msg schemas), "json" (jsonschema) or "canonical" (the schema says it in words).
        Register all channels before the first message: they are written once, in the chunk then open.
        """
        kind = {"cdr": "ros2msg", "json": "jsonschema", "canonical": "text"}[encoding]
        qos = {"offered_qos_profiles": "[]"} if encoding == "cdr" else {}  # rosbag2 asks for the key
        return self.any_channel(topic, encoding, (schema, kind, definition.encode()), qos)

    def any_channel(
        self, topic: str, encoding: str, schema: tuple[str, str, bytes] | None, metadata: Mapping[str, str]
    ) -> int:
        """Register a topic of any encoding; `schema` is its name, encoding and text."""
        if schema is None:
            return self._writer.register_channel(topic, encoding, 0, dict(metadata))
        if schema[0] not in self._schemas:
            self._schemas[schema[0]] = self._writer.register_schema(*schema)
        return self._writer.register_channel(topic, encoding, self._schemas[schema[0]], dict(metadata))

    def write(self, channel: int, log_time_ns: int, data: bytes) -> None:
        """Add one message. Its sequence number stays 0, which says "none" and compresses to nothing."""
        with self._guard():
            self._writer.add_message(channel, log_time_ns, data, publish_time=log_time_ns)

    def metadata(self, name: str, data: Mapping[str, str]) -> None:
        """Add a metadata record; it goes to the stream at once, before messages still in memory."""
        with self._guard():
            self._writer.add_metadata(name, dict(data))

    def attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Add a file; it carries no times, so that the same input gives the same bytes."""
        with self._guard():
            self._writer.add_attachment(0, 0, name, media_type, data)

    def flush(self, *, fsync: bool = False) -> None:
        """Close the chunk in progress and hand it to the system, with `fsync` to the disk itself."""
        with self._guard():
            self._writer.flush()  # type: ignore[no-untyped-call]  # mcap: no `-> None`
            if fsync:
                os.fsync(self._stream.fileno())
            self._whole_bytes = self._stream.tell()

    def finish(self) -> None:
        """Write summary and footer, sync, and give the file its name, still refusing to overwrite. Idempotent."""
        if self.closed:
            return
        with self._guard():
            self._writer.finish()  # type: ignore[no-untyped-call]  # mcap: no `-> None`
            self._stream.flush()
            os.fsync(self._stream.fileno())
            self._stream.close()
            self._state = "finished"
            if self._force:
                self.partial.replace(self.path)
            else:
                _rename_exclusively(self.partial, self.path)
            _sync_folder(self.path)

    def abandon(self) -> None:
        """Close and remove what was written. Does nothing once the file is finished or has failed."""
        if not self.closed:
            self._state = "abandoned"
            with suppress(OSError):
                self._stream.close()
            self.partial.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        if kind is None:
            self.finish()
        else:
            self.abandon()

    @contextmanager
    def _guard(self) -> Iterator[None]:
        """Turn what the disk refuses into CannotWrite, and then end the partial file with its last whole record.

        Another attempt would write behind half a record.
        """
        if self.closed:
            raise ValueError(f"{self.path} is {self._state}: nothing can be written to it")
        try:
            yield
        except OSError as error:
            self._state = "failed"
            with suppress(OSError):  # the same refusal again, from the buffer
                self._stream.close()
            kept = self._keep and self._whole_bytes > self._head_bytes
            with suppress(OSError):
                if kept:
                    os.truncate(self.partial, self._whole_bytes)
                else:
                    self.partial.unlink()
            raise CannotWrite(self.partial, error, kept=kept) from None


def _rename_exclusively(source: Path, target: Path) -> None:
    """Rename, but never over a file that appeared meanwhile. Raises OutputExists."""
    try:
        target.hardlink_to(source)
    except FileExistsError:
        raise OutputExists(target, kept=source) from None
    except OSError:  # no hard links here (FAT, some network drives): look, then rename
        if target.exists():
            raise OutputExists(target, kept=source) from None
        source.rename(target)
    else:
        source.unlink()


def _sync_folder(path: Path) -> None:
    """Make sure that the name survives a power cut too, on systems whose folders can be synced."""
    with suppress(OSError):
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
