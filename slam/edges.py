"""The edges of an RCD: the two bearings between which a surface answers, as all sonars that see it have them.

Must not know: what the surface is.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from slam import dmath
from slam.arcs import Arc, Beams
from slam.geometry import wrap
from slam.parallax import for_point
from slam.sweep import Ints

LIKELIER = 10.0
"""So many times likelier is an edge where a sonar puts it than elsewhere."""
POINT_MARGIN = 9.0
"""χ² by which the sonars must agree better on a point before their edges are taken for a point's."""
CUT_MARGIN = 9.0
"""χ² by which one way to cut an RCD in two must explain its readings better than the other."""


@dataclass(frozen=True)
class Edges:
    """Where a thing comes into view and leaves it, `low` and `high` rad from the bearing `reference`.

    `sonars` is how many see it, `readings` (n,) those that are part of it, `parallax` as in `Rcd`.
    """

    reference: float
    low: float
    high: float
    sonars: int
    readings: Ints
    parallax: float

    @property
    def width(self) -> float:
        """The angle over which it answers, rad."""
        return self.high - self.low

    @property
    def middle(self) -> float:
        """The bearing midway between them, rad."""
        return wrap(self.reference + 0.5 * (self.low + self.high))


def find_edges(arcs: list[Arc]) -> Edges:
    """The edges of the thing whose arcs these are; a point's as F's origin would see them."""
    reference, parallax = arcs[0].bearing, for_point(arcs)
    shift = [
        wrap(arc.bearing - reference) - arc.bearing + (arc.aside if parallax > POINT_MARGIN else 0.0) for arc in arcs
    ]
    return Edges(
        reference=reference,
        low=_edge([(arc.before + s, arc.first + s) for arc, s in zip(arcs, shift, strict=True)]),
        high=_edge([(arc.last + s, arc.after + s) for arc, s in zip(arcs, shift, strict=True)]),
        sonars=len({arc.sonar for arc in arcs}),
        readings=np.array(sorted({r for arc in arcs for r in arc.readings}), dtype=np.int64),
        parallax=parallax,
    )


def _edge(gaps: list[tuple[float, float]]) -> float:
    """Where the edge is to be expected.

    Each sonar puts it between a reading that is in its arc and one that is not: it is there, or the sonar has heard
    something wild. Steps of 4° and eight sonars fix it to some tenths.
    """
    bounds = sorted(angle for gap in gaps for angle in gap)
    weights, moments = [], []
    for low, high in pairwise(bounds):
        at, weight = 0.5 * (low + high), high - low
        for begin, end in gaps:
            if begin <= at <= end:
                weight *= LIKELIER
        weights.append(weight)
        moments.append(weight * (at - bounds[0]))
    whole = dmath.ordered_sum(weights)
    return bounds[0] + dmath.ordered_sum(moments) / whole if whole > 0.0 else bounds[0]


def nearer_side(edges: Edges, plain: float, beams: Beams) -> tuple[float, Ints] | None:
    """Of a surface and a farther thing beside it: the surface's bearing and its readings, or None if it does not show.

    A sonar reads what is nearest: the surface over its whole `plain` width (rad) from its own edge on, the other thing
    over what is left. Of the two ways to cut, one explains the readings better.
    """
    low, high = wrap(edges.reference + edges.low + 0.5 * plain), wrap(edges.reference + edges.high - 0.5 * plain)
    first, second = _cut(edges, low, high, plain, beams), _cut(edges, high, low, plain, beams)
    if first is None or second is None:
        return None
    better, worse = (first, second) if first.off < second.off else (second, first)
    clear = (worse.off - better.off) * float(len(edges.readings)) >= CUT_MARGIN * better.off
    return (better.bearing, better.readings) if clear and better.farther > 0.0 else None


@dataclass(frozen=True)
class _Cut:
    """A surface at `bearing` with these `readings`, the rest lying `farther` m; what stays unexplained is `off` m²."""

    bearing: float
    readings: Ints
    farther: float
    off: float


def _cut(edges: Edges, near: float, far: float, plain: float, beams: Beams) -> _Cut | None:
    of_near = np.abs(wrap(beams.axis[edges.readings] - near)) <= 0.5 * plain
    ours, others = edges.readings[of_near], edges.readings[~of_near]
    if len(ours) < 3 or len(others) < 3:
        return None
    at, beyond = beams.levels(near, ours), beams.levels(far, others)
    distance, farther = dmath.mean(at), dmath.mean(beyond)
    off = dmath.total((at - distance) * (at - distance)) + dmath.total((beyond - farther) * (beyond - farther))
    return _Cut(near, ours, farther - distance, off)
