"""Wall or point: whether a chain's sightings are better explained by one line or by one point.

As the robot passes, the foot point on a wall goes with it; a corner, an edge or a pole stays where it is.
"""

from dataclasses import replace

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, WALL
from slam.dmath import Floats
from slam.geometry import wrap
from slam.graph.config import GraphConfig
from slam.graph.problem import RING, Graph, looks
from slam.graph.solver import kernel_cost, weights
from slam.sweep import Ints

TOLD_BY = 12
"""What has been seen so often is known."""
STEPS = 3


def tell_natures(graph: Graph, touched: Ints, config: GraphConfig) -> Graph:
    """The graph with the natures of these landmarks told anew, from the poses as they are."""
    count = graph.counts()[touched]
    chosen = touched[(count >= 2) & ((count <= TOLD_BY) | (graph.nature[touched] == OPEN))]
    if not len(chosen):
        return graph
    mask = np.zeros(len(graph.nature), dtype=bool)
    mask[chosen] = True
    rows = graph.rows_of(mask)
    place = np.searchsorted(chosen, graph.landmark[rows])
    line, as_wall = _fitted(graph, chosen, rows, place, WALL, config)
    point, as_point = _fitted(graph, chosen, rows, place, POINT, config)
    told = graph.nature[chosen]
    told = np.where(as_point - as_wall > config.nature_margin, WALL, told)
    told = np.where(as_wall - as_point > config.nature_margin, POINT, told)
    nature, lines, points = graph.nature.copy(), graph.line.copy(), graph.point.copy()
    nature[chosen] = told
    taken = graph.as_point.copy()
    taken[chosen] = (told == POINT) | ((told == OPEN) & (as_point < as_wall))
    lines[chosen[told != POINT]] = line[told != POINT]
    points[chosen[told != WALL]] = point[told != WALL]
    return replace(graph, nature=nature, as_point=taken, line=lines, point=points)


def _fitted(
    graph: Graph, chosen: Ints, rows: Ints, place: Ints, kind: int, config: GraphConfig
) -> tuple[Floats, Floats]:
    """The line or point (l, 2) that explains each landmark's sightings best, and the cost of what it leaves over."""
    size, poses = len(chosen), graph.poses[graph.sweep[rows]]
    count = np.bincount(place, minlength=size).astype(np.float64)
    ring, kernel = float(graph.errors[RING]), config.kernel

    def summed(values: Floats) -> Floats:
        return np.asarray(np.bincount(place, weights=values, minlength=size), dtype=np.float64)

    sine, cosine = dmath.sincos(poses[:, 2] + graph.bearing[rows] + ring)
    feet = poses[:, :2] + graph.distance[rows][:, None] * np.stack([cosine, sine], axis=1)
    middle = np.stack([summed(feet[:, 0]) / count, summed(feet[:, 1]) / count], axis=1)
    fit = graph.line[chosen] if kind == WALL else middle
    total = np.zeros(size)
    for _ in range(STEPS):
        seen = looks(
            poses, np.full(len(rows), kind == POINT), fit[place], fit[place], graph.anchor[chosen][place], ring
        )
        bearing = wrap(graph.bearing[rows] - seen.bearing) / graph.sigma[rows]
        off = np.stack([bearing, (graph.distance[rows] - seen.distance) / config.distance_sigma_m], axis=1)
        scale = np.stack([1.0 / graph.sigma[rows], np.full(len(rows), 1.0 / config.distance_sigma_m)], axis=1)
        jacobian, weight = seen.by_landmark * scale[:, :, None], weights(off, kernel)
        cost = kernel_cost(off, kernel)
        total = summed(cost[:, 0] + cost[:, 1])

        def pairs(a: int, b: int, j: Floats = jacobian, w: Floats = weight) -> Floats:
            return summed(w[:, 0] * j[:, 0, a] * j[:, 0, b] + w[:, 1] * j[:, 1, a] * j[:, 1, b])

        right = [
            summed(weight[:, 0] * jacobian[:, 0, a] * off[:, 0] + weight[:, 1] * jacobian[:, 1, a] * off[:, 1])
            for a in (0, 1)
        ]
        first, mixed, second = pairs(0, 0) + 1e-6, pairs(0, 1), pairs(1, 1) + 1e-6
        determinant = first * second - mixed * mixed
        change = [
            (second * right[0] - mixed * right[1]) / determinant,
            (first * right[1] - mixed * right[0]) / determinant,
        ]
        fit = fit + np.stack(change, axis=1)
    return fit, total
