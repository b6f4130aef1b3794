"""Canonical bytes: the same value has the same bytes on every machine, and they can be read back.

docs/determinism.md defines the format to the byte. Must not know: what the values mean, hashes, files.
"""

import struct
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

from sonarlog.errors import SonarlogError

NAN = b"\x00\x00\x00\x00\x00\x00\xf8\x7f"
KINDS = "biuf"
_DOUBLE = struct.Struct("<d")


class NotCanonical(SonarlogError):
    """Bytes that are not the canonical bytes of any value."""

    def __init__(self, place: int) -> None:
        super().__init__(f"no canonical value begins at byte {place}: the run was damaged, or made by another version")


def canonical(value: Any) -> bytes:
    """The canonical bytes of numbers, texts, arrays, sequences, mappings and dataclasses, nested at will.

    Raises TypeError for what has none.
    """
    out = bytearray()
    _write(out, value)
    return bytes(out)


def joined(parts: Mapping[str, bytes]) -> bytes:
    """The canonical bytes of a mapping whose values are canonical bytes already."""
    entries = (canonical(key) + parts[key] for key in sorted(parts))
    return b"m%d;" % len(parts) + b"".join(entries)


def _write(out: bytearray, value: Any) -> None:
    kind = value.__class__
    if kind is float:
        out += b"d" + _DOUBLE.pack(value + 0.0) if value == value else b"d" + NAN  # noqa: PLR0124  # −0.0 + 0.0 is 0.0
    elif kind is int:
        out += b"i%d;" % value
    elif kind is tuple or kind is list:
        out += b"l%d;" % len(value)
        for item in value:
            _write(out, item)
    elif kind is np.ndarray:
        _write_array(out, value)
    elif kind is str:
        data = value.encode()
        out += b"s%d;" % len(data) + data
    elif value is None:
        out += b"n"
    elif kind is bool:
        out += b"t" if value else b"f"
    else:
        _write_other(out, value)


def _write_other(out: bytearray, value: Any) -> None:
    if isinstance(value, float):  # numpy's
        _write(out, float(value))
    elif is_dataclass(value):
        names = _names(value.__class__)
        out += b"c%d;" % len(names)
        for name, head in names:
            out += head
            _write(out, getattr(value, name))
    elif isinstance(value, Mapping):
        out += b"m%d;" % len(value)
        for key in sorted(value):
            _write(out, key)
            _write(out, value[key])
    else:
        raise TypeError(f"{type(value).__name__} has no canonical bytes")


@cache
def _names(kind: Any) -> tuple[tuple[str, bytes], ...]:
    return tuple((entry.name, entry.name.encode() + b"=") for entry in fields(kind))


def _write_array(out: bytearray, value: np.ndarray[Any, np.dtype[Any]]) -> None:
    kind = value.dtype.kind
    if kind not in KINDS:
        raise TypeError(f"an array of {value.dtype} has no canonical bytes")
    if kind == "f":
        value = value + 0.0
        odd = value != value  # noqa: PLR0124  # NaN
        if odd.any():
            value[odd] = np.nan
    shape = ",".join(map(str, value.shape))
    out += f"a{kind}{value.dtype.itemsize}:{shape};".encode()
    out += value.astype(value.dtype.newbyteorder("<"), order="C", copy=False).tobytes()


def read_canonical(data: bytes) -> Any:
    """The value in plain terms: dataclasses and mappings as dicts, sequences as lists. Raises NotCanonical."""
    value, end = _value(data, 0)
    if end != len(data):
        raise NotCanonical(end)
    return value


def parted(data: bytes) -> dict[str, bytes]:
    """The inverse of `joined`. Raises NotCanonical."""
    if data[:1] != b"m":
        raise NotCanonical(0)
    count, at = _number(data, 1)
    parts = {}
    for _ in range(count):
        key, begin = _value(data, at)
        _, at = _value(data, begin)
        parts[str(key)] = data[begin:at]
    return parts


def _value(data: bytes, at: int) -> tuple[Any, int]:
    read = _READ.get(data[at : at + 1])
    try:
        if read is None:
            raise ValueError
        return read(data, at + 1)
    except (ValueError, IndexError, KeyError, TypeError, struct.error):
        raise NotCanonical(at) from None


def _number(data: bytes, at: int) -> tuple[int, int]:
    """A decimal integer and the place behind its semicolon."""
    end = data.index(b";", at)
    return int(data[at:end]), end + 1


def _double(data: bytes, at: int) -> tuple[float, int]:
    return float(_DOUBLE.unpack_from(data, at)[0]), at + 8


def _text(data: bytes, at: int) -> tuple[str, int]:
    size, at = _number(data, at)
    if at + size > len(data):
        raise ValueError
    return data[at : at + size].decode(), at + size


def _sequence(data: bytes, at: int) -> tuple[list[Any], int]:
    count, at = _number(data, at)
    items = []
    for _ in range(count):
        item, at = _value(data, at)
        items.append(item)
    return items, at


def _record(data: bytes, at: int) -> tuple[dict[str, Any], int]:
    count, at = _number(data, at)
    record = {}
    for _ in range(count):
        end = data.index(b"=", at)
        record[data[at:end].decode()], at = _value(data, end + 1)
    return record, at


def _mapping(data: bytes, at: int) -> tuple[dict[Any, Any], int]:
    count, at = _number(data, at)
    mapping = {}
    for _ in range(count):
        key, at = _value(data, at)
        mapping[tuple(key) if isinstance(key, list) else key], at = _value(data, at)
    return mapping, at


def _array(data: bytes, at: int) -> tuple[np.ndarray[Any, np.dtype[Any]], int]:
    end = data.index(b";", at)
    kind, _, shape = data[at:end].decode().partition(":")
    if kind[0] not in KINDS:
        raise ValueError
    sizes = tuple(int(n) for n in shape.split(",")) if shape else ()
    dtype = np.dtype(f"<{kind}")
    count = 1
    for size in sizes:
        count *= size
    array = np.frombuffer(data, dtype, count, end + 1).reshape(sizes)
    return array.astype(dtype.newbyteorder("=")), end + 1 + count * dtype.itemsize


_READ: dict[bytes, Callable[[bytes, int], tuple[Any, int]]] = {
    b"d": _double,
    b"i": _number,
    b"s": _text,
    b"l": _sequence,
    b"c": _record,
    b"m": _mapping,
    b"a": _array,
    b"n": lambda _, at: (None, at),
    b"t": lambda _, at: (True, at),
    b"f": lambda _, at: (False, at),
}
