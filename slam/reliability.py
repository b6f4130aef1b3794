"""Block C, data reliability analysis: regions of constant depth, and what every other reading is worth [III.C].

Class (i) readings are part of an RCD, class (ii) can be associated with one, class (iii) with none.
"""

from dataclasses import dataclass, field

import numpy as np

from slam import dmath
from slam.arcs import ArcConfig, Beams, find_arcs
from slam.clusters import cluster
from slam.dmath import DEGREE
from slam.driving import DrivingConfig, find_stretches
from slam.edges import Edges, find_edges, nearer_side
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
    bearing_sigma_deg: float = 0.3  # of an RCD that all eight sonars of a ring see
    narrower_deg: float = 0.5  # an RCD is as wide as the beam, or a little wider than that …
    wider_deg: float = 3.5  # … or else something next to it shifts one of its edges
    associate_m: float = 0.10


@dataclass(frozen=True)
class Rcd:
    """A region of constant depth in F: its surface lies at `distance` m along `bearing` rad.

    `left` and `right` (m) bound what was seen of a flat surface there, along its tangent; `width` rad is the angle
    over which it answers, `spread` m the largest deviation of a reading, `sigma` rad how good the bearing is;
    `parallax` is the χ² by which the sonars' bearings speak for a point (> 0) or a plane (< 0). A strong RCD is as wide
    as a wall.
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
    parallax: float = 0.0


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
        seen = [find_edges([arcs[i] for i in group]) for group in cluster(arcs, config.arcs)]
        plain = _plain(seen, beams, config)
        rcds = [_rcd(edges, plain, beams, config) for edges in seen]
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
                parallax=s.parallax,
            )
            for s in find_stretches(beams, config.driving)
        ]
    rcds.sort(key=lambda rcd: (rcd.distance, rcd.bearing))
    return _classed(tuple(rcds), beams, config)


def _rcd(edges: Edges, plain: float, beams: Beams, config: ReliabilityConfig) -> Rcd:
    """The normal lies midway between the edges; of a surface with something at its end, half a `plain` from its own."""
    bearing, readings = edges.middle, edges.readings
    least, most = _band(beams, config)
    off = max(0.0, least - edges.width, edges.width - most)
    if edges.width > most:
        alone = nearer_side(edges, plain, beams)
        if alone is not None:
            bearing, readings = alone
            off = 0.25 * (most - least)
    # Few sonars fix the edges less well, and what is too wide or too narrow has an edge of another's.
    own = config.bearing_sigma_deg * DEGREE * dmath.sqrt(8.0 / float(edges.sonars))
    axes = wrap(beams.axis[readings] - bearing)
    levels = beams.levels(bearing, readings)
    distance = dmath.mean(levels)
    return Rcd(
        bearing=bearing,
        distance=distance,
        width=edges.width,
        spread=float(np.abs(levels - distance).max()),
        left=distance * _tan(float(axes.min())),
        right=distance * _tan(float(axes.max())),
        strong=config.strong_width_deg * DEGREE <= edges.width <= config.merged_width_deg * DEGREE,
        sonars=edges.sonars,
        readings=tuple(edges.readings.tolist()),
        sigma=dmath.hypot(own, off),
        parallax=edges.parallax,
    )


def _band(beams: Beams, config: ReliabilityConfig) -> tuple[float, float]:
    """How wide one surface answers, rad: no less, no more."""
    return 2.0 * beams.half_beam - config.narrower_deg * DEGREE, 2.0 * beams.half_beam + config.wider_deg * DEGREE


def _plain(seen: list[Edges], beams: Beams, config: ReliabilityConfig) -> float:
    """How wide a surface by itself answers in this sweep, rad: most have nothing beside them."""
    least, most = _band(beams, config)
    return min(max(dmath.median([edges.width for edges in seen]), least), most) if seen else most


def _tan(angle: float) -> float:
    sine, cosine = dmath.sincos(angle)
    return sine / cosine


def _classed(rcds: tuple[Rcd, ...], beams: Beams, config: ReliabilityConfig) -> Reliability:
    classes = np.where(beams.echo, ALONE, NO_ECHO)
    rcd_of = np.full(len(classes), -1, dtype=np.int64)
    best = np.full(len(classes), config.associate_m)
    for k, rcd in enumerate(rcds):
        off = np.abs(beams.levels(rcd.bearing) - rcd.distance)
        aimed = np.abs(wrap(beams.axis - rcd.bearing)) <= 0.5 * rcd.width + beams.half_beam
        nearer = (classes == ALONE) & aimed & (off <= best)
        nearer |= (rcd_of >= 0) & (classes != IN_RCD) & aimed & (off < best)
        rcd_of[nearer], best[nearer] = k, off[nearer]
        classes[nearer] = NEAR_RCD
    for k, rcd in enumerate(rcds):
        members = np.array(rcd.readings)
        classes[members], rcd_of[members] = IN_RCD, k
    return Reliability(rcds, classes.astype(np.int64), rcd_of)
