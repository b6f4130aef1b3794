"""The least-squares problem: which sweep saw which landmark how, and how poses follow one another.

A landmark is what a chain stands for: a line (α, d), d m along its normal from an anchor on it, or a point (x, y) that
may have a radius. A sighting is the bearing and distance of its foot point (of the point's rim) from a pose. Landmark
number = chain number. Must not know: sweeps, sonars, how the problem is solved.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.geometry import Bools, wrap
from slam.sweep import Ints

CLOSE_EVERY = 5
"""All sweeps since an old wall move at most once in so many sweeps: what is left over then is small."""
ROTATION, DISTANCE, DRIFT, RING = range(4)
"""The wheels' errors in `Graph.errors`; RING is what all sonars together are turned by."""


@dataclass(frozen=True)
class Graph:
    """n poses, k sightings, m landmarks; metres and radians in the map frame.

    `poses` (n, 3); `motions` (n, 5) the raw odometry that led to each, as in `Motion`; a mere guess where `joined` (n,)
    is 0.
    Sightings: `sweep`, `landmark` (k,); `bearing`, `distance` with the bearing's own `sigma`; `parallax` by how much
    χ² its sonars say that it is a point; `left`, `right` the
    extent of what was seen, along the tangent from the foot point.
    Landmarks: `nature`, `as_point` (taken for one: what is not told yet is what explains it better so far), `seen` (the
    last sweep), `alive` (m,); `line` (α, d) (m, 2), `point` (x, y and the radius
    of what stands there: 0 of corners) (m, 3), `anchor` (m, 2); `extent` (m, 2) along the tangent from the
    anchor; `tried` (m, 3) with which older one a merge failed last, and how often that one
    and it had been seen by then. `drawn` (k, 4): the ends at which each sighting was last made a member of its
    chain, `drawn_as` (k, 2) that chain and its nature.
    `errors` (4,) the wheels', `rotation_prior` (2,) what each sweep by itself says: mean and σ.
    `closed` is the sweep at which a loop was closed last; `slip` by how much odometry slips more than is usual.
    """

    poses: Floats
    motions: Floats
    joined: Ints
    sweep: Ints
    landmark: Ints
    bearing: Floats
    distance: Floats
    sigma: Floats
    parallax: Floats
    left: Floats
    right: Floats
    nature: Ints
    as_point: Ints
    seen: Ints
    alive: Ints
    line: Floats
    point: Floats
    anchor: Floats
    extent: Floats
    tried: Ints
    drawn: Floats
    drawn_as: Ints
    errors: Floats
    rotation_prior: Floats
    closed: int = -CLOSE_EVERY
    slip: float = 1.0

    @classmethod
    def empty(cls) -> "Graph":
        """Nothing known."""
        none, whole = np.zeros(0), np.zeros(0, dtype=np.int64)
        pairs = np.zeros((0, 2))
        return cls(
            np.zeros((0, 3)), np.zeros((0, 5)), whole, whole, whole, none, none, none, none, none, none,
            whole, whole, whole, whole, pairs, np.zeros((0, 3)), pairs, pairs, np.zeros((0, 3), dtype=np.int64),
            np.zeros((0, 4)), np.zeros((0, 2), dtype=np.int64), np.zeros(4), np.array([0.0, 0.01]),
        )  # fmt: skip

    def with_rows(self, rows: Mapping[str, object]) -> "Graph":
        """With one or more rows more in each of the named arrays."""
        longer: dict[str, Any] = {}
        for name, more in rows.items():
            old = getattr(self, name)
            longer[name] = np.concatenate([old, np.asarray(more, dtype=old.dtype).reshape(-1, *old.shape[1:])])
        return replace(self, **longer)

    def counts(self) -> Ints:
        """How often each landmark was seen (m,)."""
        return np.bincount(self.landmark, minlength=len(self.nature))

    def rows_of(self, landmarks: Ints) -> Ints:
        """The sightings of these landmarks (l,)."""
        chosen = np.zeros(len(self.nature), dtype=bool)
        chosen[landmarks] = True
        return np.flatnonzero(chosen[self.landmark])


@dataclass(frozen=True)
class Looks:
    """How r landmarks look from r poses: bearing, distance (r,), and their derivatives by pose and by landmark."""

    bearing: Floats
    distance: Floats
    by_pose: Floats  # (r, 2, 3)
    by_landmark: Floats  # (r, 2, 2)


def looks(poses: Floats, is_point: Bools, line: Floats, point: Floats, anchor: Floats, ring: float) -> Looks:
    """From poses (r, 3) at lines (r, 2) and points (r, 3): a line's foot point, a point's rim. Radii are as given."""
    ux, uy, bearing, distance, along = _lines(poses, line, anchor)
    by_pose, by_landmark = np.zeros((len(line), 2, 3)), np.zeros((len(line), 2, 2))
    by_landmark[:, 0, 0], by_landmark[:, 1, 0], by_landmark[:, 1, 1] = 1.0, along, 1.0
    points = np.flatnonzero(is_point)
    if len(points):
        px, py = point[points, 0] - poses[points, 0], point[points, 1] - poses[points, 1]
        far = np.maximum(dmath.hypot(px, py), 1e-3)
        px_unit, py_unit = px / far, py / far
        ux[points], uy[points], distance[points] = px_unit, py_unit, far - point[points, 2]
        bearing[points] = dmath.atan2(py, px)
        turn_x, turn_y = py_unit / far, -px_unit / far
        by_pose[points, 0, 0], by_pose[points, 0, 1] = turn_x, turn_y
        by_landmark[points, 0, 0], by_landmark[points, 0, 1] = -turn_x, -turn_y
        by_landmark[points, 1, 0], by_landmark[points, 1, 1] = px_unit, py_unit
    by_pose[:, 0, 2], by_pose[:, 1, 0], by_pose[:, 1, 1] = -1.0, -ux, -uy
    return Looks(bearing - poses[:, 2] - ring, distance, by_pose, by_landmark)


def _lines(poses: Floats, line: Floats, anchor: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Of lines (r, 2): the normal (x, y) and its direction, the distance, and its derivative by the direction."""
    sine, cosine = dmath.sincos(line[:, 0])
    ax, ay = poses[:, 0] - anchor[:, 0], poses[:, 1] - anchor[:, 1]
    return cosine, sine, line[:, 0].copy(), line[:, 1] - (cosine * ax + sine * ay), sine * ax - cosine * ay


@dataclass(frozen=True)
class Sightings:
    """r sightings, ready to be held against poses and landmarks time and again.

    `sweep`, `landmark` (r,) number rows of those; `scale` (r, 2) is 1/σ of bearing and distance.
    """

    sweep: Ints
    landmark: Ints
    is_point: Bools
    anchor: Floats
    bearing: Floats
    distance: Floats
    scale: Floats

    @classmethod
    def of(cls, graph: Graph, rows: Ints, distance_sigma: float) -> "Sightings":
        """Those of these rows (r,)."""
        of = graph.landmark[rows]
        scale = np.full((len(rows), 2), 1.0 / distance_sigma)
        scale[:, 0] = 1.0 / graph.sigma[rows]
        return cls(
            graph.sweep[rows], of, graph.as_point[of] != 0, graph.anchor[of], graph.bearing[rows], graph.distance[rows],
            scale,
        )  # fmt: skip

    def residuals(self, poses: Floats, line: Floats, point: Floats, ring: float) -> tuple[Floats, Floats, Floats]:
        """What was measured minus what is expected (r, 2), in standard deviations, and its expectation's derivatives.

        (r, 2, 3) by the pose and (r, 2, 2) by the landmark; by RING it is −1/σ in the bearing.
        """
        of = self.landmark
        seen = looks(poses[self.sweep], self.is_point, line[of], point[of], self.anchor, ring)
        off = np.empty(self.scale.shape)
        off[:, 0], off[:, 1] = wrap(self.bearing - seen.bearing), self.distance - seen.distance
        scale = self.scale[:, :, None]
        return off * self.scale, seen.by_pose * scale, seen.by_landmark * scale


def sighting_residuals(graph: Graph, rows: Ints, distance_sigma: float) -> tuple[Floats, Floats, Floats]:
    """What `Sightings.residuals` says of these rows (r,) where everything is now."""
    sightings = Sightings.of(graph, rows, distance_sigma)
    return sightings.residuals(graph.poses, graph.line, graph.point, float(graph.errors[RING]))
