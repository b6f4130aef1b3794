"""What one sweep gives to the map, in its own frame F: kept, so that it can be drawn again from another pose.

Must not know: poses, the grid, weights.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.faint import faint_things
from slam.features import Features
from slam.geometry import Bools
from slam.reliability import ALONE, NEAR_RCD, Reliability
from slam.self_calibration import Calibrated
from slam.silence import DIRECTIONS, unheard
from slam.sweep import Ints


@dataclass(frozen=True)
class Sight:
    """The n things that were seen, RCDs first, nearest first, then faint things; metres and rad in F.

    A thing: `foot` (n, 2) where it was heard, or where the lines of two nearer ones meet if it is taken for their
    corner; its `bearing` (n,); `half` (n,) how wide a faint thing is to either side, `faint` (n,) whether it is one;
    `support` (n,) how many readings of class (ii) sharpen it; `wall` (n,) its number among the sweep's walls (−1: none
    of them). `unheard` (DIRECTIONS,) says how far away nothing stands square to that direction, `heard` that there was
    an echo at all. `beams` (k, 5): origin x, y, axis, reach, half beam of each echo, kept only if asked for.
    """

    foot: Floats
    bearing: Floats
    half: Floats
    faint: Bools
    support: Ints
    wall: Ints
    unheard: Floats
    heard: bool
    beams: Floats


def sight_of(
    calibrated: Calibrated, reliability: Reliability, features: Features, reach_m: float, *, every_beam: bool
) -> Sight:
    """The sweep's sight, faint things no farther away than that; nothing if there was no echo at all."""
    beams = calibrated.beams
    echo, none = beams.echo, np.zeros(0)
    if not bool(echo.any()):
        whole = np.zeros(0, dtype=np.int64)
        return Sight(np.zeros((0, 2)), none, none, np.zeros(0, dtype=bool), whole, whole,
                     np.zeros(DIRECTIONS), False, np.zeros((0, 5)))  # fmt: skip
    rcds = reliability.rcds
    bearing, distance = np.array([rcd.bearing for rcd in rcds]), np.array([rcd.distance for rcd in rcds])
    sine, cosine = dmath.sincos(bearing)
    foot = np.stack([distance * cosine, distance * sine], axis=1)
    for corner in features.corners:
        foot[corner.rcd] = corner.point
    wall = np.full(len(rcds), -1, dtype=np.int64)
    wall[[each.rcd for each in features.walls]] = np.arange(len(features.walls))
    near = reliability.rcd_of[reliability.reading_class == NEAR_RCD]
    support = np.bincount(near, minlength=len(rcds)).astype(np.int64)
    faint = faint_things(beams, echo & (reliability.reading_class == ALONE), reach_m)
    more = len(faint.bearing)
    kept = echo if every_beam else np.zeros(len(echo), dtype=bool)
    rows = (
        beams.origin,
        *(each[:, None] for each in (beams.axis, beams.distance, np.full(len(echo), beams.half_beam))),
    )
    return Sight(
        foot=np.concatenate([foot, faint.foot]),
        bearing=np.concatenate([bearing, faint.bearing]),
        half=np.concatenate([np.zeros(len(rcds)), faint.half]),
        faint=np.arange(len(rcds) + more) >= len(rcds),
        support=np.concatenate([support, np.zeros(more, dtype=np.int64)]),
        wall=np.concatenate([wall, np.full(more, -1)]),
        unheard=unheard(beams),
        heard=True,
        beams=np.concatenate(rows, axis=1)[kept],
    )
