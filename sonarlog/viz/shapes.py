"""The shapes that an inspection is drawn from: points, lines, labels and rasters in the map's frame, metres.

Must not know: Rerun, the algorithm.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sonarlog.log import Floats

Colour = tuple[int, ...]
"""Red, green, blue and, if it is not opaque, alpha: 0 to 255."""

# With the colours of `sonarlog.picture`: dark enough to be seen on grey and on white.
GREY: Colour = (110, 110, 110)
BLACK: Colour = (20, 20, 20)
WINE: Colour = (136, 34, 85)


@dataclass(frozen=True)
class Dots:
    """Points (n, 2) of one colour, or of one each; `size` in screen points."""

    points: Floats
    colour: Colour | Sequence[Colour]
    size: float = 2.0


@dataclass(frozen=True)
class Labels:
    """Words at points (n, 2)."""

    points: Floats
    words: tuple[str, ...]


@dataclass(frozen=True)
class Strips:
    """Open polylines, each (k, 2), with a colour each (or one for all); `width` in screen points."""

    lines: Sequence[Floats]
    colours: Sequence[Colour]
    width: float = 1.5


@dataclass(frozen=True)
class Raster:
    """Square pixels of `cell_m`, (height, width) grey or (height, width, 4) RGBA, uint8, rows upwards.

    The lower left corner lies at (x, y) m.
    """

    pixels: NDArray[np.uint8]
    x: float
    y: float
    cell_m: float


Shape = Dots | Labels | Strips | Raster


def circle(x: float, y: float, radius: float) -> Floats:
    """A closed line (25, 2)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 25)
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)])


def crosses(points: Floats, size: float, *, upright: bool) -> list[Floats]:
    """A mark at each of the points (n, 2): + if upright, else ×; `size` m from the middle to an end."""
    arms = np.array([[1.0, 0.0], [0.0, 1.0]]) if upright else np.array([[0.7, 0.7], [0.7, -0.7]])
    return [np.array([point - size * arm, point + size * arm]) for point in points.reshape(-1, 2) for arm in arms]


def diamonds(points: Floats, size: float) -> list[Floats]:
    """A ◇ at each of the points (n, 2)."""
    rim = size * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0]])
    return [point + rim for point in points.reshape(-1, 2)]


def dashed(line: Floats, dash_m: float = 0.08) -> list[Floats]:
    """A polyline (k, 2) as dashes with gaps as long as they are."""
    steps = np.hypot(*np.diff(line, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    begins = np.arange(0.0, along[-1], 2.0 * dash_m)
    ends = np.minimum(begins + dash_m, along[-1])
    at = [np.column_stack([np.interp(part, along, line[:, axis]) for axis in (0, 1)]) for part in (begins, ends)]
    return [np.array(pair) for pair in zip(*at, strict=True)]


def arrow(start: Floats, end: Floats, head_m: float = 0.12) -> list[Floats]:
    """A line from start to end (2,) with a head; nothing if they are one point."""
    length = float(np.hypot(*(end - start)))
    if length < 1e-9:
        return []
    ahead = (end - start) / length * min(head_m, length)
    aside = 0.4 * np.array([-ahead[1], ahead[0]])
    return [np.array([start, end]), np.array([end - ahead + aside, end, end - ahead - aside])]
