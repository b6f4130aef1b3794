"""Loop closure: chains that turn out to be one wall become one, if the total error allows it.

A merge is tried, solved and kept or taken back. One that failed is tried again when more was seen of both: of the one
known less, too, for that a long wall is seen at every sweep does not tell what a stray echo was; or half as much again.
"""

from dataclasses import replace

import numpy as np

from slam import dmath
from slam.association import POINT
from slam.dmath import DEGREE, Floats
from slam.geometry import Bools, wrap
from slam.graph.config import GraphConfig
from slam.graph.problem import CLOSE_EVERY, Graph
from slam.graph.solver import part_from, solve, total_error
from slam.sweep import Ints

NEAR_M, NEAR_DEG = 0.03, 2.0
"""How far two chains of one wall may lie apart, and turned, when they were seen at the same time …"""
AWAY_M, AWAY_DEG = 0.03, 1.0
"""… and how much more for each √sweep between them."""
OLD_SWEEPS = 60
MORE = 5
"""Two chains are tried again when so many sightings more are known of them."""


def merged(graph: Graph, touched: Ints, first: int, config: GraphConfig) -> tuple[Graph, tuple[tuple[int, int], ...]]:
    """The graph with those of the landmarks just seen that are older ones joined to them, and the pairs (kept, gone).

    `first` is the first sweep that moves at every step; where an older landmark is met again, all since then move.
    """
    pairs = []
    for landmark in touched.tolist():
        if not graph.alive[landmark]:
            continue
        other = _likeliest(graph, landmark, config)
        if other is None:
            continue
        keep, gone = min(landmark, other), max(landmark, other)
        joined = _joined(graph, keep, gone, first, config)
        if joined is None:
            tried = graph.tried.copy()
            count = graph.counts()
            tried[gone] = (keep, count[keep], count[gone])
            tired = may_close(graph) and int(graph.sweep[graph.landmark == keep].min()) < first
            graph = replace(graph, tried=tried, closed=len(graph.poses) - 1 if tired else graph.closed)
        else:
            graph = joined
            pairs.append((keep, gone))
    return graph, tuple(pairs)


def _likeliest(graph: Graph, landmark: int, config: GraphConfig) -> int | None:
    """The landmark of the same nature that lies nearest, near enough to be the same."""
    count = graph.counts()
    may = (graph.alive != 0) & (count >= 2) & (graph.nature == graph.nature[landmark])
    may[landmark] = False
    if count[landmark] < 2 or not bool(may.any()):
        return None
    others = np.flatnonzero(may & ~_tried(graph, landmark, count))
    away = np.sqrt(np.minimum(np.abs(graph.seen[others] - graph.seen[landmark]), OLD_SWEEPS).astype(np.float64))
    if graph.nature[landmark] == POINT:
        off = dmath.hypot(*(graph.point[others, :2] - graph.point[landmark, :2]).T)
        near = off <= NEAR_M + AWAY_M * away
    else:
        turned = np.abs(wrap(graph.line[others, 0] - graph.line[landmark, 0]))
        alike = turned <= (NEAR_DEG + AWAY_DEG * away) * DEGREE
        others, away, turned = others[alike], away[alike], turned[alike]
        if not len(others):
            return None
        off, gap = _between(graph, landmark, others)
        off = off + turned
        near = (gap <= config.gap_m) & (off <= NEAR_M + AWAY_M * away + 0.05)
    others, off = others[near], off[near]
    return int(others[np.argmin(off)]) if len(others) else None


def _tried(graph: Graph, landmark: int, count: Ints) -> Bools:
    """Which landmarks it was tried with, nothing new being known since."""
    with_older = np.arange(len(count)) == graph.tried[landmark, 0]
    then = np.where(with_older[:, None], graph.tried[landmark, 1:], graph.tried[:, 1:])
    known, at_most = then[:, 0] + then[:, 1], np.minimum(then[:, 0], then[:, 1])
    both, lesser = count + count[landmark], np.minimum(count, count[landmark])
    again = (both >= known + MORE) & ((lesser > at_most) | (2 * both >= 3 * known))
    return np.asarray((with_older | (graph.tried[:, 0] == landmark)) & ~again)


def _between(graph: Graph, landmark: int, others: Ints) -> tuple[Floats, Floats]:
    """From a line's middle to other lines (o,): the distance, and the gap between their extents."""
    sine, cosine = dmath.sincos(graph.line[others, 0])
    alpha, d = graph.line[landmark].tolist()
    s, c = dmath.sincos(alpha)
    low, high = graph.extent[landmark].tolist()
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    x = float(graph.anchor[landmark, 0]) + c * d - s * middle
    y = float(graph.anchor[landmark, 1]) + s * d + c * middle
    dx, dy = x - graph.anchor[others, 0], y - graph.anchor[others, 1]
    off = np.abs((cosine * dx + sine * dy) - graph.line[others, 1])
    along, extent = cosine * dy - sine * dx, graph.extent[others]
    return off, np.maximum(np.maximum(extent[:, 0] - (along + half), (along - half) - extent[:, 1]), 0.0)


def _joined(graph: Graph, keep: int, gone: int, first: int, config: GraphConfig) -> Graph | None:
    """The graph with both as one, or None if that adds more to the total error than it may.

    If the sweeps that move at every step do not reach, those since the older one was first seen move too: a loop
    closes.
    """
    near = _joined_since(graph, keep, gone, first, config)
    oldest = int(graph.sweep[graph.landmark == keep].min())
    if near is not None or oldest >= first or not may_close(graph):
        return near
    all_since = solve(graph, part_from(graph, oldest), config)
    closed = replace(all_since, closed=len(graph.poses) - 1)
    return _joined_since(closed, keep, gone, oldest, config)


def may_close(graph: Graph) -> bool:
    """Whether older sweeps may move again."""
    return len(graph.poses) - 1 - graph.closed >= CLOSE_EVERY


def _joined_since(before: Graph, keep: int, gone: int, since: int, config: GraphConfig) -> Graph | None:
    part = part_from(before, since)
    landmark, alive, seen = before.landmark.copy(), before.alive.copy(), before.seen.copy()
    landmark[landmark == gone] = keep
    alive[gone] = 0
    seen[keep] = max(seen[keep], seen[gone])
    trial = replace(before, landmark=landmark, alive=alive, seen=seen)
    as_one = part_from(trial, since)
    after = solve(trial, as_one, config)
    added = total_error(after, as_one, config) - total_error(before, part, config)
    return after if added <= config.merge_margin else None
