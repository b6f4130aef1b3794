"""MCAP files, written whole or not at all and read with every checksum on: the only door to the `mcap` library."""

from sonarlog.mcap_file.copy import Copied, copy
from sonarlog.mcap_file.reader import CannotRead, McapMessage, McapReader, NotMcap, StoredFile, Watch
from sonarlog.mcap_file.walk import MAGIC
from sonarlog.mcap_file.writer import PARTIAL, CannotWrite, McapWriter, OutputExists, partial_path

__all__ = [
    "MAGIC",
    "PARTIAL",
    "CannotRead",
    "CannotWrite",
    "Copied",
    "McapMessage",
    "McapReader",
    "McapWriter",
    "NotMcap",
    "OutputExists",
    "StoredFile",
    "Watch",
    "copy",
    "partial_path",
]
