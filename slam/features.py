"""Block D, feature extraction: walls and corners from the pattern of RCDs [III.D].

A corner answers like a wall, but it stands where the lines of two nearer RCDs meet. Narrow RCDs are edges or poles:
kept, not used as walls. One sweep cannot always tell; later sweeps decide.
"""

from dataclasses import dataclass

from slam import dmath
from slam.dmath import DEGREE
from slam.geometry import Segment, segment, wrap
from slam.reliability import Rcd, Reliability


@dataclass(frozen=True)
class FeatureConfig:
    """What makes a corner, and whether narrow RCDs count as walls."""

    corner_m: float = 0.08
    corner_deg: float = 6.0
    corner_min_angle_deg: float = 25.0
    corner_max_angle_deg: float = 155.0
    only_strong_walls: bool = True


@dataclass(frozen=True)
class Wall:
    """A straight wall of the sweep: RCD number `rcd`, as a segment of F, its bearing good to `sigma` rad.

    From `left` to `right` metres of its foot point, along the tangent. What answers like a wall may be a point:
    `parallax` is the χ² by which the sonars' bearings say so.
    """

    rcd: int
    segment: Segment
    sigma: float = 0.0
    left: float = 0.0
    right: float = 0.0
    parallax: float = 0.0


@dataclass(frozen=True)
class Corner:
    """RCD number `rcd`, standing at `point` (x, y) m of F where the lines of RCDs `sides` meet."""

    rcd: int
    point: tuple[float, float]
    sides: tuple[int, int]


@dataclass(frozen=True)
class Features:
    """What the sweep's RCDs are; `narrow` lists those that are neither wall nor corner."""

    walls: tuple[Wall, ...]
    corners: tuple[Corner, ...]
    narrow: tuple[int, ...]


def extract_features(reliability: Reliability, config: FeatureConfig) -> Features:
    """Name each RCD a corner, a wall, or a narrow thing."""
    walls, corners, narrow = [], [], []
    for k, rcd in enumerate(reliability.rcds):
        corner = find_corner(k, reliability.rcds, config)
        if corner is not None:
            corners.append(corner)
        elif rcd.strong or not config.only_strong_walls:
            piece = segment(rcd.bearing, rcd.distance, rcd.left, rcd.right)
            walls.append(Wall(k, piece, rcd.sigma, rcd.left, rcd.right, rcd.parallax))
        else:
            narrow.append(k)
    return Features(tuple(walls), tuple(corners), tuple(narrow))


def find_corner(k: int, rcds: tuple[Rcd, ...], config: FeatureConfig) -> Corner | None:
    """The corner that RCD `k` is, if two nearer RCDs' lines meet there; the best-fitting pair wins."""
    best: tuple[float, Corner] | None = None
    nearer = [i for i, rcd in enumerate(rcds) if rcd.distance < rcds[k].distance and i != k]
    for place, i in enumerate(nearer):
        for j in nearer[place + 1 :]:
            point = intersection(rcds[i], rcds[j], config)
            if point is None:
                continue
            off = abs(dmath.hypot(*point) - rcds[k].distance)
            turned = abs(wrap(dmath.atan2(point[1], point[0]) - rcds[k].bearing))
            fits = off <= config.corner_m and turned <= config.corner_deg * DEGREE
            if fits and (best is None or off < best[0]):
                best = (off, Corner(k, point, (i, j)))
    return best[1] if best else None


def intersection(first: Rcd, second: Rcd, config: FeatureConfig) -> tuple[float, float] | None:
    """Where the lines of two RCDs meet (x, y) m in F, or None if they are too nearly parallel."""
    between = abs(wrap(first.bearing - second.bearing))
    if not config.corner_min_angle_deg * DEGREE <= between <= config.corner_max_angle_deg * DEGREE:
        return None
    s1, c1 = dmath.sincos(first.bearing)
    s2, c2 = dmath.sincos(second.bearing)
    determinant = c1 * s2 - s1 * c2
    x = (first.distance * s2 - second.distance * s1) / determinant
    y = (c1 * second.distance - c2 * first.distance) / determinant
    return x, y
