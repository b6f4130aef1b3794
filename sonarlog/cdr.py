"""ROS 2 messages as frozen dataclasses: from a class's fields follow both its .msg text and its CDR bytes.

Must not know: which messages there are (that is `sonarlog.ros2`), files, topics.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Annotated, Any, Protocol, TypeVar, dataclass_transform, get_args, get_origin, get_type_hints

from sonarlog.errors import SonarlogError

Bool = Annotated[bool, "bool"]
U8 = Annotated[int, "uint8"]
U16 = Annotated[int, "uint16"]
U32 = Annotated[int, "uint32"]
I8 = Annotated[int, "int8"]
I32 = Annotated[int, "int32"]
F32 = Annotated[float, "float32"]
F64 = Annotated[float, "float64"]
String = Annotated[str, "string"]
Bytes = Annotated[bytes, "uint8[]"]
SignedBytes = Annotated[bytes, "int8[]"]  # as bytes too: an occupancy grid is an array of int8 elsewhere
F32s = Annotated[tuple[float, ...], "float32[]"]
F64s = Annotated[tuple[float, ...], "float64[]"]
F64x9 = Annotated[tuple[float, ...], "float64[9]"]
F64x36 = Annotated[tuple[float, ...], "float64[36]"]

PRIMITIVES = {
    "bool": "?", "uint8": "B", "int8": "b", "uint16": "H", "int16": "h", "uint32": "I", "int32": "i",
    "uint64": "Q", "int64": "q", "float32": "f", "float64": "d",
}  # fmt: skip
ENCAPSULATION = b"\x00\x01\x00\x00"  # plain CDR, little-endian; alignment counts from behind it
SEPARATOR = "=" * 80

_NAMES: dict[type, str] = {}
T = TypeVar("T")


class BadMessage(SonarlogError):
    """Bytes that are no message of the type they are said to be."""

    def __init__(self, cls: type, size: int, why: str) -> None:
        super().__init__(f"{size} bytes are no {_NAMES[cls]}: {why}")


@dataclass_transform(frozen_default=True)
def message(name: str) -> Callable[[type[T]], type[T]]:
    """Make a class the message type `pkg/msg/Type`. Its fields, annotated with the types above, are the definition."""

    def make(cls: type[T]) -> type[T]:
        made = dataclass(frozen=True, slots=True)(cls)
        _NAMES[made] = name
        return made

    return make


def type_name(cls: type) -> str:
    """The `pkg/msg/Type` of a message class."""
    return _NAMES[cls]


def definition(cls: type) -> str:
    """The ros2msg schema: the fields of the class, then of every message type in it."""
    parts = {cls: _own_text(cls)}
    waiting = _nested(cls)
    while waiting:
        inner = waiting.pop(0)
        if inner not in parts:
            parts[inner] = f"{SEPARATOR}\nMSG: {_short(inner)}\n{_own_text(inner)}"
            waiting += _nested(inner)
    return "".join(parts.values())


def encode(value: object) -> bytes:
    """A message's CDR bytes."""
    out = bytearray(ENCAPSULATION)
    _codec(type(value)).write(out, value)
    return bytes(out)


def decode(cls: type[T], data: bytes, *, optional: int = 0) -> T:
    """The message in these CDR bytes; the last `optional` fields, which older definitions lack, may be missing.

    Raises BadMessage.
    """
    if data[:2] != ENCAPSULATION[:2]:
        raise BadMessage(cls, len(data), "they do not begin as little-endian CDR")
    try:
        value, _ = _codec(cls).read(data, len(ENCAPSULATION), optional)
    except (struct.error, UnicodeDecodeError) as error:
        raise BadMessage(cls, len(data), str(error)) from None
    made: T = value
    return made


class Codec(Protocol):
    """One type on the wire: `write` appends, `read` returns the value and where the next one begins."""

    ros: str

    def write(self, out: bytearray, value: Any) -> None:
        """Append the value, aligned."""

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        """Take the value at or after `at`. Raises struct.error, UnicodeDecodeError."""


class _Primitive:
    def __init__(self, ros: str) -> None:
        self.ros = ros
        self.struct = struct.Struct("<" + PRIMITIVES[ros])

    def write(self, out: bytearray, value: Any) -> None:
        out += bytes((4 - len(out)) % self.struct.size) + self.struct.pack(value)

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        at += (4 - at) % self.struct.size
        return self.struct.unpack_from(data, at)[0], at + self.struct.size


COUNT = _Primitive("uint32")


class _String:
    ros = "string"

    def write(self, out: bytearray, value: str) -> None:
        text = value.encode() + b"\0"
        COUNT.write(out, len(text))
        out += text

    def read(self, data: bytes, at: int) -> tuple[str, int]:
        count, at = COUNT.read(data, at)
        return _take(data, at, count).removesuffix(b"\0").decode(), at + count


class _Bytes:
    def __init__(self, ros: str) -> None:
        self.ros = ros

    def write(self, out: bytearray, value: bytes) -> None:
        COUNT.write(out, len(value))
        out += value

    def read(self, data: bytes, at: int) -> tuple[bytes, int]:
        count, at = COUNT.read(data, at)
        return _take(data, at, count), at + count


class _Numbers:
    """An array of primitives: of fixed length, or (None) counted."""

    def __init__(self, ros: str, length: int | None) -> None:
        self.ros = f"{ros}[{'' if length is None else length}]"
        self.length = length
        self.item = _Primitive(ros)

    def write(self, out: bytearray, value: tuple[float, ...]) -> None:
        if self.length is None:
            COUNT.write(out, len(value))
        elif len(value) != self.length:
            raise ValueError(f"{self.ros} takes {self.length} values, not {len(value)}")
        if value:
            out += bytes((4 - len(out)) % self.item.struct.size)
            out += struct.pack(f"<{len(value)}{PRIMITIVES[self.item.ros]}", *value)

    def read(self, data: bytes, at: int) -> tuple[tuple[float, ...], int]:
        count = self.length
        if count is None:
            count, at = COUNT.read(data, at)
        if not count:
            return (), at
        size = self.item.struct.size
        at += (4 - at) % size
        raw = _take(data, at, count * size)
        return struct.unpack(f"<{count}{PRIMITIVES[self.item.ros]}", raw), at + count * size


class _Message:
    def __init__(self, cls: type) -> None:
        self.cls = cls
        self.ros = _short(cls)
        self.fields = tuple((name, _codec_of(hint)) for name, hint in _hints(cls).items())

    def write(self, out: bytearray, value: Any) -> None:
        for name, codec in self.fields:
            codec.write(out, getattr(value, name))

    def read(self, data: bytes, at: int, optional: int = 0) -> tuple[Any, int]:
        values: list[Any] = []
        required = len(self.fields) - optional
        for _, codec in self.fields:
            if at == len(data) and len(values) >= required:
                break
            value, at = codec.read(data, at)
            values.append(value)
        return self.cls(*values), at


class _Messages:
    def __init__(self, cls: type) -> None:
        self.item = _codec(cls)
        self.ros = self.item.ros + "[]"

    def write(self, out: bytearray, value: tuple[Any, ...]) -> None:
        COUNT.write(out, len(value))
        kinds = {codec.ros for _, codec in self.item.fields}
        if len(kinds) == 1 and isinstance(only := self.item.fields[0][1], _Primitive):  # all in one go
            if value:
                out += bytes((4 - len(out)) % only.struct.size)
                numbers = [getattr(item, name) for item in value for name, _ in self.item.fields]
                out += struct.pack(f"<{len(numbers)}{PRIMITIVES[only.ros]}", *numbers)
            return
        for item in value:
            self.item.write(out, item)

    def read(self, data: bytes, at: int) -> tuple[tuple[Any, ...], int]:
        count, at = COUNT.read(data, at)
        values = []
        for _ in range(count):
            value, at = self.item.read(data, at)
            values.append(value)
        return tuple(values), at


def _codec_of(hint: Any) -> Codec:
    """The codec of a field's annotation: one of the types above, a message class, or `tuple[Message, ...]`."""
    if hint in _NAMES:
        return _codec(hint)
    if get_origin(hint) is tuple:
        return _Messages(get_args(hint)[0])
    ros: str = hint.__metadata__[0]
    if ros == "string":
        return _String()
    if ros in ("uint8[]", "int8[]"):
        return _Bytes(ros)
    if ros.endswith("]"):
        item, length = ros.removesuffix("]").split("[")
        return _Numbers(item, int(length) if length else None)
    return _Primitive(ros)


def _codec(cls: type) -> _Message:
    if cls not in _CODECS:
        _CODECS[cls] = _Message(cls)
    return _CODECS[cls]


def _hints(cls: type) -> dict[str, Any]:
    hints = get_type_hints(cls, include_extras=True)
    return {field.name: hints[field.name] for field in fields(cls)}


_CODECS: dict[type, _Message] = {}


def _own_text(cls: type) -> str:
    return "".join(f"{codec.ros} {name}\n" for name, codec in _codec(cls).fields)


def _nested(cls: type) -> list[type]:
    inner = (get_args(hint)[0] if get_origin(hint) is tuple else hint for hint in _hints(cls).values())
    return [hint for hint in inner if hint in _NAMES]


def _short(cls: type) -> str:
    return _NAMES[cls].replace("/msg/", "/")


def _take(data: bytes, at: int, count: int) -> bytes:
    if at + count > len(data):
        raise struct.error(f"they end {at + count - len(data)} bytes early")
    return data[at : at + count]
