"""What one sweep gives to the map, in its own frame F: kept, so that it can be drawn again from another pose.

Must not know: poses, the grid, weights.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.features import Features
from slam.geometry import Bools
from slam.reliability import ALONE, NEAR_RCD, Reliability
from slam.self_calibration import Calibrated
from slam.silence import DIRECTIONS, unheard
from slam.sweep import Ints


@dataclass(frozen=True)
class Sight:
    """The n things (RCDs) that were seen, nearest first, and k single beams; metres and rad in F.

    A thing: `foot` (n, 2) where it was heard, or where the lines of two nearer ones meet if it is taken for their
    corner; its `bearing` (n,); `support` (n,) how many readings of class (ii) sharpen it; `wall` (n,) its number among
    the sweep's walls (−1: none of them). `beams` (k, 6): origin x, y, axis, reach, cosine and sine of the axis; whether
    each `echoed` (k,). Of the beams only those of class (iii) are kept, unless all were asked for; `half_beam` rad is
    theirs. `unheard` (DIRECTIONS,) says how far away nothing stands square to that direction.
    """

    foot: Floats
    bearing: Floats
    support: Ints
    wall: Ints
    beams: Floats
    echoed: Bools
    half_beam: float
    unheard: Floats


def sight_of(calibrated: Calibrated, reliability: Reliability, features: Features, *, every_beam: bool) -> Sight:
    """The sweep's sight; nothing if there was no echo at all."""
    beams = calibrated.beams
    echo, none = beams.echo, np.zeros(0, dtype=np.int64)
    if not bool(echo.any()):
        return Sight(
            np.zeros((0, 2)),
            np.zeros(0),
            none,
            none,
            np.zeros((0, 6)),
            np.zeros(0, dtype=bool),
            beams.half_beam,
            np.zeros(DIRECTIONS),
        )
    rcds = reliability.rcds
    bearing, distance = np.array([rcd.bearing for rcd in rcds]), np.array([rcd.distance for rcd in rcds])
    sine, cosine = dmath.sincos(bearing)
    foot = np.stack([distance * cosine, distance * sine], axis=1)
    for corner in features.corners:
        foot[corner.rcd] = corner.point
    wall = np.full(len(rcds), -1, dtype=np.int64)
    wall[[each.rcd for each in features.walls]] = np.arange(len(features.walls))
    near = reliability.rcd_of[reliability.reading_class == NEAR_RCD]
    kept = np.ones(len(echo), dtype=bool) if every_beam else echo & (reliability.reading_class == ALONE)
    sine, cosine = dmath.sincos(beams.axis[kept])
    rows = [beams.origin[kept], *(each[:, None] for each in (beams.axis[kept], beams.distance[kept], cosine, sine))]
    support = np.bincount(near, minlength=len(rcds)).astype(np.int64)
    return Sight(
        foot, bearing, support, wall, np.concatenate(rows, axis=1), echo[kept], beams.half_beam, unheard(beams)
    )
