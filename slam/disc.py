"""The cells around a station, each by its bearing and its distance: what a turning sonar paints on.

Free space is a profile: so far in each direction. One look-up per cell turns it into cells, however many beams there
were. Must not know: what is painted, and with which weight.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from slam import dmath
from slam.dmath import PI, Floats
from slam.geometry import Bools
from slam.sweep import Ints

BINS = 720
"""Directions of a profile: half a degree each, the first just after −π."""

STEP_RAD = 2.0 * PI / BINS


@dataclass(frozen=True)
class Disc:
    """Cells (h, w), row = y, from column `left` and row `bottom` of the grid on; `bins` their directions from the
    station's cell, `ranges` their distances in metres."""

    left: int
    bottom: int
    bins: Ints
    ranges: Floats

    def nearer(self, profile: Floats) -> Bools:
        """Which cells lie nearer than the profile (BINS,) m says for their direction."""
        return np.asarray(self.ranges < profile[self.bins])


def disc_around(x: float, y: float, points: Floats, cell_m: float) -> Disc:
    """The cells around (x, y), as a rectangle that holds the points (n, 2) and two cells more."""
    column, row = int(x // cell_m), int(y // cell_m)
    low = np.floor(points.min(axis=0) / cell_m).astype(np.int64) - 2
    high = np.floor(points.max(axis=0) / cell_m).astype(np.int64) + 3
    left, bottom = min(int(low[0]), column - 8), min(int(low[1]), row - 8)
    right, top = max(int(high[0]), column + 9), max(int(high[1]), row + 9)
    radius = max(column - left, row - bottom, right - column, top - row)
    radius += -radius % 128
    bins, ranges = _table(radius, cell_m)
    inside = (
        slice(bottom - row + radius, top - row + radius),
        slice(left - column + radius, right - column + radius),
    )
    return Disc(left, bottom, bins[inside], ranges[inside])


@cache
def _table(radius: int, cell_m: float) -> tuple[Ints, Floats]:
    """Direction and distance in m of the cells around a station, which is taken to stand in the middle of its own."""
    step = np.arange(-radius, radius + 1).astype(np.float64)
    x, y = np.tile(step, len(step)), np.repeat(step, len(step))
    shape = (len(step), len(step))
    return bins_of(dmath.atan2(y, x)).reshape(shape), (np.sqrt(x * x + y * y) * cell_m).reshape(shape)


def bins_of(angle: Floats) -> Ints:
    """The bins of angles in rad."""
    return np.asarray(np.floor((angle + PI) / STEP_RAD).astype(np.int64) % BINS)


def angles_of(bins: Ints) -> Floats:
    """The middle of each bin, rad."""
    return (bins.astype(np.float64) + 0.5) * STEP_RAD - PI


RAYS: tuple[Floats, Floats] = dmath.sincos(angles_of(np.arange(BINS)))
"""Sine and cosine of the middle of each bin."""


def bins_about(angles: Floats, half: float) -> Ints:
    """For each of the angles (n,) the bins (n, m) not farther from it than half an angle."""
    count = int(half / STEP_RAD)
    return np.asarray((bins_of(angles)[:, None] + np.arange(-count, count + 1)) % BINS)


def depths(ends: Floats, x: float, y: float) -> Floats:
    """How far it is from (x, y) in each direction to each of n segments (n, 4): (n, BINS) m, 0 where not in the way."""
    x0, y0 = ends[:, :1] - x, ends[:, 1:2] - y
    dx, dy = ends[:, 2:3] - ends[:, :1], ends[:, 3:] - ends[:, 1:2]
    sine, cosine = RAYS
    across = cosine * dy - sine * dx
    apart = np.abs(across) > 1e-9
    safe = np.where(apart, across, 1.0)
    part, depth = (x0 * sine - y0 * cosine) / safe, (x0 * dy - y0 * dx) / safe
    return np.where(apart & (part >= 0.0) & (part <= 1.0), np.maximum(depth, 0.0), 0.0)
