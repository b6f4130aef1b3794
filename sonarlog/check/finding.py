"""What a check finds.

Must not know: what is checked, how it is printed.
"""

from dataclasses import dataclass
from typing import Literal

Level = Literal["problem", "note"]


@dataclass(frozen=True)
class Finding:
    """One sentence about one part of a recording; a problem makes the check fail, a note does not."""

    level: Level
    part: str  # "file", "wire", "time", "odometry", "sonar", "sweep"
    text: str


def problem(part: str, text: str) -> Finding:
    """Something is wrong."""
    return Finding("problem", part, text)


def note(part: str, text: str) -> Finding:
    """Something is worth knowing."""
    return Finding("note", part, text)
