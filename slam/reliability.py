"""Block C, data reliability analysis: regions of constant depth, and what every other reading is worth [III.C].

Class (i) readings are part of an RCD, class (ii) can be associated with one, class (iii) with none.
"""

from dataclasses import dataclass, field

import numpy as np

from slam import dmath
from slam.arcs import Arc, ArcConfig, Beams, find_arcs
from slam.clusters import cluster
from slam.dmath import DEGREE, Floats
from slam.driving import DrivingConfig, find_stretches
from slam.geometry import wrap
from slam.self_calibration import Calibrated
from slam.sweep import Ints

NO_ECHO, IN_RCD, NEAR_RCD, ALONE = 0, 1, 2, 3


@dataclass(frozen=True)
class ReliabilityConfig:
    """How arcs are found and joined, and when a reading belongs to an RCD that it is no part of."""

    arcs: ArcConfig = field(default_factory=ArcConfig)
    driving: DrivingConfig = field(default_factory=DrivingConfig)
    strong_width_deg: float = 18.0
    merged_width_deg: float = 33.0  # no surface answers over more: a wall and what stands at its end
    bearing_sigma_deg: float = 0.5  # of an RCD that all eight sonars of a ring see
    narrower_deg: float = 0.5  # an RCD is as wide as the beam, or a little wider than that …
    wider_deg: float = 3.5  # … or else something next to it shifts one of its edges
    associate_m: float = 0.10


@dataclass(frozen=True)
class Rcd:
    """A region of constant depth in F: its surface lies at `distance` m along `bearing` rad.

    `left` and `right` (m) bound what was seen of a flat surface there, along its tangent; `width` rad is the angle
    over which it answers, `spread` m the largest deviation of a reading, `sigma` rad how good the bearing is. A strong
    RCD is as wide as a wall.
    """

    bearing: float
    distance: float
    width: float
    spread: float
    left: float
    right: float
    strong: bool
    sonars: int
    readings: tuple[int, ...]
    sigma: float = 0.0


@dataclass(frozen=True)
class Reliability:
    """The RCDs, nearest first, and each reading's class (n,): NO_ECHO, IN_RCD, NEAR_RCD or ALONE.

    `rcd_of` (n,) is the RCD a reading of class (i) or (ii) belongs to, −1 for none.
    """

    rcds: tuple[Rcd, ...]
    reading_class: Ints
    rcd_of: Ints


def analyse_reliability(calibrated: Calibrated, config: ReliabilityConfig) -> Reliability:
    """Find the RCDs of the sweep and class its readings by them."""
    beams = calibrated.beams
    if calibrated.kind == "scan":
        arcs = find_arcs(beams, config.arcs, closed=True)
        rcds = [_rcd([arcs[i] for i in group], beams, config) for group in cluster(arcs, config.arcs)]
    else:
        rcds = [
            Rcd(
                bearing=s.bearing,
                distance=s.distance,
                width=0.0,
                spread=s.spread,
                sigma=dmath.hypot(s.sigma, config.bearing_sigma_deg * DEGREE),
                left=s.left,
                right=s.right,
                strong=s.sigma <= config.driving.strong_sigma_deg * DEGREE,
                sonars=1,
                readings=s.readings,
            )
            for s in find_stretches(beams, config.driving)
        ]
    rcds.sort(key=lambda rcd: (rcd.distance, rcd.bearing))
    return _classed(tuple(rcds), beams, config)


def _rcd(arcs: list[Arc], beams: Beams, config: ReliabilityConfig) -> Rcd:
    """Join arcs: the surface's normal lies midway between the two edges that the sonars see together."""
    reference = arcs[0].bearing
    low = _edge(arcs, reference, [(arc.before, arc.first) for arc in arcs])
    high = _edge(arcs, reference, [(arc.last, arc.after) for arc in arcs])
    bearing = wrap(reference + 0.5 * (low + high))
    readings = tuple(sorted({r for arc in arcs for r in arc.readings}))
    chosen = np.array(readings)
    axes = wrap(beams.axis[chosen] - bearing)
    levels = _level(beams, bearing)[chosen]
    distance = dmath.mean(levels)
    first, last = float(axes.min()), float(axes.max())
    return Rcd(
        bearing=bearing,
        distance=distance,
        width=high - low,
        spread=float(np.abs(levels - distance).max()),
        sigma=_bearing_sigma(high - low, len({arc.sonar for arc in arcs}), beams.half_beam, config),
        left=distance * _tan(first),
        right=distance * _tan(last),
        strong=config.strong_width_deg * DEGREE <= high - low <= config.merged_width_deg * DEGREE,
        sonars=len({arc.sonar for arc in arcs}),
        readings=readings,
    )


def _bearing_sigma(width: float, sonars: int, half_beam: float, config: ReliabilityConfig) -> float:
    """How good a bearing between two edges is, in rad.

    Few sonars fix the edges less well, and what is too wide or too narrow for one surface has an edge of another's.
    """
    own = config.bearing_sigma_deg * DEGREE * dmath.sqrt(8.0 / float(sonars))
    low, high = 2.0 * half_beam - config.narrower_deg * DEGREE, 2.0 * half_beam + config.wider_deg * DEGREE
    return dmath.hypot(own, max(0.0, low - width, width - high))


def _edge(arcs: list[Arc], reference: float, between: list[tuple[float, float]]) -> float:
    """Where the surface comes into view, rad from the reference.

    Each sonar puts it between a reading that is in the arc and one that is not. The median of all these bounds lies in
    every such gap if they agree, and in most if some do not; steps of 4° and eight sonars fix it to some tenths.
    """
    shift = [wrap(arc.bearing - reference) - arc.bearing for arc in arcs]
    bounds = sorted(angle + s for s, pair in zip(shift, between, strict=True) for angle in pair)
    return 0.5 * (bounds[len(bounds) // 2 - 1] + bounds[len(bounds) // 2])


def _level(beams: Beams, bearing: float) -> Floats:
    """Distance from F's origin of a surface with this normal, as each reading has it."""
    sine, cosine = dmath.sincos(bearing)
    return beams.distance + (beams.origin[:, 0] * cosine + beams.origin[:, 1] * sine)


def _tan(angle: float) -> float:
    sine, cosine = dmath.sincos(angle)
    return sine / cosine


def _classed(rcds: tuple[Rcd, ...], beams: Beams, config: ReliabilityConfig) -> Reliability:
    classes = np.where(beams.echo, ALONE, NO_ECHO)
    rcd_of = np.full(len(classes), -1, dtype=np.int64)
    best = np.full(len(classes), config.associate_m)
    for k, rcd in enumerate(rcds):
        off = np.abs(_level(beams, rcd.bearing) - rcd.distance)
        aimed = np.abs(wrap(beams.axis - rcd.bearing)) <= 0.5 * rcd.width + beams.half_beam
        nearer = (classes == ALONE) & aimed & (off <= best)
        nearer |= (rcd_of >= 0) & (classes != IN_RCD) & aimed & (off < best)
        rcd_of[nearer], best[nearer] = k, off[nearer]
        classes[nearer] = NEAR_RCD
    for k, rcd in enumerate(rcds):
        members = np.array(rcd.readings)
        classes[members], rcd_of[members] = IN_RCD, k
    return Reliability(rcds, classes.astype(np.int64), rcd_of)
