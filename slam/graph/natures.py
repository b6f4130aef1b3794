"""Wall or point: whether a chain's sightings are better explained by one line or by one point.

As the robot passes, the foot point on a wall goes with it; a corner, an edge or a pole stays where it is. And what is
near enough, the sonars of one sweep tell by themselves, for they stand apart (`slam.parallax`).
"""

from dataclasses import replace

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, WALL
from slam.dmath import Floats
from slam.graph.config import GraphConfig
from slam.graph.normal import inverse, squares, summed, times
from slam.graph.problem import RING, Graph, Sightings
from slam.graph.solver import kernel_cost, weights
from slam.sweep import Ints

BELIEVED = 12.0
"""A sweep's parallax says no more than that, in χ²: its arcs share what is wrong with them."""
TOLD_BY = 8
"""What has been seen so often is known."""
STEPS = 3


def believed_parallax(parallax: Floats) -> Floats:
    """How much of it counts."""
    return np.clip(parallax, -BELIEVED, BELIEVED)


def tell_natures(graph: Graph, touched: Ints, config: GraphConfig, *, only_open: bool = False) -> Graph:
    """The graph with the natures of these landmarks told anew, from the poses as they are.

    With `only_open` those whose nature is told already keep it.
    """
    count, is_open = graph.counts()[touched], graph.nature[touched] == OPEN
    chosen = touched[is_open | ((count <= TOLD_BY) & (not only_open))]
    if not len(chosen):
        return graph
    mask = np.zeros(len(graph.nature), dtype=bool)
    mask[chosen] = True
    rows = graph.rows_of(mask)
    fit, cost = _fitted(graph, chosen, rows, config)
    size = len(chosen)
    apart = np.bincount(np.searchsorted(chosen, graph.landmark[rows]), weights=graph.parallax[rows], minlength=size)
    as_wall, as_point = cost[:size] + np.maximum(apart, 0.0), cost[size:] + np.maximum(-apart, 0.0)
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
    twice = Sightings.of(graph, np.concatenate([rows, rows]), config.distance_sigma_m)
    twice = replace(twice, landmark=both, is_point=is_point)
    share = 9 * both[:, None, None] + np.arange(9).reshape(3, 3)
    off = np.zeros((2 * count, 2))
    for _ in range(STEPS):
        off, _, by_landmark = twice.residuals(graph.poses, fit, fit, ring)
        shares = np.concatenate([by_landmark, off[:, :, None]], axis=2)
        shares *= np.sqrt(weights(off, config.kernel))[:, :, None]
        equations = summed(share, squares(shares), (2 * size, 3, 3))
        fit = fit + times(inverse(equations[:, :2, :2]), equations[:, :2, 2:])[:, :, 0]
    cost = kernel_cost(off, config.kernel)
    return fit, summed(both, cost[:, 0] + cost[:, 1], (2 * size,))
