"""Poses, lines and segments in the plane.

A pose (x, y, θ) is in metres and radians; a line (α, ρ) holds the points p with n·p = ρ, where the unit normal
n = (cos α, sin α) points away from the robot that saw it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam import dmath
from slam.dmath import PI, Floats, Number
from slam.sweep import TURN

GRAIN = 1.0 / (1 << 20)
"""Poses are kept in multiples of this: metres, and turns for the heading."""

Bools = NDArray[np.bool_]


def wrap(angle: Number) -> Number:
    """The angle in (−π, π]."""
    turns = (angle - PI) / (2.0 * PI)
    whole = np.ceil(turns) if isinstance(turns, np.ndarray) else -float((-turns) // 1.0)
    return angle - whole * (2.0 * PI)


def quantise(value: Number, grain: float) -> Number:
    """The nearest multiple of `grain`, so that what is passed between blocks has few bits."""
    if isinstance(value, np.ndarray):
        return np.rint(value / grain) * grain + 0.0
    return round(value / grain) * grain


@dataclass(frozen=True)
class Pose:
    """Position in metres and heading in radians, counter-clockwise from x."""

    x: float
    y: float
    theta: float

    def quantised(self) -> "Pose":
        """This pose on the grid of 2⁻²⁰ m and 2⁻²⁰ turns, heading in (−π, π]."""
        theta = quantise(wrap(self.theta), 2.0 * PI / TURN)
        return Pose(quantise(self.x, GRAIN), quantise(self.y, GRAIN), theta)

    def compose(self, step: "Pose") -> "Pose":
        """The pose reached from here by a step given in this pose's own frame."""
        sine, cosine = dmath.sincos(self.theta)
        return Pose(
            self.x + cosine * step.x - sine * step.y,
            self.y + sine * step.x + cosine * step.y,
            wrap(self.theta + step.theta),
        )

    def step_to(self, other: "Pose") -> "Pose":
        """The step, in this pose's frame, that leads to the other pose."""
        sine, cosine = dmath.sincos(self.theta)
        dx, dy = other.x - self.x, other.y - self.y
        return Pose(cosine * dx + sine * dy, cosine * dy - sine * dx, wrap(other.theta - self.theta))

    def point(self, local: tuple[float, float]) -> tuple[float, float]:
        """A point of this pose's frame in the frame the pose is given in."""
        sine, cosine = dmath.sincos(self.theta)
        x, y = local
        return self.x + (cosine * x - sine * y), self.y + (sine * x + cosine * y)

    def points(self, local: Floats) -> Floats:
        """Points (n, 2) of this pose's frame in the frame the pose is given in."""
        sine, cosine = dmath.sincos(self.theta)
        x, y = local[:, 0], local[:, 1]
        return np.stack([self.x + (cosine * x - sine * y), self.y + (sine * x + cosine * y)], axis=1)


ORIGIN = Pose(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Segment:
    """A piece of the line (α, ρ), between two points (x, y) in metres."""

    alpha: float
    rho: float
    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def middle(self) -> tuple[float, float]:
        """The point halfway."""
        return (0.5 * (self.start[0] + self.end[0]), 0.5 * (self.start[1] + self.end[1]))

    @property
    def foot(self) -> tuple[float, float]:
        """The point of the line nearest to the frame's origin."""
        sine, cosine = dmath.sincos(self.alpha)
        return (self.rho * cosine, self.rho * sine)

    def probe(self) -> Floats:
        """Start, middle and end, (3, 2): the points whose mean distance from a line is d1 [III.E]."""
        return np.array([self.start, self.middle, self.end])

    def moved(self, pose: Pose) -> "Segment":
        """This segment of the pose's frame, in the frame the pose is given in."""
        alpha = wrap(self.alpha + pose.theta)
        sine, cosine = dmath.sincos(alpha)
        rho = self.rho + (cosine * pose.x + sine * pose.y)
        return Segment(alpha, rho, pose.point(self.start), pose.point(self.end))


def segment(alpha: float, rho: float, left: float, right: float) -> Segment:
    """The piece of the line (α, ρ) between two offsets in metres from its foot, along (−sin α, cos α)."""
    sine, cosine = dmath.sincos(alpha)
    x, y = rho * cosine, rho * sine
    return Segment(alpha, rho, (x - left * sine, y + left * cosine), (x - right * sine, y + right * cosine))


def through(start: tuple[float, float], end: tuple[float, float], away_from: tuple[float, float]) -> Segment:
    """The segment between two points, its normal pointing away from a third."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = dmath.hypot(dx, dy)
    nx, ny = dy / length, -dx / length
    rho = nx * start[0] + ny * start[1]
    if rho < nx * away_from[0] + ny * away_from[1]:
        nx, ny, rho = -nx, -ny, -rho
    return Segment(dmath.atan2(ny, nx), rho, start, end)
