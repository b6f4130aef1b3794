"""What a sweep did not hear: how far off, in each direction, a wall square to it would have been heard and was not.

A wall gives no echo when it is seen askew, so silence alone says nothing; but straight ahead a wall answers. Where most
readings towards one direction were silent, or came from farther out, no wall stands nearer at right angles to it: that
is what tells a doorway from a wall that goes on. Must not know: poses, the map, what is drawn.
"""

import numpy as np

from slam import dmath
from slam.arcs import Beams
from slam.dmath import PI, Floats
from slam.sweep import Ints

DIRECTIONS = 90
"""Of a profile: 4° each, the first just after −π."""

STEP_M = 0.05
STEPS = 64
"""What is farther than 3.2 m away is not asked for."""

WINDOW = 2
"""Readings of so many directions to either side count too: ±10°, inside nearly every wall's half beam."""

SHARE = 5
"""A wall is missing where not even one in so many readings is as near: some materials answer six pings in ten."""

LEAST = 8
"""Fewer readings say nothing."""

ASIDE_M = 0.2
"""Readings of a driving sweep, taken so far beside its station, look at another place."""


def unheard(beams: Beams) -> Floats:
    """So many metres (DIRECTIONS,) off there would have been an echo of a wall square to that direction."""
    sine, cosine = dmath.sincos(beams.axis)
    ahead = beams.origin[:, 0] * cosine + beams.origin[:, 1] * sine
    aside = np.abs(beams.origin[:, 1] * cosine - beams.origin[:, 0] * sine)
    kept = aside <= ASIDE_M
    far = np.minimum(np.where(beams.echo, beams.distance + ahead, np.inf) / STEP_M, float(STEPS))[kept]
    steps = np.maximum(np.floor(far), 0.0).astype(np.int64)
    cells = directions_of(beams.axis[kept]) * (STEPS + 1) + steps
    counts = np.bincount(cells, minlength=DIRECTIONS * (STEPS + 1)).reshape(DIRECTIONS, STEPS + 1)
    near = np.cumsum(counts, axis=1)
    round_ = np.concatenate([near[-WINDOW:], near, near[:WINDOW]])
    near = round_[:DIRECTIONS].copy()
    for k in range(1, 2 * WINDOW + 1):
        near += round_[k : DIRECTIONS + k]
    total = near[:, -1]
    first = (near * SHARE >= total[:, None]).argmax(axis=1)
    return np.where(total >= LEAST, first.astype(np.float64) * STEP_M, 0.0)


def directions_of(angle: Floats) -> Ints:
    """The numbers of the directions that angles in rad lie in."""
    return np.asarray(np.floor((angle + PI) * (DIRECTIONS / (2.0 * PI))).astype(np.int64) % DIRECTIONS)


def missing(
    gaps: Floats, stations: Floats, profiles: Floats, inside_m: float = 0.05, short_m: float = 0.15
) -> tuple[Ints, Ints, Floats]:
    """Where a wall in one of the gaps (g, 4) would have been heard from one of the stations (s, 3), and was not.

    `profiles` (s, DIRECTIONS) are the stations' own. Returns the numbers (k,) of such gaps and of the stations, and the
    ways (k, 4) of sound, from there to just before the wall.
    """
    dx, dy = gaps[:, 2] - gaps[:, 0], gaps[:, 3] - gaps[:, 1]
    length = np.maximum(np.sqrt(dx * dx + dy * dy), 1e-9)
    ux, uy = dx / length, dy / length
    x, y = stations[:, 0] - gaps[:, :1], stations[:, 1] - gaps[:, 1:2]
    place, off = ux[:, None] * x + uy[:, None] * y, ux[:, None] * y - uy[:, None] * x
    far = np.abs(off)
    may = (place > inside_m) & (place < length[:, None] - inside_m) & (far < STEPS * STEP_M - short_m) & (far > short_m)
    gap, station = np.nonzero(may)
    if len(gap) == 0:
        return gap, station, np.zeros((0, 4))
    side = np.where(off[gap, station] > 0.0, 1.0, -1.0)
    nx, ny = uy[gap] * side, -ux[gap] * side
    towards = directions_of(dmath.atan2(ny, nx) - stations[station, 2])
    seen = profiles[station, towards] > far[gap, station] + short_m
    gap, station, far = gap[seen], station[seen], far[gap, station][seen] - short_m
    x0, y0 = stations[station, 0], stations[station, 1]
    ways = np.stack([x0, y0, x0 + far * nx[seen], y0 + far * ny[seen]], axis=1)
    return gap, station, ways
