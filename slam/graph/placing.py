"""Where the robot is if these walls are those landmarks: three unknowns and a handful of walls, so in plain floats."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.geometry import wrap
from slam.linear import inverse_3

STEPS = 3
PRIOR_KERNEL = 3.0
"""As for a step in the graph."""
AGREED, FREE = 3, 100.0
"""So many walls may outvote odometry; and how much less it counts where they are asked first."""


@dataclass(frozen=True)
class Place:
    """Where the robot is thought to be: pose (3,) and its covariance (3, 3)."""

    pose: Floats
    covariance: Floats


class Look(NamedTuple):
    """How something looks from a place: its direction in the map, its distance, and how the robot's steps change both.

    A step (x, y) turns it by `turn`·(x, y) and brings it nearer by `toward`·(x, y).
    """

    direction: float
    distance: float
    turn: tuple[float, float]
    toward: tuple[float, float]


class Line(NamedTuple):
    """The line n·p = off, where n = (cos α, sin α)."""

    alpha: float
    normal: tuple[float, float]
    off: float

    def look(self, x: float, y: float) -> Look:
        """From (x, y): its foot point."""
        nx, ny = self.normal
        return Look(self.alpha, self.off - (nx * x + ny * y), (0.0, 0.0), self.normal)


class Point(NamedTuple):
    """A point in the map, and the radius of what stands there."""

    x: float
    y: float
    radius: float

    def look(self, x: float, y: float) -> Look:
        """From (x, y)."""
        dx, dy = self.x - x, self.y - y
        far = max(dmath.hypot(dx, dy), 1e-3)
        ux, uy = dx / far, dy / far
        return Look(dmath.atan2(dy, dx), far - self.radius, (uy / far, -ux / far), (ux, uy))


class Sight(NamedTuple):
    """A wall in F and what it is taken for; `sigma` rad is the bearing's."""

    of: Line | Point
    bearing: float
    distance: float
    sigma: float


def placed(sights: Sequence[Sight], distance_sigma: float, prior: Place, kernel: float) -> Place:
    """The place from which these are seen so, held against the prior; the landmarks stay where they are.

    Gauss and Newton's steps, with Cauchy's weights, as for the whole graph; the prior, too, is only a measurement.
    """
    if not sights:
        return prior
    here, cost = _descended(sights, distance_sigma, prior, kernel, 1.0)
    if len(sights) < AGREED:
        return here
    # Where all walls agree on another turn, each by itself is wild from where odometry stands.
    there, other = _descended(sights, distance_sigma, prior, kernel, FREE)
    return there if other < cost else here


def _descended(
    sights: Sequence[Sight], distance_sigma: float, prior: Place, kernel: float, freedom: float
) -> tuple[Place, float]:
    """A place that is the best one around, and what it costs.

    At first the prior counts less by `freedom`, and what is wild counts as well.
    """
    believed = inverse_3(prior.covariance)
    pose, whole, loose = prior.pose, believed, freedom
    for _ in range(STEPS):
        off = _from(prior, pose)
        weight = 1.0 / (1.0 + _squared(believed, off) / (PRIOR_KERNEL * PRIOR_KERNEL)) / loose
        seen, pulled = _normal_equations(sights, distance_sigma, pose, kernel * loose)
        whole = weight * believed + seen
        right = np.cumsum(weight * believed * off, axis=1)[:, -1] + pulled
        pose = pose + np.cumsum(inverse_3(whole) * right, axis=1)[:, -1]
        loose = 1.0
    cost = _cauchy(_squared(believed, _from(prior, pose)), PRIOR_KERNEL)
    return Place(pose, inverse_3(whole)), cost + _cost(sights, distance_sigma, pose, kernel)


def _from(prior: Place, pose: Floats) -> Floats:
    off = prior.pose - pose
    off[2] = wrap(float(off[2]))
    return off


def _squared(believed: Floats, off: Floats) -> float:
    return dmath.total((believed * off).ravel() * np.repeat(off, 3))


def _cauchy(squared: float, kernel: float) -> float:
    return kernel * kernel * dmath.log(1.0 + squared / (kernel * kernel))


def _cost(sights: Sequence[Sight], distance_sigma: float, pose: Floats, kernel: float) -> float:
    """What the sights leave over at a pose."""
    x, y, theta = pose.tolist()
    whole = 0.0
    for of, bearing, distance, sigma in sights:
        direction, far, _, _ = of.look(x, y)
        b, d = wrap(bearing - (direction - theta)) / sigma, (distance - far) / distance_sigma
        whole += _cauchy(b * b, kernel) + _cauchy(d * d, kernel)
    return whole


def _normal_equations(
    sights: Sequence[Sight], distance_sigma: float, pose: Floats, kernel: float
) -> tuple[Floats, Floats]:
    """What the sights say of the pose: (3, 3) and (3,)."""
    x, y, theta = pose.tolist()
    xx, xy, yy, xt, yt, tt, along_x, along_y, along_t = (0.0,) * 9
    for of, bearing, distance, sigma in sights:
        direction, far, (gx, gy), (ux, uy) = of.look(x, y)
        turned, nearer = wrap(bearing - (direction - theta)), distance - far
        b = 1.0 / (sigma * sigma + turned * turned / (kernel * kernel))
        d = 1.0 / (distance_sigma * distance_sigma + nearer * nearer / (kernel * kernel))
        xx += b * gx * gx + d * ux * ux
        xy += b * gx * gy + d * ux * uy
        yy += b * gy * gy + d * uy * uy
        xt -= b * gx
        yt -= b * gy
        tt += b
        along_x += b * turned * gx - d * nearer * ux
        along_y += b * turned * gy - d * nearer * uy
        along_t -= b * turned
    return np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]]), np.array([along_x, along_y, along_t])
