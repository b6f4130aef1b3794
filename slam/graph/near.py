"""The landmarks that may be seen from a place, and as what: one whose nature is not told yet as a line and a point."""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.association import POINT, WALL
from slam.dmath import DEGREE, Floats
from slam.graph.config import GraphConfig
from slam.graph.placing import Line, Point
from slam.graph.problem import RING, Graph, Looks, looks
from slam.sweep import Ints

REACH_M = 7.0
"""No sonar sees a landmark from farther away."""
OLD_SWEEPS = 40
"""A pose does not grow more uncertain than over so many sweeps: that is what closing loops is for."""


@dataclass(frozen=True)
class Near:
    """The landmarks near by (l,), where they are: `line`, `anchor` (l, 2), `point` (l, 3).

    Those that may be lines are numbers `as_line` of them, with their `extent` (…, 2); those that may be points
    `as_point`. Lines, then points: `extra` (c, 3) is how much less certain the pose is from where each was seen last.
    """

    landmark: Ints
    line: Floats
    point: Floats
    anchor: Floats
    as_line: Ints
    as_point: Ints
    extent: Floats
    extra: Floats
    ring: float

    @classmethod
    def to(cls, graph: Graph, pose: Floats, config: GraphConfig) -> "Near":
        """Those in reach of a pose (3,)."""
        near = _in_reach(graph, pose)
        nature = graph.nature[near]
        as_line, as_point = np.flatnonzero(nature != POINT), np.flatnonzero(nature != WALL)
        away = np.minimum(len(graph.poses) - graph.seen[near], OLD_SWEEPS).astype(np.float64)
        growth = np.array([s * s for s in (config.away_m, config.away_m, config.away_deg * DEGREE)])
        return cls(
            near, graph.line[near], graph.point[near], graph.anchor[near], as_line, as_point,
            graph.extent[near[as_line]], away[np.concatenate([as_line, as_point])][:, None] * growth,
            float(graph.errors[RING]),
        )  # fmt: skip

    def looks(self, pose: Floats) -> Looks:
        """How they look from a pose (3,): lines, then points."""
        of = np.concatenate([self.as_line, self.as_point])
        is_point = np.arange(len(of)) >= len(self.as_line)
        there = np.broadcast_to(pose, (len(of), 3))
        return looks(there, is_point, self.line[of], self.point[of], self.anchor[of], self.ring)

    def mark(self, number: int, as_point: bool) -> Line | Point:
        """One of them by itself."""
        if as_point:
            return Point(*self.point[number].tolist())
        (alpha, off), (x, y) = self.line[number].tolist(), self.anchor[number].tolist()
        sine, cosine = dmath.sincos(alpha)
        return Line(alpha, (cosine, sine), off + (cosine * x + sine * y))


def _in_reach(graph: Graph, pose: Floats) -> Ints:
    """The landmarks no part of which is out of reach."""
    sine, cosine = dmath.sincos(graph.line[:, 0])
    dx, dy = pose[0] - graph.anchor[:, 0], pose[1] - graph.anchor[:, 1]
    along, across = cosine * dy - sine * dx, (cosine * dx + sine * dy) - graph.line[:, 1]
    beside = np.maximum(np.maximum(graph.extent[:, 0] - along, along - graph.extent[:, 1]), 0.0)
    return np.flatnonzero((graph.alive != 0) & (dmath.hypot(beside, across) <= REACH_M))
