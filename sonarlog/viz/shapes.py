"""The shapes that an inspection is drawn from: points, lines and rasters in the map's frame, metres.

Must not know: Rerun, the algorithm.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sonarlog.log import Floats

Colour = tuple[int, int, int]


@dataclass(frozen=True)
class Dots:
    """Points (n, 2) of one colour; `size` in screen points; labels are shown beside them."""

    points: Floats
    colour: Colour
    size: float = 2.0
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Strips:
    """Open polylines, each (k, 2), with a colour each (or one for all); `width` in screen points."""

    lines: Sequence[Floats]
    colours: Sequence[Colour]
    width: float = 1.5
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Raster:
    """Square pixels of `cell_m`, (height, width) grey or (height, width, 4) RGBA, uint8, rows upwards.

    The lower left corner lies at (x, y) m.
    """

    pixels: NDArray[np.uint8]
    x: float
    y: float
    cell_m: float


Shape = Dots | Strips | Raster
