"""The turn and shift that lay one map best on the other: a shifted map is one sentence, not ten thousand cells.

Found from the paths, refined on walls and paths together. What differs in one place only must not pull the rest along,
so what is far off counts little. Must not know: runs, cells.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from slam.geometry import ORIGIN, Pose
from sonarlog.diff.walls import Wall
from sonarlog.log import Floats
from sonarlog.metrics import rigid_alignment

SCALE_M = 0.03
"""Pairs further apart than this lose their weight [Geman and McClure 1985]."""
REACH_M = 0.60
TURN_RAD = np.radians(20.0)
"""A piece of wall is held against pieces no further off than this."""
ROUNDS = 30
NOTHING_M, NOTHING_RAD = 0.005, np.radians(0.05)
BETTER = 0.02
"""Of two alignments the simpler one stands unless the other lays this share more of walls and path on one another."""


class Mapped(Protocol):
    """What is aligned: a path (n, 3) of x m, y m, θ rad, and walls, in one map frame."""

    @property
    def path(self) -> Floats:
        """One row a sweep."""

    @property
    def walls(self) -> tuple[Wall, ...]:
        """In the path's frame."""


@dataclass(frozen=True)
class Alignment:
    """`pose` is B's map frame as it lies in A's: `pose.points(b)` lie on A's.

    In words it is told the other way: how B's map is turned, and shifted at `about` (A's frame), against A's.
    """

    pose: Pose
    about: tuple[float, float]

    @property
    def none(self) -> bool:
        """Whether the maps lie on one another as they are."""
        return self.pose == ORIGIN

    @property
    def turned_deg(self) -> float:
        """How B's map is turned against A's, counter-clockwise."""
        return 0.0 if self.none else -float(np.degrees(self.pose.theta))

    @property
    def shift_m(self) -> tuple[float, float]:
        """How B's map is shifted against A's at `about`, in A's frame."""
        if self.none:
            return 0.0, 0.0
        x, y = inverse(self.pose).points(np.array([self.about]))[0].tolist()
        return x - self.about[0], y - self.about[1]

    @property
    def shifted_m(self) -> float:
        """The length of the shift."""
        return float(np.hypot(*self.shift_m))

    @property
    def words(self) -> str:
        """`turned by 0.6° and shifted by 4 cm`; empty where there is nothing to say."""
        parts = []
        if round(abs(self.turned_deg), 1) > 0:
            parts.append(f"turned by {self.turned_deg:+.1f}°")
        if round(100 * self.shifted_m) > 0:
            parts.append(f"shifted by {100 * self.shifted_m:.0f} cm")
        return " and ".join(parts)

    def inverted(self) -> "Alignment":
        """The same, told of A against B; `about` is the same point of the place, in B's frame."""
        x, y = inverse(self.pose).points(np.array([self.about]))[0].tolist()
        return Alignment(inverse(self.pose), (x, y)) if not self.none else self


def inverse(pose: Pose) -> Pose:
    """The frame that the pose is given in, as it lies in the pose's."""
    return pose.step_to(ORIGIN)


def align(a: Mapped, b: Mapped, shared: int) -> Alignment:
    """Lay B on A; the first `shared` sweeps of their paths belong together."""
    here, there = a.path[:shared, :2], b.path[:shared, :2]
    about = (0.0, 0.0) if not len(here) else (float(here[:, 0].mean()), float(here[:, 1].mean()))
    starts = [ORIGIN]
    if shared > 1:
        starts.append(rigid_alignment(there, here))
    problem = _Problem(_Pieces.of(a.walls), _Pieces.of(b.walls), here, there)
    best, cost = ORIGIN, problem.cost(ORIGIN)
    for start in starts:
        found = problem.refined(start)
        found_cost = problem.cost(found)
        if found_cost < cost - (BETTER if best == ORIGIN else 0.0):
            best, cost = found, found_cost
    return Alignment(ORIGIN if _is_nothing(best, here) else best, about)


def _is_nothing(pose: Pose, points: Floats) -> bool:
    """Whether the pose moves no point of the map so far that a cell would notice."""
    if not len(points):
        return abs(pose.x) + abs(pose.y) < NOTHING_M and abs(pose.theta) < NOTHING_RAD
    moved = np.hypot(*(pose.points(points) - points).T)
    return float(moved.max()) < NOTHING_M and abs(pose.theta) < NOTHING_RAD


@dataclass(frozen=True)
class _Pieces:
    """Pieces of wall: points on them (k, 2), their normals' angles (k,), the pieces' lines and extents (m, …)."""

    points: Floats
    angles: Floats
    weights: Floats
    alpha: Floats
    rho: Floats
    low: Floats
    high: Floats

    @classmethod
    def of(cls, walls: Sequence[Wall]) -> "_Pieces":
        pieces = [piece for wall in walls for piece in wall.pieces]
        alpha = np.array([piece.alpha for piece in pieces])
        ends = np.array([(piece.start, piece.end) for piece in pieces]).reshape(-1, 2, 2)
        length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        along = np.stack([-np.sin(alpha), np.cos(alpha)], axis=1).reshape(-1, 2)
        places = np.einsum("kej,kj->ke", ends, along)
        part = np.array([0.0, 0.5, 1.0])
        points = ends[:, :1] + part[None, :, None] * (ends[:, 1:] - ends[:, :1])
        return cls(
            points=points.reshape(-1, 2),
            angles=np.repeat(alpha, 3),
            weights=np.repeat(length, 3) / max(1e-9, 3 * float(length.sum())),
            alpha=alpha,
            rho=np.array([piece.rho for piece in pieces]),
            low=places.min(axis=1) if pieces else np.zeros(0),
            high=places.max(axis=1) if pieces else np.zeros(0),
        )


class _Problem:
    """Residuals of B's points of wall to A's lines, and of B's path to A's; each kind weighs 1 in all."""

    def __init__(self, a: _Pieces, b: _Pieces, here: Floats, there: Floats) -> None:
        self._a, self._b, self._here, self._there = a, b, here, there

    def _pairs(self, pose: Pose) -> tuple[Floats, Floats, Floats, Floats]:
        """Moved points (k, 2), and of the nearest line of A its normal (k, 2) and distance (k,); and weights (k,)."""
        a, b = self._a, self._b
        points = pose.points(b.points)
        if not len(a.alpha) or not len(points):
            return points[:0], points[:0], np.zeros(0), np.zeros(0)
        cosine, sine = np.cos(a.alpha), np.sin(a.alpha)
        off = points[:, :1] * cosine + points[:, 1:] * sine - a.rho
        place = points[:, 1:] * cosine - points[:, :1] * sine
        beyond = np.maximum(0.0, np.maximum(a.low - place, place - a.high))
        turned = np.abs(np.angle(np.exp(1j * (b.angles[:, None] + pose.theta - a.alpha))))
        far = np.where(turned <= TURN_RAD, np.abs(off) + beyond, np.inf)
        best = np.argmin(far, axis=1)
        rows = np.arange(len(points))
        off, good = off[rows, best], far[rows, best] <= REACH_M
        normal = np.stack([cosine[best], sine[best]], axis=1)
        return points, normal, np.where(good, off, np.inf), b.weights

    def cost(self, pose: Pose) -> float:
        """What is not laid on its like: 0 for all on one another, up to 2."""
        _, _, off, weights = self._pairs(pose)
        walls = float(np.sum(weights * _lost(off)))
        if not len(self._here):
            return walls
        apart = np.hypot(*(pose.points(self._there) - self._here).T)
        return walls + float(np.mean(_lost(apart)))

    def refined(self, pose: Pose) -> Pose:
        """Gauss–Newton with weights that fall with the residual."""
        for _ in range(ROUNDS):
            points, normal, off, weights = self._pairs(pose)
            good = np.isfinite(off)
            rows = [_rows(points[good], normal[good], off[good], weights[good])]
            if len(self._here):
                moved = pose.points(self._there)
                left, share = moved - self._here, np.full(len(moved), 1.0 / len(moved))
                weight = share * _kept(np.hypot(left[:, 0], left[:, 1]))
                for axis, way in enumerate(((1.0, 0.0), (0.0, 1.0))):
                    rows.append(_rows(moved, np.tile(way, (len(moved), 1)), left[:, axis], weight, told=True))
            jacobian, residual, weight = (np.concatenate(parts) for parts in zip(*rows, strict=True))
            normal_matrix = (jacobian * weight[:, None]).T @ jacobian + 1e-9 * np.eye(3)
            step = -np.linalg.solve(normal_matrix, jacobian.T @ (weight * residual))
            pose = Pose(float(step[0]), float(step[1]), float(step[2])).compose(pose)
            if float(np.abs(step).max()) < 1e-7:
                break
        return pose


def _rows(
    points: Floats, normal: Floats, off: Floats, weights: Floats, *, told: bool = False
) -> tuple[Floats, Floats, Floats]:
    """Rows of the system: how n·p changes with a shift and a turn about the origin; `told`: weights are final."""
    turn = normal[:, 1] * points[:, 0] - normal[:, 0] * points[:, 1]
    jacobian = np.column_stack([normal, turn])
    return jacobian, off, weights if told else weights * _kept(np.abs(off))


def _kept(off: Floats) -> Floats:
    """The weight that a residual keeps: 1 on one another, next to none far off."""
    square = (off / SCALE_M) ** 2
    return np.asarray(1.0 / (1.0 + square) ** 2)


def _lost(off: Floats) -> Floats:
    """The cost of a residual: 0 on one another, 1 far off."""
    finite = np.where(np.isfinite(off), off, 1e6)
    square = (finite / SCALE_M) ** 2
    return np.asarray(square / (1.0 + square))
