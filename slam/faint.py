"""Faint things: readings that belong to no RCD, but agree with one another.

Edges, poles and cloth answer too narrowly, or too seldom, to make an arc. A reading that stands alone is wrong nine
times in ten; five that agree in distance and lie within one beam are right nine times in ten, and the middle of their
bearings says where. Must not know: poses, the map, weights.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.arcs import Beams
from slam.dmath import DEGREE, Floats
from slam.geometry import Bools, wrap

WITHIN_DEG = 13.0
"""A thing is heard so far to either side of the axis."""

NEAR_M = 0.04
"""Distances agree."""

LEAST = 5
"""So many agree, or it is nothing."""

POINT_DEG = 7.0
"""What is heard no farther than this to either side may be a point."""

HALF_M = 0.06
"""Nothing is narrower, as far as a sonar can tell."""

GONE = -(1 << 30)
"""The count of a reading that belongs to a thing already."""


@dataclass(frozen=True)
class Faint:
    """f faint things: heard at `foot` (f, 2) in F, in direction `bearing` (f,), as wide as `half` (f,) m to either
    side."""

    foot: Floats
    bearing: Floats
    half: Floats


def faint_things(beams: Beams, kept: Bools, reach_m: float) -> Faint:
    """What those readings agree on, no farther away than that; the things that most agree on come first."""
    axis, origin = beams.axis[kept], beams.origin[kept]
    sine, cosine = dmath.sincos(axis)
    distance = beams.distance[kept] + origin[:, 0] * cosine + origin[:, 1] * sine
    near = np.flatnonzero(distance <= reach_m)
    near = near[np.argsort(distance[near], kind="stable")]
    axis, distance = axis[near], distance[near]
    agree = _agreement(axis, distance)
    counts = np.count_nonzero(agree, axis=1)
    found = []
    while len(counts) and counts[middle := int(counts.argmax())] + 1 >= LEAST:
        members = np.flatnonzero(agree[middle] & (counts >= 0))
        members = np.append(members, middle)
        off = np.asarray(wrap(axis[members] - axis[middle]))
        count = float(len(members))
        found.append((
            float(axis[middle]) + float(off.cumsum()[-1]) / count,
            float(distance[members].cumsum()[-1]) / count,
            (float(off.max()) - float(off.min())) / 2.0,
        ))  # fmt: skip
        counts -= np.count_nonzero(agree[members], axis=0)
        counts[members] = GONE
    rows = np.array(found).reshape(-1, 3)
    sine, cosine = dmath.sincos(rows[:, 0])
    wide_sine, wide_cosine = dmath.sincos(np.maximum(rows[:, 2] - POINT_DEG * DEGREE, 0.0))
    foot = np.stack([rows[:, 1] * cosine, rows[:, 1] * sine], axis=1)
    half = np.maximum(rows[:, 1] * wide_sine / wide_cosine, HALF_M)
    return Faint(foot, np.asarray(wrap(rows[:, 0])), half)


def _agreement(axis: Floats, distance: Floats) -> Bools:
    """Which readings (k, k) agree with which others; they come in order of their distances."""
    at = np.arange(len(axis))
    count = np.searchsorted(distance, distance + NEAR_M, side="right") - at - 1
    one = np.repeat(at, count)
    other = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(count) - count, count)
    close = np.abs(wrap(axis[one] - axis[other])) <= WITHIN_DEG * DEGREE
    one, other = one[close], other[close]
    agree = np.zeros((len(axis), len(axis)), dtype=bool)
    agree[one, other] = True
    agree[other, one] = True
    return agree
