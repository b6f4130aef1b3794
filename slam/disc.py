"""The disc of cells around a station, each by its bearing and its distance: what a turning sonar paints on.

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

_STEP = 2.0 * PI / BINS
_PHASES = 2
"""A station is taken to stand on the nearest half of a cell."""


@dataclass(frozen=True)
class Disc:
    """Cells (h, w), row = y, from column `left` and row `bottom` of the grid on; `bins` their directions from the
    station, `ranges` their distances in metres."""

    left: int
    bottom: int
    bins: Ints
    ranges: Floats

    def nearer(self, profile: Floats) -> Bools:
        """Which cells lie nearer than the profile (BINS,) m says for their direction."""
        return np.asarray(self.ranges < profile[self.bins])


def disc_around(x: float, y: float, reach_m: float, cell_m: float) -> Disc:
    """The cells within `reach_m` of (x, y) and a little more, as a square."""
    radius = int(reach_m / cell_m) + 2
    radius += -radius % 16
    halves = [int(value / cell_m * _PHASES // 1.0) for value in (x, y)]
    bins, ranges = _table(radius, halves[0] % _PHASES, halves[1] % _PHASES)
    return Disc(halves[0] // _PHASES - radius, halves[1] // _PHASES - radius, bins, ranges * cell_m)


@cache
def _table(radius: int, phase_x: int, phase_y: int) -> tuple[Ints, Floats]:
    """Direction and distance (in cells) of the cells around a station that stands so far within the middle one."""
    step = np.arange(-radius, radius + 1).astype(np.float64)
    dx = step + (0.5 - (phase_x + 0.5) / _PHASES)
    dy = step + (0.5 - (phase_y + 0.5) / _PHASES)
    x, y = np.tile(dx, len(dy)), np.repeat(dy, len(dx))
    bins = bins_of(dmath.atan2(y, x))
    shape = (len(dy), len(dx))
    return bins.reshape(shape), dmath.hypot(x, y).reshape(shape)


def bins_of(angle: Floats) -> Ints:
    """The bins of angles in rad."""
    return np.asarray(np.floor((angle + PI) / _STEP).astype(np.int64) % BINS)


def angles_of(bins: Ints) -> Floats:
    """The middle of each bin, rad."""
    return (bins.astype(np.float64) + 0.5) * _STEP - PI


RAYS: tuple[Floats, Floats] = dmath.sincos(angles_of(np.arange(BINS)))
"""Sine and cosine of the middle of each bin."""


def bins_between(first: float, last: float) -> Ints:
    """All bins whose middle lies on the shorter way from one angle to the other; at least the middle one's."""
    turn = last - first
    turn -= 2.0 * PI * float(np.rint(turn / (2.0 * PI)))
    low = first if turn >= 0.0 else first + turn
    begin = int(np.ceil((low + PI) / _STEP - 0.5))
    end = int(np.floor((low + abs(turn) + PI) / _STEP - 0.5))
    if end < begin:
        return bins_of(np.array([low + 0.5 * abs(turn)]))
    return np.arange(begin, end + 1) % BINS


def bins_about(angles: Floats, half: float) -> Ints:
    """For each of the angles (n,) the bins (n, m) not farther from it than half an angle."""
    count = int(half / _STEP)
    return np.asarray((bins_of(angles)[:, None] + np.arange(-count, count + 1)) % BINS)
