"""Walk an MCAP file from record to record, over what is cut off or flipped, accounting for every byte.

A chunk whose mark is flipped is some other record to whoever does not look twice, and a file that was never finished
has no checksum to show it. Must not know: what is in chunks, topics, messages.
"""

import os
import struct
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, McapRecord, Message, MessageIndex
from mcap.stream_reader import CRCValidationError, StreamReader

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = struct.Struct("<BQ")  # opcode, length
CHUNK_HEAD = struct.Struct("<BQQQQI")  # opcode, length, first and last time, uncompressed size and its CRC
COMPRESSED = b"\x04\0\0\0zstd"  # what follows the head in a chunk of ours
CONTENTS = struct.Struct("<Q")  # and then the length of what is in it
MESSAGE_BYTES, INDEX_BYTES = 22, 6  # what stands before a message's data, and before an index's entries

# What the mcap and zstandard libraries raise on bytes that are cut off or flipped. UnicodeDecodeError and the
# library's CRCValidationError are ValueErrors.
BROKEN = (McapError, zstandard.ZstdError, struct.error, ValueError, OverflowError, MemoryError, RuntimeError)

_KNOWN = {int(opcode) for opcode in Opcode}


def walk(path: Path, stream: BinaryIO, damage: list[str]) -> Iterator[tuple[int, McapRecord]]:
    """All whole records outside of chunks, each with the byte where it begins, in order.

    `damage` gets a sentence for each stretch that had to be left out.
    """
    size = os.fstat(stream.fileno()).st_size
    read = partial(StreamReader, stream, emit_chunks=True, validate_crcs=True, record_size_limit=size)
    records = read().records
    chunked = False
    while True:
        begin = stream.tell()
        record: McapRecord | None = None
        if odd := _mismarked(stream, begin, size):
            why, record = odd
            damage.append(f"{path}: {why}")
        else:
            try:
                record = next(records)
            except StopIteration:
                return
            except CRCValidationError:
                damage.append(f"{path}: the data section fails its checksum: something in it was altered")
                return
            except BROKEN:
                found = _next_chunk(stream, begin + 1)
                damage.append(f"{path}: {_left_out(begin, found, size)}")
                if found is None:
                    return
                stream.seek(found)
            else:
                end = (begin or len(MAGIC)) + _bytes_of(record)
                if stream.tell() == end and not (chunked and _is_index(record)):
                    chunked |= isinstance(record, Chunk)
                    yield begin, record
                    continue
                damage.append(f"{path}: bytes {begin} to {stream.tell()} are not what they are marked as")
                if isinstance(record, Chunk):  # it is its length that is wrong
                    stream.seek(end)
                else:
                    record = None
        records = read(skip_magic=True).records  # which cannot check the data section's checksum any more
        if record is not None:
            yield begin, record


def _mismarked(stream: BinaryIO, begin: int, size: int) -> tuple[str, Chunk | None] | None:
    """What is odd about the mark of the record that begins here, and the chunk if it is one; the stream is behind it.

    None for a mark that will do; the stream is left where it was.
    """
    head = stream.read(CHUNK_HEAD.size + len(COMPRESSED) + CONTENTS.size) if begin else b""
    if head[CHUNK_HEAD.size : -CONTENTS.size] == COMPRESSED and head[0] != Opcode.CHUNK:
        _, length, first, last, uncompressed, crc = CHUNK_HEAD.unpack_from(head)
        (contents,) = CONTENTS.unpack_from(head, len(head) - CONTENTS.size)
        data = stream.read(contents) if len(head) - RECORD_HEAD.size + contents == length else b""
        if data and len(data) == contents:
            chunk = Chunk("zstd", data, last, first, crc, uncompressed)
            return f"the chunk at byte {begin} has lost its mark; if its checksum is right it is used", chunk
    stream.seek(begin)
    if len(head) >= RECORD_HEAD.size:
        opcode, length = RECORD_HEAD.unpack_from(head)
        end = begin + RECORD_HEAD.size + length
        if opcode not in _KNOWN and end <= size:
            stream.seek(end)
            return f"bytes {begin} to {end} are no record of any known kind and left out", None
    return None


def _is_index(record: McapRecord) -> bool:
    """Whether a message is an index of messages: its sequence number is the length of what would be the entries."""
    return isinstance(record, Message) and record.sequence == MESSAGE_BYTES + len(record.data) - INDEX_BYTES


def _bytes_of(record: McapRecord) -> int:
    """How long the record is in a file."""
    if isinstance(record, Chunk):
        return CHUNK_HEAD.size + 4 + len(record.compression.encode()) + CONTENTS.size + len(record.data)
    if isinstance(record, MessageIndex):
        return RECORD_HEAD.size + INDEX_BYTES + 16 * len(record.records)
    if isinstance(record, Message):
        return RECORD_HEAD.size + MESSAGE_BYTES + len(record.data)
    builder = RecordBuilder()
    record.write(builder)
    return builder.count


def _next_chunk(stream: BinaryIO, begin: int) -> int | None:
    """Where the next compressed chunk begins, by the look of it; its own checksum decides afterwards."""
    stream.seek(begin)
    data = stream.read()
    at = data.find(COMPRESSED, CHUNK_HEAD.size)
    while at >= 0:
        head = at - CHUNK_HEAD.size
        opcode, length, _, _, _, _ = CHUNK_HEAD.unpack_from(data, head)
        inside = at + len(COMPRESSED) - (head + 9)  # bytes of the record before the length of its contents
        if opcode == Opcode.CHUNK and head + 9 + length <= len(data) and length >= inside + 8:
            (contents,) = CONTENTS.unpack_from(data, at + len(COMPRESSED))
            if contents + inside + 8 == length:
                return begin + head
        at = data.find(COMPRESSED, at + 1)
    return None


def _left_out(begin: int, found: int | None, size: int) -> str:
    if found is not None:
        return f"bytes {begin} to {found} are unreadable and left out"
    if begin == size:
        return f"it was never finished: it ends after byte {size}, all of which is used"
    return f"cut off or unreadable from byte {begin} of {size} on"
