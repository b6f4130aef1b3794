"""Runs of little-endian fields of which a packet may hold fewer than the manual lists: read what is there.

Must not know: which packets there are.
"""

import struct
from collections.abc import Sequence
from functools import cache
from itertools import takewhile

Value = int | str
Field = tuple[str, str]
"""Name and kind: u8 u16 u32 s8 s16 s32, or str (NUL-terminated)."""

CODES = {"u8": "B", "u16": "H", "u32": "I", "s8": "b", "s16": "h", "s32": "i"}


def encode_fields(layout: Sequence[Field], values: Sequence[Value]) -> bytes:
    """The first len(values) fields of the layout."""
    out = bytearray()
    for (_, kind), value in zip(layout, values, strict=False):
        if isinstance(value, str):
            out += value.encode("latin-1", "replace") + b"\0"
        else:
            out += value.to_bytes(int(kind[1:]) // 8, "little", signed=kind[0] == "s")
    return bytes(out)


def parse_fields(layout: Sequence[Field], data: bytes) -> tuple[tuple[Value, ...], bytes]:
    """As many whole fields as `data` holds, and the bytes after them. Never raises."""
    layout = tuple(layout)
    numbers = _numbers(layout, len(data))
    values: list[Value] = list(numbers.unpack_from(data))
    at = numbers.size
    for _, kind in layout[len(values) :]:
        if kind == "str":
            end = data.find(b"\0", at)
            if end < 0:
                break
            values.append(data[at:end].decode("latin-1"))
            at = end + 1
        else:
            end = at + int(kind[1:]) // 8
            if end > len(data):
                break
            values.append(int.from_bytes(data[at:end], "little", signed=kind[0] == "s"))
            at = end
    return tuple(values), data[at:]


@cache
def _numbers(layout: tuple[Field, ...], size: int) -> struct.Struct:
    """The numbers before the layout's first text of which so many bytes hold the whole."""
    kinds = [kind for _, kind in takewhile(lambda entry: entry[1] != "str", layout)]
    wholes = (
        struct.Struct("<" + "".join(CODES[kind] for kind in kinds[:count])) for count in range(len(kinds), -1, -1)
    )
    return next(whole for whole in wholes if whole.size <= size)


def field_value(layout: Sequence[Field], values: Sequence[Value], name: str) -> Value | None:
    """The value of that name, None if the packet ended before it. Raises KeyError for a name not in the layout."""
    for index, (known, _) in enumerate(layout):
        if known == name:
            return values[index] if index < len(values) else None
    raise KeyError(name)
