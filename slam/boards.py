"""Masks of cells as one long integer, one bit a cell: a whole map is moved by a cell, or joined, in one operation.

Bit `row · stride + column` stands for a cell; `stride` is a multiple of 8 and leaves spare columns, always 0, at the
end of each row, so that what is moved sideways falls out of the mask and not into the next row.
"""

import numpy as np

from slam.geometry import Bools
from slam.sweep import Ints


def stride_of(width: int, spare: int) -> int:
    """Bits a row for so many columns and at least so many spare ones."""
    return (width + spare + 7) // 8 * 8


def board(mask: Bools, stride: int) -> int:
    """The mask (h, w) as a board."""
    packed = np.zeros((mask.shape[0], stride // 8), dtype=np.uint8)
    bits = np.packbits(mask, axis=1, bitorder="little")
    packed[:, : bits.shape[1]] = bits
    return int.from_bytes(packed.tobytes(), "little")


def cells(board: int) -> Ints:
    """The places (k,) of its bits, ascending: row · stride + column."""
    data = np.frombuffer(board.to_bytes((board.bit_length() + 7) // 8, "little"), dtype=np.uint8)
    filled = np.flatnonzero(data)
    bits = np.unpackbits(data[filled, None], axis=1, bitorder="little")
    return np.asarray((filled[:, None] * 8 + np.arange(8))[bits > 0])


def as_bytes(board: int, stride: int, rows: int) -> bytes:
    """One byte a bit, 0 or 1, of so many rows."""
    data = np.frombuffer(board.to_bytes(rows * stride // 8, "little"), dtype=np.uint8)
    return np.unpackbits(data, bitorder="little").tobytes()


def within(board: int, stride: int, radius: int) -> int:
    """All cells within `radius` cells of one of the board's; the spare columns must be at least as many.

    Above the last row and in spare columns stand bits that are no cells: mask them.
    """
    wide = [board]
    for reach in range(1, radius + 1):
        wide.append(wide[-1] | (board << reach) | (board >> reach))
    result = wide[radius]
    for dy in range(1, radius + 1):
        reach = max(dx for dx in range(radius + 1) if dx * dx + dy * dy <= radius * radius)
        result |= (wide[reach] << dy * stride) | (wide[reach] >> dy * stride)
    return result
