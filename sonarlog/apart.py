"""How far two values are apart: every number that differs, where it stands, and by how many units in the last place.

Works on the plain terms of `read_canonical`. Must not know: what the values mean.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Apart:
    """At `where` (`links[0].d1`) the one has `a`, the other `b`; `ulps` for two finite floats, else None."""

    where: str
    a: Any
    b: Any
    ulps: int | None = None


def apart(a: Any, b: Any, where: str = "") -> Iterator[Apart]:
    """Every place where the two differ, in the order of the first."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in [*a, *(key for key in b if key not in a)]:
            yield from apart(a.get(key), b.get(key), f"{where}.{key}" if where else str(key))
    elif isinstance(a, list) and isinstance(b, list):
        if len(a) != len(b):
            yield Apart(f"{where} (how many)", len(a), len(b))
        for k, (mine, yours) in enumerate(zip(a, b, strict=False)):
            yield from apart(mine, yours, f"{where}[{k}]")
    elif isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        yield from _arrays(a, b, where)
    elif isinstance(a, float) and isinstance(b, float):
        if a != b and not (a != a and b != b):  # noqa: PLR0124  # two NaN are the same
            yield Apart(where, a, b, ulps_between(a, b))
    elif type(a) is not type(b) or a != b:
        yield Apart(where, _short(a), _short(b))


def _arrays(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any], where: str) -> Iterator[Apart]:
    if a.shape != b.shape or a.dtype != b.dtype:
        yield Apart(f"{where} (shape)", f"{a.dtype}{list(a.shape)}", f"{b.dtype}{list(b.shape)}")
        return
    for place in np.argwhere(a != b).tolist():
        at = f"{where}[{', '.join(map(str, place))}]"
        yield from apart(a[tuple(place)].item(), b[tuple(place)].item(), at)


def ulps_between(a: float, b: float) -> int | None:
    """How many representable numbers lie from a to b; None if one of them is not finite."""
    if not (abs(a) < float("inf") and abs(b) < float("inf")):
        return None
    return abs(_place(a) - _place(b))


def _place(value: float) -> int:
    """The number of representable numbers from zero to the value."""
    bits: int = struct.unpack("<q", struct.pack("<d", value))[0]
    return bits if bits >= 0 else -(bits & 0x7FFFFFFFFFFFFFFF)


def _short(value: Any) -> Any:
    return value if isinstance(value, str | int | float | None) else f"a {type(value).__name__}"


def plain(value: Any) -> Any:
    """The value as JSON can say it: arrays as nested lists, what is not finite as text, keys as text."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, dict):
        return {key if isinstance(key, str) else ",".join(map(str, key)): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return str(value)
    return value
