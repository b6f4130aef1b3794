"""Recover: from a recording that was cut off or damaged to a sound file with all that is whole.

Must not know: packets, sweeps, what is printed.
"""

from dataclasses import dataclass
from pathlib import Path

from sonarlog.mcap_file import PARTIAL, McapReader, McapWriter, copy
from sonarlog.recording import layout


@dataclass(frozen=True)
class Recovered:
    """What a recovery brought. `missing`: a sentence for each thing that could not be saved."""

    messages: int
    seconds: float
    missing: tuple[str, ...]

    @property
    def partly(self) -> bool:
        """Something that is in the damaged file is not in the new one."""
        return bool(self.missing)


def recover(path: Path, output: Path, *, force: bool = False) -> Recovered:
    """Write what is whole of the file at `path` to `output`; nothing is written where nothing is whole.

    Of a damaged file the new one says what is missing. A file that only was never finished loses nothing: what had not
    reached the disk was never in it. Raises CannotRead, NotMcap, OutputExists, CannotWrite.
    """
    source = McapReader(path)
    missing = tuple(sentence for sentence in source.damage if " is used" not in sentence)
    first = last = None
    for message in source.stream():
        first = message.log_time_ns if first is None else min(first, message.log_time_ns)
        last = message.log_time_ns if last is None else max(last, message.log_time_ns)
    if first is None or last is None:
        return Recovered(0, 0.0, missing or (f"{path}: there is no message in it",))
    # `recover a.mcap.part -o a.mcap` is what people type: the damaged file must not be the one being written.
    new = output.with_name(f"{output.name}.recovered{PARTIAL}")
    with McapWriter(output, force=force, keep=False, partial=new) as target:
        done = copy(source, target)
        if source.damage:
            target.metadata(layout.RECOVERED, {"from": path.name, "missing": "\n".join(missing)})
    return Recovered(done.messages, (last - first) / 1e9, missing)
