"""What one sweep gives to the map, in its own frame F: kept, so that it can be drawn again from another pose.

Must not know: poses, the grid, weights.
"""

from dataclasses import dataclass

import numpy as np

from slam.dmath import Floats
from slam.features import Features
from slam.geometry import Bools, Segment, segment
from slam.reliability import ALONE, NEAR_RCD, Reliability
from slam.self_calibration import Calibrated


@dataclass(frozen=True)
class Thing:
    """An RCD: the flat surface it would be, and how many readings of class (ii) sharpen it.

    `wall` is its number among the sweep's walls (−1: none of them); `corner` where the lines of two nearer ones meet.
    """

    surface: Segment
    support: int
    wall: int
    corner: tuple[float, float] | None


@dataclass(frozen=True)
class Sight:
    """The things seen, nearest first, and single beams (k, 4): origin x, y, axis rad, reach m; whether each `echoed`.

    Of the beams only those of class (iii) are kept, unless all were asked for; `half_beam` rad is theirs.
    """

    things: tuple[Thing, ...]
    beams: Floats
    echoed: Bools
    half_beam: float


def sight_of(calibrated: Calibrated, reliability: Reliability, features: Features, *, every_beam: bool) -> Sight:
    """The sweep's sight; nothing if there was no echo at all."""
    beams = calibrated.beams
    echo = beams.echo
    if not bool(echo.any()):
        return Sight((), np.zeros((0, 4)), np.zeros(0, dtype=bool), beams.half_beam)
    near = reliability.rcd_of[reliability.reading_class == NEAR_RCD]
    support = np.bincount(near, minlength=len(reliability.rcds)).tolist()
    wall_of = {wall.rcd: k for k, wall in enumerate(features.walls)}
    corner_of = {corner.rcd: corner.point for corner in features.corners}
    things = tuple(
        Thing(
            segment(rcd.bearing, rcd.distance, rcd.left, rcd.right),
            support[k],
            wall_of.get(k, -1),
            corner_of.get(k),
        )
        for k, rcd in enumerate(reliability.rcds)
    )
    kept = np.ones(len(echo), dtype=bool) if every_beam else reliability.reading_class == ALONE
    rows = np.concatenate([beams.origin, beams.axis[:, None], beams.distance[:, None]], axis=1)
    return Sight(things, rows[kept], echo[kept], beams.half_beam)
