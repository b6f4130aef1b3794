"""Digests: a hash of canonical bytes of any value, and of each block's output per sweep, chained.

The same value has the same bytes on every machine: little-endian, one NaN, no −0.0, lengths before contents.
"""

import hashlib
import struct
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

from slam.grid import Grid
from slam.pipeline import Step

BLOCKS = {
    "A": ("sensing", "sweep"),
    "B": ("self-calibration", "calibrated"),
    "C": ("data reliability analysis", "reliability"),
    "D": ("feature extraction", "features"),
    "E": ("feature association", "association"),
    "F": ("local localisation", "localisation"),
    "G": ("post-localisation calibration", "posed"),
    "H": ("map extension", "patch"),
    "I": ("decision making", "decision"),
}
"""The blocks of Fig. 5: letter, name, and the attribute of a Step that holds what the block made."""

SIZE = 16
NAN = b"\x00\x00\x00\x00\x00\x00\xf8\x7f"


def digest(value: Any) -> str:
    """Hex digest (BLAKE2b, 128 bits) of a value made of numbers, texts, arrays, sequences, mappings and dataclasses."""
    return hashlib.blake2b(canonical(value), digest_size=SIZE).hexdigest()


def canonical(value: Any) -> bytes:
    """The canonical bytes of a value. Raises TypeError for what has none."""
    out = bytearray()
    _write(out, value)
    return bytes(out)


def _write(out: bytearray, value: Any) -> None:
    if isinstance(value, float):
        out += b"d" + _float_bytes(value)
    elif isinstance(value, bool):
        out += b"t" if value else b"f"
    elif isinstance(value, int):
        out += b"i%d;" % value
    elif isinstance(value, str):
        data = value.encode()
        out += b"s%d;" % len(data) + data
    elif value is None:
        out += b"n"
    elif isinstance(value, np.ndarray):
        _write_array(out, value)
    else:
        _write_parts(out, value)


def _write_parts(out: bytearray, value: Any) -> None:
    if isinstance(value, tuple | list):
        out += b"l%d;" % len(value)
        for item in value:
            _write(out, item)
    elif is_dataclass(value):
        names = _names(value.__class__)
        out += b"c%d;" % len(names)
        for name in names:
            out += name.encode() + b"="
            _write(out, getattr(value, name))
    elif isinstance(value, Mapping):
        out += b"m%d;" % len(value)
        for key in sorted(value):
            _write(out, key)
            _write(out, value[key])
    else:
        raise TypeError(f"{type(value).__name__} has no canonical bytes")


@cache
def _names(kind: Any) -> tuple[str, ...]:
    return tuple(entry.name for entry in fields(kind))


def _float_bytes(value: float) -> bytes:
    return struct.pack("<d", value + 0.0) if value == value else NAN  # noqa: PLR0124  # −0.0 + 0.0 is 0.0


def _write_array(out: bytearray, value: np.ndarray[Any, np.dtype[Any]]) -> None:
    kind = value.dtype.kind
    if kind not in "biuf":
        raise TypeError(f"an array of {value.dtype} has no canonical bytes")
    if kind == "f":
        value = np.where(np.isnan(value), np.nan, value + 0.0).astype(value.dtype)
    shape = ",".join(str(n) for n in value.shape)
    out += f"a{kind}{value.dtype.itemsize}:{shape};".encode()
    out += np.ascontiguousarray(value).astype(value.dtype.newbyteorder("<"), copy=False).tobytes()


def step_digests(step: Step) -> dict[str, str]:
    """One digest for what each block of Fig. 5 made of the sweep, by the block's letter."""
    return {letter: digest(getattr(step, attribute)) for letter, (_, attribute) in BLOCKS.items()}


def grid_digest(grid: Grid) -> str:
    """Digest of a whole map; tiles that hold nothing do not count."""
    tiles = {f"{i},{j}": tile for (i, j), tile in grid.tiles.items() if tile.any()}
    return digest((grid.cell_m, grid.occupied_from, grid.free_from, tiles))


class RunDigest:
    """The digest of a run as it grows: of its identity, then of every block of every sweep, at last of its map."""

    def __init__(self, identity: Any) -> None:
        self.chain = digest(identity)
        self._grid: Grid | None = None

    def add(self, step: Step) -> dict[str, str]:
        """Take one step in; its blocks' digests. `chain` then is the digest of everything up to this sweep."""
        digests = step_digests(step)
        self.chain = digest((self.chain, digests))
        self._grid = step.state.grid
        return digests

    def map_digest(self) -> str:
        """Digest of the map so far."""
        return grid_digest(self._grid) if self._grid is not None else digest(None)

    def result(self) -> str:
        """The run's digest."""
        return digest((self.chain, self.map_digest()))
