"""Least-squares problems made by hand: poses, lines and points, and who sees what, with the noise that is asked for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, WALL
from slam.dmath import Floats
from slam.geometry import Pose
from slam.graph.problem import Graph, looks


@dataclass(frozen=True)
class Line:
    """The line n·p = rho with n = (cos alpha, sin alpha)."""

    alpha: float
    rho: float


@dataclass(frozen=True)
class Spot:
    """A point, or a post."""

    x: float
    y: float
    radius: float = 0.0


SIGMA = 0.005
"""Of every bearing, rad."""


def graph_of(
    poses: Sequence[Pose], things: Sequence[Line | Spot], seen: Sequence[tuple[int, int]], *, told: bool = True
) -> Graph:
    """Everything where it truly is: sighting k is pose `seen[k][0]`'s of thing `seen[k][1]`, odometry is exact.

    What is not told counts as a line through the foot point that was seen first.
    """
    places = np.array([[p.x, p.y, p.theta] for p in poses])
    steps = [Pose(0.0, 0.0, 0.0), *(a.step_to(b) for a, b in pairwise(poses))]
    sweep = np.array([s for s, _ in seen], dtype=np.int64)
    landmark = np.array([t for _, t in seen], dtype=np.int64)
    is_point = np.array([isinstance(thing, Spot) for thing in things])
    first = [int(sweep[landmark == k].min()) for k in range(len(things))]
    line, anchor = np.zeros((len(things), 2)), np.zeros((len(things), 2))
    for k, thing in enumerate(things):
        here = poses[first[k]]
        if isinstance(thing, Spot):
            anchor[k] = (thing.x, thing.y)
            line[k, 0] = dmath.atan2(thing.y - here.y, thing.x - here.x)
        else:
            sine, cosine = dmath.sincos(thing.alpha)
            off = thing.rho - (cosine * here.x + sine * here.y)
            anchor[k] = (here.x + off * cosine, here.y + off * sine)
            line[k, 0] = thing.alpha
    radii = [thing.radius if isinstance(thing, Spot) else 0.0 for thing in things]
    point = np.column_stack([anchor, radii])
    looked = looks(places[sweep], is_point[landmark], line[landmark], point[landmark], anchor[landmark], 0.0)
    count = len(things)
    empty = Graph.empty().with_rows(
        {
            "poses": places,
            "motions": [[s.x, s.y, 0.0, s.theta, 0.0] for s in steps],
            "joined": [0] + [1] * (len(poses) - 1),
            "sweep": sweep,
            "landmark": landmark,
            "bearing": looked.bearing,
            "distance": looked.distance,
            "sigma": np.full(len(seen), SIGMA),
            "parallax": np.zeros(len(seen)),
            "left": np.full(len(seen), -0.2),
            "right": np.full(len(seen), 0.2),
            "nature": np.where(is_point, POINT, WALL) if told else np.full(count, OPEN),
            "as_point": is_point if told else np.zeros(count),
            "seen": [int(sweep[landmark == k].max()) for k in range(count)],
            "alive": np.ones(count),
            "line": line,
            "point": point,
            "anchor": anchor,
            "extent": np.tile([-0.2, 0.2], (count, 1)),
            "tried": np.full((count, 3), -1),
            "drawn": np.full((len(seen), 4), np.inf),
            "drawn_as": np.full((len(seen), 2), -1),
        }
    )
    return stretched(empty)


def stretched(graph: Graph) -> Graph:
    """With every landmark as long as it was seen."""
    sine, cosine = dmath.sincos(graph.line[graph.landmark, 0])
    off = graph.poses[graph.sweep, :2] - graph.anchor[graph.landmark]
    along = cosine * off[:, 1] - sine * off[:, 0]
    extent = np.stack([np.full(len(graph.nature), np.inf), np.full(len(graph.nature), -np.inf)], axis=1)
    np.minimum.at(extent[:, 0], graph.landmark, along + graph.left)
    np.maximum.at(extent[:, 1], graph.landmark, along + graph.right)
    return replace(graph, extent=extent)


def shaken(graph: Graph, seed: int, by: float = 0.01) -> Graph:
    """Poses but the first, landmarks, not their radii, and errors, off by something with this σ (errors: a tenth)."""
    rng = np.random.default_rng(seed)

    def off(values: Floats, sigma: float) -> Floats:
        return np.asarray(values + rng.normal(0.0, sigma, values.shape))

    poses = off(graph.poses, by)
    poses[0] = graph.poses[0]
    return replace(
        graph,
        poses=poses,
        line=off(graph.line, by),
        point=np.column_stack([off(graph.point[:, :2], by), graph.point[:, 2]]),
        errors=off(graph.errors, 0.1 * by),
    )
