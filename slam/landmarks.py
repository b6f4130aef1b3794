"""What the chains show: the line of each wall and the place of each point, as all of a chain's members say [III.E].

The paper aims at the root, the first sighting alone. Its bearing is off by some tenths of a degree, or by some degrees,
and far from where it was seen its line is off by as much times the distance. All members together say it better.

Must not know: the sweep that is being compared with them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, Chains, Member, foot
from slam.dmath import DEGREE, Floats
from slam.geometry import Pose, wrap
from slam.linear import inverse_3


@dataclass(frozen=True)
class LandmarkConfig:
    """What a sighting is worth: `along_m` along the line of sight; across it what the bearing's own sigma makes of the
    distance, with `heading_deg` of the heading it was seen with. A point is a post of no radius, give or take `post_m`.
    """

    along_m: float = 0.02
    heading_deg: float = 0.6
    post_m: float = 0.15


@dataclass(frozen=True)
class Line:
    """What a chain answers like: the line (α, ρ), its bearing good to `sigma` rad and its distance to `off` m."""

    alpha: float
    rho: float
    sigma: float
    off: float


@dataclass(frozen=True)
class Place:
    """Where a point stands, x and y in m, its radius, and how uncertain all three are: a covariance in m²."""

    x: float
    y: float
    radius: float
    covariance: Floats

    def line(self, here: Pose) -> Line:
        """The wall that the point answers like to a robot that stands here: the one across the line of sight."""
        alpha = dmath.atan2(self.y - here.y, self.x - here.x)
        sine, cosine = dmath.sincos(alpha)
        distance = max(dmath.hypot(self.x - here.x, self.y - here.y), 1e-3)
        rho = cosine * self.x + sine * self.y - self.radius
        return Line(alpha, rho, self._good_to(-sine, cosine, 0.0) / distance, self._good_to(cosine, sine, -1.0))

    def _good_to(self, x: float, y: float, radius: float) -> float:
        (xx, xy, xr), (_, yy, yr), (_, _, rr) = self.covariance.tolist()
        mixed = x * y * xy + x * radius * xr + y * radius * yr
        square: float = x * x * xx + y * y * yy + radius * radius * rr + 2.0 * mixed
        return dmath.sqrt(max(square, 0.0))


@dataclass(frozen=True)
class Landmarks:
    """The chains so far, and the poses (m, rad) of the sweeps that saw them."""

    chains: Chains
    poses: tuple[Pose, ...]
    config: LandmarkConfig

    def line(self, chain: int, nature: int, here: Pose, spot: tuple[float, float]) -> Line:
        """The line that a chain of this nature shows to a robot that stands here and looks at its spot (x, y)."""
        return self.point(chain, here) if nature == POINT else self.wall(chain, spot)

    def nature(self, chain: int) -> int:
        """What was told of it last; OPEN while nothing was."""
        if chain not in self._natures:
            members = reversed(self.chains.of(chain))
            self._natures[chain] = next((m.nature for m in members if m.nature != OPEN), OPEN)
        return self._natures[chain]

    def point(self, chain: int, here: Pose) -> Line:
        """The line that its point, if it is one, shows to a robot that stands here."""
        if chain not in self._places:
            self._places[chain] = place_of(self.chains.of(chain), self.poses, self.config)
        if (chain, here) not in self._lines:
            self._lines[chain, here] = self._places[chain].line(here)
        return self._lines[chain, here]

    def wall(self, chain: int, spot: tuple[float, float]) -> Line:
        """The line of its wall, if it is one, as good as it is at this spot."""
        return line_of(self.chains.of(chain), self.poses, spot, self.config)

    @cached_property
    def _natures(self) -> dict[int, int]:
        return {}

    @cached_property
    def _places(self) -> dict[int, Place]:
        return {}

    @cached_property
    def _lines(self) -> dict[tuple[int, Pose], Line]:
        return {}


def place_of(members: list[Member], poses: tuple[Pose, ...], config: LandmarkConfig) -> Place:
    """Where the members' lines of sight cross, and how far before that they end: a least-squares problem.

    Seen along the bearing α a post of radius r at p ends at n·p − r; across the line of sight it is where p is.
    """
    alpha, spots, sigmas, distances = _sightings(members, poses)
    sine, cosine = dmath.sincos(alpha)
    aside = distances * _bearing_sigmas(sigmas, config)
    count = len(members)
    # First how far each line of sight goes, then where it passes.
    rows = np.stack(
        [
            np.concatenate([cosine, -sine]),
            np.concatenate([sine, cosine]),
            np.concatenate([np.full(count, -1.0), np.zeros(count)]),
        ]
    )
    square = config.along_m * config.along_m
    weights = np.concatenate([np.full(count, 1.0 / square), 1.0 / (aside * aside + square)])
    x, y = np.tile(spots[:, 0], 2), np.tile(spots[:, 1], 2)
    weighed = rows * weights
    whole = np.cumsum(weighed[:, None, :] * rows, axis=2)[:, :, -1]
    whole[2, 2] += 1.0 / (config.post_m * config.post_m)
    right = np.cumsum(weighed * (rows[0] * x + rows[1] * y), axis=1)[:, -1]
    covariance = inverse_3(whole)
    px, py, radius = np.cumsum(covariance * right, axis=1)[:, -1].tolist()
    return Place(px, py, radius, covariance)


def line_of(members: list[Member], poses: tuple[Pose, ...], spot: tuple[float, float], config: LandmarkConfig) -> Line:
    """The line through the members' foot points along their bearings: a least-squares problem, linear about the root.

    With t along the root's line and u across it, from the spot: u = c − δ·t and α = α_root + δ.
    """
    alpha, spots, sigmas, _ = _sightings(members, poses)
    sine, cosine = dmath.sincos(float(alpha[0]))
    x, y = spots[:, 0] - spot[0], spots[:, 1] - spot[1]
    t, u = cosine * y - sine * x, cosine * x + sine * y
    bearing = _bearing_sigmas(sigmas, config)
    turned, of_bearing = wrap(alpha - float(alpha[0])), 1.0 / (bearing * bearing)
    of_place = 1.0 / (config.along_m * config.along_m)
    cc, ct = of_place * float(len(members)), -of_place * dmath.total(t)
    tt = of_place * dmath.total(t * t) + dmath.total(of_bearing)
    c, d = of_place * dmath.total(u), dmath.total(of_bearing * turned) - of_place * dmath.total(t * u)
    determinant = cc * tt - ct * ct
    across, turn = (tt * c - ct * d) / determinant, (cc * d - ct * c) / determinant
    tilted = wrap(float(alpha[0]) + turn)
    new_sine, new_cosine = dmath.sincos(tilted)
    rho = new_cosine * (spot[0] + cosine * across) + new_sine * (spot[1] + sine * across)
    return Line(tilted, rho, dmath.sqrt(cc / determinant), dmath.sqrt(tt / determinant))


def _bearing_sigmas(own: Floats, config: LandmarkConfig) -> Floats:
    return dmath.hypot(own, np.full(len(own), config.heading_deg * DEGREE))


def _sightings(members: list[Member], poses: tuple[Pose, ...]) -> tuple[Floats, Floats, Floats, Floats]:
    """Of each member (n,): its bearing, foot point (n, 2), the bearing's sigma, and how far away it was seen."""
    stations = [poses[member.sweep] for member in members]
    spots = np.array([foot(member.segment, station) for member, station in zip(members, stations, strict=True)])
    x, y = np.array([station.x for station in stations]), np.array([station.y for station in stations])
    alpha = np.array([member.segment.alpha for member in members])
    sigmas = np.array([member.sigma for member in members])
    return alpha, spots, sigmas, dmath.hypot(spots[:, 0] - x, spots[:, 1] - y)
