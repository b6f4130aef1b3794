"""A plain inverse sensor model, to compare with: every reading fills its cone [Moravec & Elfes 1985].

Within half a beam of the axis the cells before the range are taken to be free and those at the range occupied, whatever
else is known; readings without an echo are left out, for they would free even more that is not. It does not know that
walls are mirrors to sound, and its maps show it. Must not know: features, chains, other sweeps.
"""

import numpy as np

from slam import dmath
from slam.disc import BINS, bins_of, disc_around
from slam.evidence import Layer, cropped
from slam.geometry import Pose
from slam.grid import LIMIT
from slam.sight import Sight

OCCUPIED, FREE = 8, -4
"""Log-odds × 10 of a cell at the range of a reading (p = 0.69), and before it (p = 0.40)."""

_RAYS = 49
"""Rays of a cone: closer to one another than the bins of a disc."""


def render_cones(sight: Sight, pose: Pose, cell_m: float) -> Layer:
    """The evidence of all beams of a sweep (they must have been kept), each on its own, added up."""
    beams = sight.beams
    reach = beams[:, 3:4]
    far = float(reach.max()) + 0.5
    corners = np.array([(pose.x - far, pose.y - far), (pose.x + far, pose.y + far)])
    disc = disc_around(pose.x, pose.y, corners, cell_m)
    offset = (np.arange(_RAYS).astype(np.float64) / float(_RAYS - 1) * 2.0 - 1.0) * beams[:, 4:5]
    sine, cosine = dmath.sincos(beams[:, 2:3] + offset + pose.theta)
    origin = pose.points(beams[:, :2])
    dx = origin[:, :1] - pose.x + reach * cosine
    dy = origin[:, 1:] - pose.y + reach * sine
    ranges = int(float(disc.ranges.max()) / cell_m) + 2
    rows, number = bins_of(dmath.atan2(dy.reshape(-1), dx.reshape(-1))), np.repeat(np.arange(len(reach)), _RAYS)
    columns = np.floor(dmath.hypot(dx, dy).reshape(-1) / cell_m).astype(np.int64)
    # A beam counts once in a cell, however many of its rays end there.
    key = np.unique((number * BINS + rows) * ranges + columns)
    ends = np.bincount(key % (BINS * ranges), minlength=BINS * ranges).reshape(BINS, ranges)
    beyond = np.cumsum(ends[:, ::-1], axis=1)[:, ::-1] - ends  # beams that end farther out
    polar = np.clip(OCCUPIED * ends + FREE * beyond, -LIMIT, LIMIT)
    delta = polar[disc.bins, np.floor(disc.ranges / cell_m).astype(np.int64)]
    return cropped(disc.left, disc.bottom, delta)
