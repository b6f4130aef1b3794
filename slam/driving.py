"""Regions of constant depth seen while driving: runs of one sonar's readings along one straight surface.

Where a turning robot sweeps its beam over a wall, a driving one carries the beam along it. Readings r at origins o
from a wall (φ, D) satisfy r + o·n(φ) = D; over a long enough baseline they give φ, which must lie inside the beam. From
a corner, an edge or a pole p they satisfy r = |p − o|, which is nearly the same: how far the two fits differ tells.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.arcs import Beams
from slam.dmath import DEGREE, PI, Floats
from slam.geometry import wrap
from slam.sweep import Ints

NOISE_M, USUAL = 0.01, 4.0
"""A reading's usual noise, and how many readings' worth that is believed: few may lie on one line by chance."""
SLANTING, RATHER_A_POINT = 65.0 * DEGREE, 3.2
"""Nearer than that to the way driven a wall is rare: four times of five, it is a corner or an edge. In χ²."""


@dataclass(frozen=True)
class DrivingConfig:
    """What makes a stretch of wall seen while driving."""

    spread_m: float = 0.03
    min_readings: int = 4
    min_baseline_m: float = 0.20
    strong_sigma_deg: float = 1.5  # of the bearing, from what the readings leave over
    max_turn_deg: float = 6.0


@dataclass(frozen=True)
class Stretch:
    """A straight surface at `distance` m along `bearing` rad in F, seen from `left` to `right` m of its foot.

    What is rather a point (`parallax` > 0) is where F's origin would see that.
    """

    bearing: float
    distance: float
    left: float
    right: float
    sigma: float  # of the bearing, rad
    spread: float
    readings: tuple[int, ...]
    parallax: float = 0.0  # by how much χ² it is rather a point


def find_stretches(beams: Beams, config: DrivingConfig) -> list[Stretch]:
    """For each sonar the longest runs of consecutive echoes that lie on one line."""
    found: list[Stretch] = []
    for sonar in range(int(beams.sonar.max()) + 1 if len(beams.sonar) else 0):
        track = np.flatnonzero(beams.sonar == sonar)
        start = 0
        while start + config.min_readings <= len(track):
            best = None
            for end in range(start + config.min_readings, len(track) + 1):
                stretch = _fit(beams, track[start:end], config)
                best = (stretch, end) if stretch is not None else best
            if best is None:
                start += 1
            else:
                found.append(best[0])
                start = best[1]
    return found


def _fit(beams: Beams, members: Ints, config: DrivingConfig) -> Stretch | None:
    """The line of these readings, or None if they are not on one that the beam can meet at right angles."""
    axis = beams.axis[members]
    middle = float(axis[0]) + dmath.mean(wrap(axis - float(axis[0])))
    if not bool(beams.echo[members].all()) or float(np.abs(wrap(axis - middle)).max()) > config.max_turn_deg * DEGREE:
        return None
    sine, cosine = dmath.sincos(middle)
    along_axis = beams.origin[members, 0] * cosine + beams.origin[members, 1] * sine
    across = beams.origin[members, 1] * cosine - beams.origin[members, 0] * sine
    baseline = float(across.max() - across.min())
    if baseline < config.min_baseline_m:
        return None
    tilt = _tilt(beams.distance[members], along_axis, across)
    if abs(tilt) > beams.half_beam:
        return None
    bearing = wrap(middle + tilt)
    levels = _across(beams, members, bearing, ahead=True)
    distance = dmath.mean(levels)
    spread = float(np.abs(levels - distance).max())
    if spread > config.spread_m:
        return None
    feet = _across(beams, members, bearing, ahead=False)
    # The fit's own error: what it leaves over, against how far the readings reach. A step in the wall leaves much over.
    left_over, reach = dmath.total((levels - distance) * (levels - distance)), feet - dmath.mean(feet)
    usual, freedom = USUAL * NOISE_M * NOISE_M, float(len(members)) - 2.0 + USUAL
    sigma = dmath.sqrt((left_over + usual) / (freedom * dmath.total(reach * reach)))
    (x, y), beyond = _point(beams, members, bearing)
    parallax = (left_over - beyond) * freedom / (min(left_over, beyond) + usual) + _slanting(beams, members, bearing)
    readings = tuple(members.tolist())
    if parallax > 0.0:
        return Stretch(dmath.atan2(y, x), dmath.hypot(x, y), 0.0, 0.0, sigma, spread, readings, parallax)
    return Stretch(bearing, distance, float(feet.min()), float(feet.max()), sigma, spread, readings, parallax)


def _slanting(beams: Beams, members: Ints, bearing: float) -> float:
    """By how much χ² it is rather a point because the robot drives towards it, or away from it."""
    first, last = beams.origin[members[0]], beams.origin[members[-1]]
    way = dmath.atan2(float(last[1] - first[1]), float(last[0] - first[0]))
    off = abs(wrap(bearing - way))
    return RATHER_A_POINT if min(off, PI - off) < SLANTING else 0.0


def _point(beams: Beams, members: Ints, bearing: float) -> tuple[tuple[float, float], float]:
    """The point (x, y) of F that these readings come from if they come from one, by least squares; what is left, m²."""
    sine, cosine = dmath.sincos(bearing)
    far, origin = beams.distance[members], beams.origin[members]
    x = dmath.mean(origin[:, 0]) + dmath.mean(far) * cosine
    y = dmath.mean(origin[:, 1]) + dmath.mean(far) * sine
    for _ in range(3):
        dx, dy = x - origin[:, 0], y - origin[:, 1]
        reach = np.maximum(dmath.hypot(dx, dy), 1e-3)
        ux, uy, off = dx / reach, dy / reach, far - reach
        xx, xy, yy = dmath.total(ux * ux) + 1e-6, dmath.total(ux * uy), dmath.total(uy * uy) + 1e-6
        along_x, along_y = dmath.total(ux * off), dmath.total(uy * off)
        whole = xx * yy - xy * xy
        x, y = x + (yy * along_x - xy * along_y) / whole, y + (xx * along_y - xy * along_x) / whole
    off = far - dmath.hypot(x - origin[:, 0], y - origin[:, 1])
    return (x, y), dmath.total(off * off)


def _tilt(distance: Floats, along_axis: Floats, across: Floats) -> float:
    """Angle ε of the normal from the beam's axis: r + o·a cos ε = D − o·t sin ε, by least squares on sin ε."""
    sine, cosine = 0.0, 1.0
    centred = across - dmath.mean(across)
    power = dmath.total(centred * centred)
    for _ in range(3):
        values = distance + along_axis * cosine
        sine = -dmath.total(centred * (values - dmath.mean(values))) / power
        sine = min(max(sine, -0.5), 0.5)
        cosine = dmath.sqrt(1.0 - sine * sine)
    return dmath.atan2(sine, cosine)


def _across(beams: Beams, members: Ints, bearing: float, *, ahead: bool) -> Floats:
    """Each reading's wall distance from F's origin (`ahead`), or its foot point's place along the wall, in metres."""
    sine, cosine = dmath.sincos(bearing)
    x, y = beams.origin[members, 0], beams.origin[members, 1]
    if ahead:
        return np.asarray(beams.distance[members] + (x * cosine + y * sine))
    return np.asarray(y * cosine - x * sine)
