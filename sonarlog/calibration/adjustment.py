"""The adjustment: poses, walls and the robot's errors that fit all arcs and all of odometry best, by least squares.

Gauss-Newton with Huber's weights. How good bearings, distances and odometry's heading are is estimated with it, from
their residuals and redundancies (Förstner, Ein Verfahren zur Schätzung von Varianz- und Kovarianzkomponenten, 1979),
so that the uncertainties reported are those of the recording. Must not know: recordings, robots' files, what is a good
result.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slam.geometry import Bools
from sonarlog.calibration.equations import (
    BEARINGS,
    DEGREE,
    DISTANCES,
    FIXED,
    HEADINGS,
    LENGTHS,
    OTHERS,
    SONARS,
    Fit,
    Noise,
    Rows,
    rows_of,
)
from sonarlog.calibration.observations import Stretch
from sonarlog.log import Floats, Ints

HUBER = 2.5
MISFIT = 4.0  # mean square, in units of its noise, from which a sighting is doubted
SIGNIFICANT = 1.5  # standard deviations
ALMOST_NONE = 1e-3
ROUNDS = 20
SETTLED = 1e-7
FIRMNESS = 4.0  # so many observations' worth is the assumed size of an error believed


@dataclass(frozen=True)
class Priors:
    """What is believed before: one standard deviation of each of the robot's errors."""

    rotation: float = 0.03
    distance: float = 0.03
    drift: float = 1.5 * DEGREE
    ring: float = 4.0 * DEGREE
    sonar: float = 4.0 * DEGREE

    def of(self, sonars: int) -> Floats:
        """As one row, (4 + sonars,)."""
        return np.array([self.rotation, self.distance, self.drift, self.ring, *[self.sonar] * sonars])


@dataclass(frozen=True)
class Adjusted:
    """The robot's errors (4 + sonars,), their covariance, and how good what was measured turned out to be.

    `sigma` (4 + sonars,) is one standard deviation without the sighting that matters most to it: what hangs on a single
    sighting, which nothing checks, is not known.
    """

    errors: Floats
    covariance: Floats
    sigma: Floats
    noise: Noise
    arcs: int


def adjust(stretches: Sequence[Stretch], sonars: int, priors: Priors) -> Adjusted:
    """The errors that fit best. Stretches without arcs say nothing and are no harm."""
    fits = [Fit(s, s.poses.copy(), s.walls.copy(), np.zeros(len(s.poses))) for s in stretches if len(s.arcs)]
    errors, noise = np.zeros(SONARS + sonars), Noise()
    seen = np.zeros(sonars)
    for fit in fits:
        seen += np.bincount(fit.stretch.arcs.sonar, minlength=sonars)
    covariance, variance = np.diag(priors.of(sonars) ** 2), priors.of(sonars) ** 2
    for number in range(ROUNDS):
        step, covariance, variance, noise = _round(fits, errors, noise, priors, seen > 0, learn=number >= 3)
        errors = errors + step
        if number > 6 and np.abs(step).max() < SETTLED:
            break
    return Adjusted(errors, covariance, np.sqrt(variance), noise, int(seen.sum()))


def _round(
    fits: list[Fit], errors: Floats, noise: Noise, priors: Priors, seen: Bools, *, learn: bool
) -> tuple[Floats, Floats, Floats, Noise]:
    """One step of Gauss and Newton: the move, covariance, variance without one sighting, noise as it shows."""
    prior = 1.0 / priors.of(len(seen)) ** 2
    normal, right = np.diag(prior), -prior * errors
    mean = np.concatenate([np.zeros(SONARS), seen / max(1, seen.sum())])
    normal += np.outer(mean, mean) / FIXED**2
    right -= mean * (mean @ errors) / FIXED**2
    parts = []
    for fit in fits:
        rows = _weighted(rows_of(fit, errors, noise), fit, noise)
        own = np.asarray(np.linalg.inv(rows.own.T @ rows.own), dtype=np.float64)
        coupling = rows.own.T @ rows.shared
        reduced = own @ coupling
        gradient = rows.own.T @ rows.residual
        normal += rows.shared.T @ rows.shared - coupling.T @ reduced
        right += -(rows.shared.T @ rows.residual) + reduced.T @ gradient
        parts.append((rows, own, reduced, gradient))
    covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    step: Floats = covariance @ right
    squares, redundancy = np.zeros(OTHERS + 1), np.zeros(OTHERS + 1)
    variance = np.diag(covariance)
    for fit, (rows, own, reduced, gradient) in zip(fits, parts, strict=True):
        fit.move(-own @ gradient - reduced @ step)
        along = rows.shared - rows.own @ reduced
        leverage = np.sum((rows.own @ own) * rows.own, axis=1) + np.sum((along @ covariance) * along, axis=1)
        squares += np.bincount(rows.kind, rows.residual**2, OTHERS + 1)
        redundancy += np.bincount(rows.kind, rows.used - leverage, OTHERS + 1)
        variance = np.maximum(variance, _without_one(rows, along, own, covariance, fit.sighting))
    return step, covariance, variance, _learned(noise, squares, redundancy) if learn else noise


def _without_one(rows: Rows, along: Floats, own: Floats, covariance: Floats, sighting: Ints) -> Floats:
    """The shared errors' variances without the sighting that each hangs on most.

    Woodbury's identity takes a few rows out of a solved problem; `along` is what the rows say of the shared errors
    once their own unknowns have given way.
    """
    worst: Floats = np.diag(covariance)
    for number in range(int(sighting.max()) + 1):
        arcs = np.flatnonzero(sighting == number)
        chosen = np.concatenate([arcs, arcs + len(sighting)])
        part = along[chosen]
        inside = rows.own[chosen] @ own @ rows.own[chosen].T + part @ covariance @ part.T
        across = covariance @ part.T
        left = (1.0 + ALMOST_NONE**2) * np.eye(len(chosen)) - inside
        worst = np.maximum(worst, np.diag(covariance) + np.sum(across * np.linalg.solve(left, across.T).T, axis=1))
    return worst


def _learned(noise: Noise, squares: Floats, redundancy: Floats) -> Noise:
    first = Noise()

    def size(kind: int, now: float, assumed: float) -> float:
        # The mean of what the variance may be, which is more than the likeliest where the observations are few.
        spread = (FIRMNESS * (assumed / now) ** 2 + squares[kind]) / (FIRMNESS - 2.0 + max(0.0, redundancy[kind]))
        return float(now * np.sqrt(spread))

    return Noise(
        size(BEARINGS, noise.bearing, first.bearing),
        size(DISTANCES, noise.distance, first.distance),
        size(HEADINGS, noise.heading, first.heading),
        size(LENGTHS, noise.length, first.length),
    )


def _weighted(rows: Rows, fit: Fit, noise: Noise) -> Rows:
    """With Huber's weights on what was measured; a sighting that does not fit as a whole has little weight.

    A robot that was pushed has one bad way. Where a wall was taken for another one, all of its arcs are off; where it
    is a corner, those from beside.
    """
    size = np.abs(rows.residual)
    arc = rows.kind <= DISTANCES
    root = np.where((rows.kind != OTHERS) & (size > HUBER), np.sqrt(HUBER / np.maximum(size, HUBER)), 1.0)
    sighting = fit.sighting
    for kind in (BEARINGS, DISTANCES):
        squares = np.bincount(sighting, rows.residual[rows.kind == kind] ** 2) / np.bincount(sighting)
        unfit = np.sqrt(np.minimum(1.0, MISFIT / np.maximum(squares, 1e-9)))[sighting]
        root[arc] *= np.concatenate([unfit, unfit])
    point = _points(rows.residual[rows.kind == BEARINGS], fit, noise)[fit.stretch.arcs.wall]
    used = np.ones(len(root))
    used[arc] = ~np.concatenate([point, point])
    root *= np.maximum(used, ALMOST_NONE)
    return Rows(rows.residual * root, rows.own * root[:, None], rows.shared * root[:, None], rows.kind, used)


def _points(residual: Floats, fit: Fit, noise: Noise) -> Bools:
    """Which walls (m,) are rather points: in each sighting their bearings follow `aside`, all in all by no chance."""
    wall, sighting = fit.stretch.arcs.wall, fit.sighting
    count = np.bincount(sighting)

    def centred(values: Floats) -> Floats:
        return values - (np.bincount(sighting, values) / count)[sighting]

    residual, aside = centred(residual), centred(fit.stretch.arcs.aside / noise.bearing)
    spread = np.bincount(wall, aside**2)
    part = np.bincount(wall, residual * aside) / np.maximum(spread, 1e-12)
    return (part > 0.5) & (part * np.sqrt(spread) > SIGNIFICANT)
