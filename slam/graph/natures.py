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

TOLD_BY = 8
"""What has been seen so often is known."""
STEPS = 3


def tell_natures(graph: Graph, touched: Ints, config: GraphConfig, *, only_open: bool = False) -> Graph:
    """The graph with the natures of these landmarks told anew, from the poses as they are.

    With `only_open` those whose nature is told already keep it.
    """
    count, is_open = graph.counts()[touched], graph.nature[touched] == OPEN
    chosen = touched[(count >= 2) & (is_open | ((count <= TOLD_BY) & (not only_open)))]
    if not len(chosen):
        return graph
    mask = np.zeros(len(graph.nature), dtype=bool)
    mask[chosen] = True
    fit, cost = _fitted(graph, chosen, graph.rows_of(mask), config)
    size = len(chosen)
    as_wall, as_point = cost[:size], cost[size:]
    told = graph.nature[chosen]
    told = np.where(as_point - as_wall > config.nature_margin, WALL, told)
    told = np.where(as_wall - as_point > config.nature_margin, POINT, told)
    nature, taken = graph.nature.copy(), graph.as_point.copy()
    lines, points = graph.line.copy(), graph.point.copy()
    nature[chosen] = told
    taken[chosen] = (told == POINT) | ((told == OPEN) & (as_point < as_wall))
    lines[chosen[told != POINT]] = fit[:size][told != POINT]
    points[chosen[told != WALL]] = fit[size:][told != WALL]
    return replace(graph, nature=nature, as_point=taken, line=lines, point=points)


def _fitted(graph: Graph, chosen: Ints, rows: Ints, config: GraphConfig) -> tuple[Floats, Floats]:
    """What explains each landmark's sightings best: l lines, then l points (2 l, 2), and the cost that each leaves."""
    size, count = len(chosen), len(rows)
    place = np.searchsorted(chosen, graph.landmark[rows])
    poses, ring = graph.poses[graph.sweep[rows]], float(graph.errors[RING])
    sine, cosine = dmath.sincos(poses[:, 2] + graph.bearing[rows] + ring)
    feet = poses[:, :2] + graph.distance[rows][:, None] * np.stack([cosine, sine], axis=1)
    seen = np.bincount(place, minlength=size).astype(np.float64)
    middle = [np.bincount(place, weights=feet[:, a], minlength=size) / seen for a in (0, 1)]
    fit = np.concatenate([graph.line[chosen], np.stack(middle, axis=1)])
    # Each sighting twice: once held against the line, once against the point.
    both, is_point = np.concatenate([place, place + size]), np.arange(2 * count) >= count
    poses, rows = np.concatenate([poses, poses]), np.concatenate([rows, rows])
    anchor = graph.anchor[graph.landmark[rows]]
    sigma = np.stack([graph.sigma[rows], np.full(2 * count, config.distance_sigma_m)], axis=1)

    def summed(values: Floats) -> Floats:
        return np.asarray(np.bincount(both, weights=values, minlength=2 * size), dtype=np.float64)

    total = np.zeros(2 * size)
    for _ in range(STEPS):
        look = looks(poses, is_point, fit[both], fit[both], anchor, ring)
        off = np.stack([wrap(graph.bearing[rows] - look.bearing), graph.distance[rows] - look.distance], axis=1) / sigma
        cost, weight = kernel_cost(off, config.kernel), weights(off, config.kernel)
        total = summed(cost[:, 0] + cost[:, 1])
        jacobian = look.by_landmark / sigma[:, :, None]
        weighted = jacobian * weight[:, :, None]
        first, mixed, second = (
            summed(weighted[:, 0, a] * jacobian[:, 0, b] + weighted[:, 1, a] * jacobian[:, 1, b])
            for a, b in ((0, 0), (0, 1), (1, 1))
        )
        right = [summed(weighted[:, 0, a] * off[:, 0] + weighted[:, 1, a] * off[:, 1]) for a in (0, 1)]
        first, second = first + 1e-6, second + 1e-6
        change = [second * right[0] - mixed * right[1], first * right[1] - mixed * right[0]]
        fit = fit + np.stack(change, axis=1) / (first * second - mixed * mixed)[:, None]
    return fit, total
