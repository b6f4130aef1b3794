"""Versions of a recording's schema: one function a step brings the metadata of an old file to the newest form.

1: the first. 2: `recording` names the port, and both records carry a CRC of their own, which MCAP gives to messages
and attachments only. Must not know: files, messages.
"""

import json
import zlib
from collections.abc import Callable, Mapping

Record = dict[str, str]
Metadata = dict[str, Record]  # by name of the record

CRC = "crc32"
OWN = ("recording", "robot")


def _from_1_to_2(metadata: Metadata) -> Metadata:
    """The port stood in the configuration only."""
    recording = metadata["recording"]
    try:
        port = json.loads(recording.get("config", "{}")).get("port", "")
    except (ValueError, AttributeError):
        port = ""
    upgraded = metadata | {"recording": recording | {"port": str(port)}}
    return upgraded | {name: sealed(upgraded[name]) for name in OWN if name in upgraded}


STEPS: tuple[Callable[[Metadata], Metadata], ...] = (_from_1_to_2,)
"""STEPS[n - 1] goes from version n to n + 1."""

VERSION = len(STEPS) + 1


def upgrade(metadata: Metadata, version: int) -> Metadata:
    """Metadata written by that version (1 to VERSION), as VERSION has it; the given one stays as it is."""
    for step in STEPS[version - 1 :]:
        metadata = step(metadata)
    return metadata


def sealed(record: Mapping[str, str]) -> Record:
    """The record with its CRC."""
    return {**record, CRC: _crc(record)}


def whole(record: Mapping[str, str]) -> bool:
    """Whether the record is as it was sealed."""
    return record.get(CRC) == _crc(record)


def _crc(record: Mapping[str, str]) -> str:
    text = json.dumps({key: value for key, value in record.items() if key != CRC}, sort_keys=True)
    return f"{zlib.crc32(text.encode()):08x}"
