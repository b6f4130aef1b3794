"""The adjustment: poses, walls and the robot's errors that fit all arcs and all of odometry best, by least squares.

Gauss-Newton with Huber's weights. How good bearings, distances and odometry's heading are is estimated with it, from
their residuals and redundancies (Förstner, Ein Verfahren zur Schätzung von Varianz- und Kovarianzkomponenten, 1979),
so that the uncertainties reported are those of the recording. What the stretches share are the robot's errors:

    0 rotation: true turn over odometry's, less 1    1 distance: the same of the way    2 drift: rad a metre
    3 ring: bearing of all sonars, rad               4… each sonar's bearing against the ring, rad, mean 0

Must not know: recordings, robots' files, what is a good result.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slam.geometry import Bools, wrap
from sonarlog.calibration.observations import Stretch, Way
from sonarlog.log import Floats, Ints

ROTATION, DISTANCE, DRIFT, RING, SONARS = 0, 1, 2, 3, 4
DEGREE = np.pi / 180.0
HUBER = 2.5
MISFIT = 4.0  # mean square, in units of its noise, from which a sighting is doubted
SIGNIFICANT = 1.5  # standard deviations
ALMOST_NONE = 1e-3
ROUNDS = 20
SETTLED = 1e-7
FIXED = 1e-6  # the first pose of each stretch is where it is
SHORTEST_M = 0.1  # a way's error is at least that of so long a one: packets count in mm
FLOOR_RAD = 0.05 * DEGREE  # of its heading: they count in tenths of a degree
SWEEP_SLOPE = 1.095 / (2.0 * np.pi)  # of a random walk over one turn, √1.2 times its size at the end, per rad
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
class Noise:
    """How good what was measured is: an arc's bearing rad and distance m, a way's heading rad per √metre and √turn, and
    its length m per √metre.
    """

    bearing: float = 1.0 * DEGREE
    distance: float = 0.006
    heading: float = 0.4 * DEGREE
    length: float = 0.004


@dataclass(frozen=True)
class Adjusted:
    """The robot's errors (4 + sonars,), their covariance, and how good what was measured turned out to be."""

    errors: Floats
    covariance: Floats
    noise: Noise
    arcs: int

    @property
    def sigma(self) -> Floats:
        """One standard deviation of each."""
        return np.sqrt(np.diag(self.covariance))


@dataclass
class _Fit:
    """A stretch being fitted: poses (n, 3), walls (m, 2), and each sweep's own error of rotation, slope (n,)."""

    stretch: Stretch
    poses: Floats
    walls: Floats
    slope: Floats

    @property
    def size(self) -> int:
        return self.poses.size + self.walls.size + self.slope.size

    @property
    def sighting(self) -> Ints:
        """A number for each pair of sweep and wall, by arc."""
        pairs = self.stretch.arcs.sweep * len(self.walls) + self.stretch.arcs.wall
        numbers: Ints = np.unique(pairs, return_inverse=True)[1].astype(np.int64)
        return numbers

    def move(self, step: Floats) -> None:
        poses, walls, slope = np.split(step, np.cumsum([self.poses.size, self.walls.size]))
        self.poses += poses.reshape(-1, 3)
        self.walls += walls.reshape(-1, 2)
        self.slope += slope


@dataclass(frozen=True)
class _Rows:
    """Whitened residuals (r,) with their derivatives by the stretch's own unknowns and by the shared ones.

    `kind` says which noise each tells of, and `used` (0 or 1) whether it does.
    """

    residual: Floats
    own: Floats
    shared: Floats
    kind: Ints
    used: Floats | float = 1.0


BEARINGS, DISTANCES, HEADINGS, LENGTHS, OTHERS = range(5)
WAY_KINDS = np.array([LENGTHS, LENGTHS, HEADINGS])


def adjust(stretches: Sequence[Stretch], sonars: int, priors: Priors) -> Adjusted:
    """The errors that fit best. Stretches without arcs say nothing and are no harm."""
    fits = [_Fit(s, s.poses.copy(), s.walls.copy(), np.zeros(len(s.poses))) for s in stretches if len(s.arcs)]
    errors, noise = np.zeros(SONARS + sonars), Noise()
    seen = np.zeros(sonars)
    for fit in fits:
        seen += np.bincount(fit.stretch.arcs.sonar, minlength=sonars)
    covariance = np.diag(priors.of(sonars) ** 2)
    for number in range(ROUNDS):
        step, covariance, noise = _round(fits, errors, noise, priors, seen > 0, learn=number >= 3)
        errors = errors + step
        if number > 6 and np.abs(step).max() < SETTLED:
            break
    return Adjusted(errors, covariance, noise, int(seen.sum()))


def _round(
    fits: list[_Fit], errors: Floats, noise: Noise, priors: Priors, seen: Bools, *, learn: bool
) -> tuple[Floats, Floats, Noise]:
    """One step of Gauss and Newton: how the errors move, their covariance, and the noise as it shows."""
    prior = 1.0 / priors.of(len(seen)) ** 2
    normal, right = np.diag(prior), -prior * errors
    mean = np.concatenate([np.zeros(SONARS), seen / max(1, seen.sum())])
    normal += np.outer(mean, mean) / FIXED**2
    right -= mean * (mean @ errors) / FIXED**2
    parts = []
    for fit in fits:
        rows = _weighted(_rows(fit, errors, noise), fit, noise)
        own = np.linalg.inv(rows.own.T @ rows.own)
        coupling = rows.own.T @ rows.shared
        reduced = own @ coupling
        gradient = rows.own.T @ rows.residual
        normal += rows.shared.T @ rows.shared - coupling.T @ reduced
        right += -(rows.shared.T @ rows.residual) + reduced.T @ gradient
        parts.append((rows, own, reduced, gradient))
    covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    step: Floats = covariance @ right
    squares, redundancy = np.zeros(OTHERS + 1), np.zeros(OTHERS + 1)
    for fit, (rows, own, reduced, gradient) in zip(fits, parts, strict=True):
        fit.move(-own @ gradient - reduced @ step)
        along = rows.shared - rows.own @ reduced
        leverage = np.sum((rows.own @ own) * rows.own, axis=1) + np.sum((along @ covariance) * along, axis=1)
        squares += np.bincount(rows.kind, rows.residual**2, OTHERS + 1)
        redundancy += np.bincount(rows.kind, rows.used - leverage, OTHERS + 1)
    return step, covariance, _learned(noise, squares, redundancy) if learn else noise


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


def _weighted(rows: _Rows, fit: _Fit, noise: Noise) -> _Rows:
    """With Huber's weights on what was measured; a sighting that does not fit as a whole has little weight.

    A robot that was pushed has one bad way. Where a wall was taken for another one, all of its arcs are off; where it is
    a corner, those from beside.
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
    return _Rows(rows.residual * root, rows.own * root[:, None], rows.shared * root[:, None], rows.kind, used)


def _points(residual: Floats, fit: _Fit, noise: Noise) -> Bools:
    """Which walls (m,) are rather points: in each sighting their bearings follow `aside`, all in all by no chance."""
    wall, sighting = fit.stretch.arcs.wall, fit.sighting
    count = np.bincount(sighting)

    def centred(values: Floats) -> Floats:
        return values - (np.bincount(sighting, values) / count)[sighting]

    residual, aside = centred(residual), centred(fit.stretch.arcs.aside / noise.bearing)
    spread = np.bincount(wall, aside**2)
    part = np.bincount(wall, residual * aside) / np.maximum(spread, 1e-12)
    return (part > 0.5) & (part * np.sqrt(spread) > SIGNIFICANT)


def _rows(fit: _Fit, errors: Floats, noise: Noise) -> _Rows:
    parts = [_bearings(fit, errors, noise), _distances(fit, errors, noise), _slopes(fit, errors, noise)]
    parts += [_way_rows(fit, k, errors, noise) for k in range(len(fit.stretch.ways))]
    parts.append(_start(fit, errors))
    return _Rows(
        np.concatenate([part.residual for part in parts]),
        np.concatenate([part.own for part in parts]),
        np.concatenate([part.shared for part in parts]),
        np.concatenate([part.kind for part in parts]),
    )


def _empty(count: int, fit: _Fit, errors: Floats) -> tuple[Floats, Floats]:
    return np.zeros((count, fit.size)), np.zeros((count, len(errors)))


def _bearings(fit: _Fit, errors: Floats, noise: Noise) -> _Rows:
    """Bearing in the sweep's frame, errors taken out, against α − θ."""
    arcs = fit.stretch.arcs
    rows = np.arange(len(arcs))
    walls, slopes = fit.poses.size, fit.poses.size + fit.walls.size
    scale = errors[ROTATION] + fit.slope[arcs.sweep]
    found = arcs.bearing + scale * arcs.turn + errors[RING] + errors[SONARS + arcs.sonar]
    residual = wrap(found - fit.walls[arcs.wall, 0] + fit.poses[arcs.sweep, 2])
    own, shared = _empty(len(arcs), fit, errors)
    own[rows, 3 * arcs.sweep + 2] = 1.0
    own[rows, walls + 2 * arcs.wall] = -1.0
    own[rows, slopes + arcs.sweep] = arcs.turn
    shared[rows, ROTATION] = arcs.turn
    shared[rows, RING] = 1.0
    shared[rows, SONARS + arcs.sonar] = 1.0
    s = noise.bearing
    return _Rows(residual / s, own / s, shared / s, np.full(len(arcs), BEARINGS))


def _distances(fit: _Fit, errors: Floats, noise: Noise) -> _Rows:
    """Distance against ρ − n·p."""
    arcs = fit.stretch.arcs
    rows = np.arange(len(arcs))
    walls = fit.poses.size
    alpha, rho = fit.walls[arcs.wall].T
    x, y, _ = fit.poses[arcs.sweep].T
    cosine, sine = np.cos(alpha), np.sin(alpha)
    residual = arcs.distance - rho + (cosine * x + sine * y)
    own, shared = _empty(len(arcs), fit, errors)
    own[rows, 3 * arcs.sweep], own[rows, 3 * arcs.sweep + 1] = cosine, sine
    own[rows, walls + 2 * arcs.wall] = cosine * y - sine * x
    own[rows, walls + 2 * arcs.wall + 1] = -1.0
    s = noise.distance
    return _Rows(residual / s, own / s, shared, np.full(len(arcs), DISTANCES))


def _slopes(fit: _Fit, errors: Floats, noise: Noise) -> _Rows:
    """What the heading slips over a sweep looks like an error of rotation, another one in each sweep."""
    count = len(fit.slope)
    own, shared = _empty(count, fit, errors)
    s = noise.heading * SWEEP_SLOPE
    own[np.arange(count), fit.size - count + np.arange(count)] = 1.0 / s
    return _Rows(fit.slope / s, own, shared, np.full(count, HEADINGS))


def _way_rows(fit: _Fit, k: int, errors: Floats, noise: Noise) -> _Rows:
    """From pose k to k + 1, as it is against as odometry has it with the errors taken out."""
    way = fit.stretch.ways[k]
    expected, by_errors, root = _expected(way, errors, noise)
    (x0, y0, t0), (x1, y1, t1) = fit.poses[k], fit.poses[k + 1]
    cosine, sine = np.cos(t0), np.sin(t0)
    dx, dy = x1 - x0, y1 - y0
    there = np.array([cosine * dx + sine * dy, cosine * dy - sine * dx, t1 - t0])
    residual = there - expected
    residual[2] = wrap(residual[2])
    own, shared = _empty(3, fit, errors)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    own[:2, 3 * k : 3 * k + 2] = -turn
    own[:2, 3 * k + 3 : 3 * k + 5] = turn
    own[:2, 3 * k + 2] = there[1], -there[0]
    own[2, 3 * k + 2], own[2, 3 * k + 5] = -1.0, 1.0
    shared[:, :RING] = -by_errors
    return _Rows(root @ residual, root @ own, root @ shared, WAY_KINDS)


def _expected(way: Way, errors: Floats, noise: Noise) -> tuple[Floats, Floats, Floats]:
    """Where a way leads (3,), its derivatives by rotation, distance and drift (3, 3), and the root of its weights.

    The heading errs by a random walk; each piece's error turns all of the way that comes after it. The root is a
    triangle, so that its last row is the heading alone.
    """
    driven = np.cumsum(way.ahead) - 0.5 * way.ahead
    off = errors[ROTATION] * way.heading - errors[DRIFT] * driven
    cosine, sine = np.cos(off), np.sin(off)
    px, py = cosine * way.dx - sine * way.dy, sine * way.dx + cosine * way.dy
    scale = 1.0 + errors[DISTANCE]
    turned, ahead = float(way.turned.sum()), float(way.ahead.sum())
    end = np.array([px.sum(), py.sum()])
    expected = np.array([*(scale * end), (1.0 + errors[ROTATION]) * turned - errors[DRIFT] * ahead])
    derivatives = np.zeros((3, 3))
    derivatives[:2, ROTATION] = scale * np.sum(-py * way.heading), scale * np.sum(px * way.heading)
    derivatives[:2, DISTANCE] = end
    derivatives[:2, DRIFT] = scale * np.sum(py * driven), scale * np.sum(-px * driven)
    derivatives[2] = turned, 0.0, -ahead
    rest = scale * (end[:, None] - np.cumsum([px, py], axis=1))
    turning = np.stack([-rest[1], rest[0], np.ones(len(px))])
    slipped = noise.heading**2 * (np.abs(way.ahead) + np.abs(way.turned) / (2.0 * np.pi))
    length = noise.length**2 * (SHORTEST_M + float(np.abs(way.ahead).sum()))
    covariance = (turning * slipped) @ turning.T
    covariance += np.diag([length, length, FLOOR_RAD**2])
    return expected, derivatives, np.linalg.cholesky(np.linalg.inv(covariance)).T


def _start(fit: _Fit, errors: Floats) -> _Rows:
    own, shared = _empty(3, fit, errors)
    own[np.arange(3), np.arange(3)] = 1.0 / FIXED
    return _Rows((fit.poses[0] - fit.stretch.poses[0]) / FIXED, own, shared, np.full(3, OTHERS))
