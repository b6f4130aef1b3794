"""Parallax: sonars that stand apart agree on the direction of a plane's normal, and disagree on that of a near point.

The sonars of a ring look past its centre by some centimetres. A corner, an edge or a pole 1 m away is so seen some
degrees further round from one than from another, which arcs good to a degree show. Must not know: blocks, sweeps.
"""

import numpy as np

from slam.arcs import Arc
from slam.dmath import DEGREE, Floats, median, total
from slam.geometry import wrap

ARC_SIGMA = 1.0 * DEGREE
"""How well an arc between steps of 4° tells a bearing."""
WILD = 3.0
"""In standard deviations: what is farther off says no more than that."""


def for_point(arcs: list[Arc]) -> float:
    """By how much χ² the arcs of one thing speak for a point; below 0 for a plane."""
    bearing = np.array([wrap(arc.bearing - arcs[0].bearing) for arc in arcs])
    aside = np.array([arc.aside for arc in arcs])
    return _disagreement(bearing) - _disagreement(bearing + aside)


def _disagreement(bearing: Floats) -> float:
    off = (bearing - median(bearing.tolist())) / ARC_SIGMA
    return total(np.minimum(off * off, WILD * WILD))
