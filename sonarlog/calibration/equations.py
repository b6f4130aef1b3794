"""The equations of the adjustment: what each arc, way and sweep says of poses, walls and the robot's errors.

What the stretches share are the robot's errors:

    0 rotation: true turn over odometry's, less 1    1 distance: the same of the way    2 drift: rad a metre
    3 ring: bearing of all sonars, rad               4… each sonar's bearing against the ring, rad

Must not know: how the equations are solved, what is a good result.
"""

from dataclasses import dataclass

import numpy as np

from slam.geometry import wrap
from sonarlog.calibration.observations import Stretch, Way
from sonarlog.log import Floats, Ints

ROTATION, DISTANCE, DRIFT, RING, SONARS = 0, 1, 2, 3, 4
BEARINGS, DISTANCES, HEADINGS, LENGTHS, OTHERS = range(5)
WAY_KINDS = np.array([LENGTHS, LENGTHS, HEADINGS])
DEGREE = np.pi / 180.0
FIXED = 1e-6  # the first pose of each stretch is where it is
SHORTEST_M = 0.1  # a way's error is at least that of so long a one: packets count in mm
FLOOR_RAD = 0.05 * DEGREE  # of its heading: they count in tenths of a degree
SWEEP_SLOPE = 1.095 / (2.0 * np.pi)  # of a random walk over one turn, √1.2 times its size at the end, per rad


@dataclass(frozen=True)
class Noise:
    """How good what was measured is: an arc's bearing rad and distance m, a way's heading rad per √metre and √turn, and
    its length m per √metre.
    """

    bearing: float = 1.0 * DEGREE
    distance: float = 0.006
    heading: float = 0.4 * DEGREE
    length: float = 0.004


@dataclass
class Fit:
    """A stretch being fitted: poses (n, 3), walls (m, 2), and each sweep's own error of rotation, slope (n,)."""

    stretch: Stretch
    poses: Floats
    walls: Floats
    slope: Floats

    @property
    def size(self) -> int:
        """How many unknowns it has of its own."""
        return self.poses.size + self.walls.size + self.slope.size

    @property
    def sighting(self) -> Ints:
        """A number for each pair of sweep and wall, by arc."""
        pairs = self.stretch.arcs.sweep * len(self.walls) + self.stretch.arcs.wall
        numbers: Ints = np.unique(pairs, return_inverse=True)[1].astype(np.int64)
        return numbers

    def move(self, step: Floats) -> None:
        """Add a step of the own unknowns, in the order of poses, walls, slopes."""
        poses, walls, slope = np.split(step, np.cumsum([self.poses.size, self.walls.size]))
        self.poses += poses.reshape(-1, 3)
        self.walls += walls.reshape(-1, 2)
        self.slope += slope


@dataclass(frozen=True)
class Rows:
    """Whitened residuals (r,) with their derivatives by the stretch's own unknowns and by the shared ones.

    `kind` says which noise each tells of, and `used` (0 or 1) whether it does.
    """

    residual: Floats
    own: Floats
    shared: Floats
    kind: Ints
    used: Floats | float = 1.0


def rows_of(fit: Fit, errors: Floats, noise: Noise) -> Rows:
    """All equations of a stretch, linear about where it is by now; arcs' bearings first, then their distances."""
    parts = [_bearings(fit, errors, noise), _distances(fit, errors, noise), _slopes(fit, errors, noise)]
    parts += [_way_rows(fit, k, errors, noise) for k in range(len(fit.stretch.ways))]
    parts.append(_start(fit, errors))
    return Rows(
        np.concatenate([part.residual for part in parts]),
        np.concatenate([part.own for part in parts]),
        np.concatenate([part.shared for part in parts]),
        np.concatenate([part.kind for part in parts]),
    )


def _empty(count: int, fit: Fit, errors: Floats) -> tuple[Floats, Floats]:
    return np.zeros((count, fit.size)), np.zeros((count, len(errors)))


def _bearings(fit: Fit, errors: Floats, noise: Noise) -> Rows:
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
    return Rows(residual / s, own / s, shared / s, np.full(len(arcs), BEARINGS))


def _distances(fit: Fit, errors: Floats, noise: Noise) -> Rows:
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
    return Rows(residual / s, own / s, shared, np.full(len(arcs), DISTANCES))


def _slopes(fit: Fit, errors: Floats, noise: Noise) -> Rows:
    """What the heading slips over a sweep looks like an error of rotation, another one in each sweep."""
    count = len(fit.slope)
    own, shared = _empty(count, fit, errors)
    s = noise.heading * SWEEP_SLOPE
    own[np.arange(count), fit.size - count + np.arange(count)] = 1.0 / s
    return Rows(fit.slope / s, own, shared, np.full(count, HEADINGS))


def _way_rows(fit: Fit, k: int, errors: Floats, noise: Noise) -> Rows:
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
    return Rows(root @ residual, root @ own, root @ shared, WAY_KINDS)


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


def _start(fit: Fit, errors: Floats) -> Rows:
    own, shared = _empty(3, fit, errors)
    own[np.arange(3), np.arange(3)] = 1.0 / FIXED
    return Rows((fit.poses[0] - fit.stretch.poses[0]) / FIXED, own, shared, np.full(3, OTHERS))
