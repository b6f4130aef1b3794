"""Wall or point: whether a chain's sightings are better explained by one line or by one point, and how thick that is.

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
TOLD_BY, MEASURED_BY = 8, 40
"""What has been seen so often is known: its nature, and its radius."""
STEPS = 3
RADIUS_M, WIDEST_M = 0.15, 0.5
"""A post has no radius, give or take so much, and is never thicker than that."""


def believed_parallax(parallax: Floats) -> Floats:
    """How much of it counts."""
    return np.clip(parallax, -BELIEVED, BELIEVED)


def tell_natures(graph: Graph, touched: Ints, config: GraphConfig, *, only_open: bool = False) -> Graph:
    """The graph with the natures and radii of these landmarks told anew, from the poses as they are.

    With `only_open` those whose nature is told already are left as they are.
    """
    count, nature = graph.counts()[touched], graph.nature[touched]
    may = (nature == OPEN) | (count <= TOLD_BY)
    chosen = may | ((nature == POINT) & (count <= MEASURED_BY))
    if only_open:
        chosen = nature == OPEN
    may, chosen = may[chosen], touched[chosen]
    if not len(chosen):
        return graph
    rows = graph.rows_of(chosen)
    (lines_fit, points_fit), (as_wall, as_point) = _told_apart(graph, chosen, rows, config)
    size = len(chosen)
    apart = np.bincount(np.searchsorted(chosen, graph.landmark[rows]), weights=graph.parallax[rows], minlength=size)
    as_wall, as_point = as_wall + np.maximum(apart, 0.0), as_point + np.maximum(-apart, 0.0)
    told = graph.nature[chosen]
    told = np.where(may & (as_point - as_wall > config.nature_margin), WALL, told)
    told = np.where(may & (as_wall - as_point > config.nature_margin), POINT, told)
    nature, taken = graph.nature.copy(), graph.as_point.copy()
    lines, points = graph.line.copy(), graph.point.copy()
    nature[chosen] = told
    taken[chosen] = (told == POINT) | ((told == OPEN) & (as_point < as_wall))
    lines[chosen[told != POINT]] = lines_fit[told != POINT]
    points[chosen[told != WALL]] = points_fit[told != WALL]
    return replace(graph, nature=nature, as_point=taken, line=lines, point=points)


def refitted(graph: Graph, chosen: Ints, config: GraphConfig) -> tuple[Graph, Floats]:
    """The graph with these landmarks (l,) where they explain their sightings best, from the poses as they are.

    And what each leaves over (l,), by its nature; what is not told yet by what explains it better.
    """
    (lines_fit, points_fit), (as_wall, as_point) = _told_apart(graph, chosen, graph.rows_of(chosen), config)
    lines, points, nature = graph.line.copy(), graph.point.copy(), graph.nature[chosen]
    lines[chosen], points[chosen] = lines_fit, points_fit
    left = np.where(nature == WALL, as_wall, np.where(nature == POINT, as_point, np.minimum(as_wall, as_point)))
    return replace(graph, line=lines, point=points), left


def _told_apart(
    graph: Graph, chosen: Ints, rows: Ints, config: GraphConfig
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """The lines (l, 2) and points (l, 3) that explain each landmark's sightings best, and the cost that each leaves.

    A point has a radius only if it explains them better with one: half the margin, for a path that was bent round it
    as if it had none hides it more and more.
    """
    size = len(chosen)
    fit, cost = _fitted(graph, chosen, rows, config)
    spot, post = cost[size : 2 * size], cost[2 * size :] + 0.5 * config.nature_margin
    thick = post < spot
    points = np.where(thick[:, None], fit[2 * size :], fit[size : 2 * size])
    return (fit[:size, :2], points), (cost[:size], np.where(thick, post, spot))


def _fitted(graph: Graph, chosen: Ints, rows: Ints, config: GraphConfig) -> tuple[Floats, Floats]:
    """What explains each landmark's sightings best: l lines, l points, l posts (3 l, 3), and the cost that each leaves.

    A post's radius goes out of its equations first.
    """
    size, count = len(chosen), len(rows)
    place = np.searchsorted(chosen, graph.landmark[rows])
    poses, ring = graph.poses[graph.sweep[rows]], float(graph.errors[RING])
    sine, cosine = dmath.sincos(poses[:, 2] + graph.bearing[rows] + ring)
    feet = poses[:, :2] + graph.distance[rows][:, None] * np.stack([cosine, sine], axis=1)
    seen = np.bincount(place, minlength=size).astype(np.float64)
    middle = [np.bincount(place, weights=feet[:, a], minlength=size) / seen for a in (0, 1)]
    lines, none = np.column_stack([graph.line[chosen], np.zeros(size)]), np.zeros(size)
    points = np.column_stack([*middle, none])
    known = graph.point[chosen, 2] > 0.0
    fit = np.concatenate([lines, points, np.where(known[:, None], graph.point[chosen], points)])
    # Each sighting three times: held against the line, the point and the post.
    every, kind = np.concatenate([place, place + size, place + 2 * size]), np.repeat(np.arange(3), count)
    sightings = Sightings.of(graph, np.tile(rows, 3), config.distance_sigma_m)
    sightings = replace(sightings, landmark=every, is_point=kind > 0)
    share = 9 * every[:, None, None] + np.arange(9).reshape(3, 3)
    mine = 3 * place[:, None] + np.arange(3)
    # At first a post that nobody knows yet listens to all that was seen of it.
    fresh = (kind == 2) & ~known[np.tile(place, 3)]
    off = np.zeros((3 * count, 2))
    for step in range(STEPS):
        off, _, by_landmark = sightings.residuals(graph.poses, fit, fit, ring)
        believed = weights(off, config.kernel)
        if step == 0:
            believed[fresh] = 1.0
        shares = np.concatenate([by_landmark, off[:, :, None]], axis=2) * np.sqrt(believed)[:, :, None]
        equations = summed(share, squares(shares), (3 * size, 3, 3))
        nearer = np.sqrt(believed[2 * count :, 1]) / config.distance_sigma_m
        tie = -summed(mine, nearer[:, None] * shares[2 * count :, 1], (size, 3))
        tie[:, 2] -= fit[2 * size :, 2] / (RADIUS_M * RADIUS_M)
        own = summed(place, nearer * nearer, (size,)) + 1.0 / (RADIUS_M * RADIUS_M)
        equations[2 * size :] -= tie[:, :, None] * (tie / own[:, None])[:, None, :]
        move = times(inverse(equations[:, :2, :2]), equations[:, :2, 2:])[:, :, 0]
        of_posts = move[2 * size :]
        wider = (tie[:, 2] - (tie[:, 0] * of_posts[:, 0] + tie[:, 1] * of_posts[:, 1])) / own
        fit[:, :2] += move
        fit[2 * size :, 2] = np.clip(fit[2 * size :, 2] + wider, 0.0, WIDEST_M)
    cost = kernel_cost(off, config.kernel)
    radius = fit[:, 2] / RADIUS_M
    return fit, summed(every, cost[:, 0] + cost[:, 1], (3 * size,)) + radius * radius
