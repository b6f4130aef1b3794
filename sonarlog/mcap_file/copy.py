"""Copy what is whole of a damaged or unfinished MCAP file into a sound one.

Must not know: what the messages mean, robots, runs.
"""

from dataclasses import dataclass

from mcap.records import Attachment, Channel, Message, Metadata, Schema

from sonarlog.mcap_file.reader import McapReader
from sonarlog.mcap_file.writer import McapWriter


@dataclass(frozen=True)
class Copied:
    """What came over: numbers of messages, metadata records and attachments."""

    messages: int = 0
    metadata: int = 0
    attachments: int = 0


def copy(source: McapReader, target: McapWriter) -> Copied:
    """All whole records in their order. Messages keep channel, times and bytes; ids and chunks are new.

    Raises CannotWrite.
    """
    schemas: dict[int, Schema] = {}
    known: dict[int, Channel] = {}
    channels: dict[int, int] = {}
    done = Copied()
    for record in source.records():
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            known[record.id] = record
        elif isinstance(record, Message):
            if record.channel_id not in known:
                continue
            if record.channel_id not in channels:
                channels[record.channel_id] = _channel(target, known[record.channel_id], schemas)
            target.write(channels[record.channel_id], record.log_time, record.data)
            done = Copied(done.messages + 1, done.metadata, done.attachments)
        elif isinstance(record, Metadata):
            target.metadata(record.name, record.metadata)
            done = Copied(done.messages, done.metadata + 1, done.attachments)
        elif isinstance(record, Attachment):
            target.attachment(record.name, record.media_type, record.data)
            done = Copied(done.messages, done.metadata, done.attachments + 1)
    return done


def _channel(target: McapWriter, channel: Channel, schemas: dict[int, Schema]) -> int:
    schema = schemas.get(channel.schema_id)
    described = None if schema is None else (schema.name, schema.encoding, schema.data)
    return target.any_channel(channel.topic, channel.message_encoding, described, channel.metadata)
