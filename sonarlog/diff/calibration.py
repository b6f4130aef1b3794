"""What two runs think of the robot in the end: every number of their calibration. Must not know: what it means."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class CalibrationChange:
    """A number by its name in the run (`mounting[3]`), in A and in B; None where a run has no such number."""

    name: str
    a: float | None
    b: float | None

    @property
    def changed(self) -> bool:
        """Whether the two differ at all."""
        return self.a != self.b

    def mirrored(self) -> "CalibrationChange":
        """From B to A."""
        return CalibrationChange(self.name, self.b, self.a)


def calibration_changes(a: Mapping[str, Any], b: Mapping[str, Any]) -> tuple[CalibrationChange, ...]:
    """Every number of two calibrations in plain terms, in the order of A's."""
    mine, yours = dict(_numbers(a)), dict(_numbers(b))
    return tuple(CalibrationChange(name, mine.get(name), yours.get(name)) for name in mine | yours)


def _numbers(value: Any, name: str = "") -> Iterator[tuple[str, float]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _numbers(item, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list | tuple):
        for k, item in enumerate(value):
            yield from _numbers(item, f"{name}[{k}]")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield name, float(value)
