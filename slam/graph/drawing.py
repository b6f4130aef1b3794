"""The graph's sightings as members of chains: pieces of their landmarks' lines, where they are known to lie now."""

from dataclasses import replace
from typing import cast

import numpy as np

from slam import dmath
from slam.association import WALL, Chains, Member
from slam.dmath import Floats
from slam.geometry import Segment, wrap
from slam.graph.problem import RING, Graph
from slam.sweep import Ints

MOVED_M = 0.004
"""A member is made anew once an end of it lies that far from where it was."""


def along_lines(graph: Graph, rows: Ints) -> Floats:
    """Where each sighting's foot point lies on its line: metres from the anchor, along the tangent."""
    of = graph.landmark[rows]
    sine, cosine = dmath.sincos(graph.line[of, 0])
    off = graph.poses[graph.sweep[rows], :2] - graph.anchor[of]
    return np.asarray(cosine * off[:, 1] - sine * off[:, 0])


def drawn(graph: Graph, chains: Chains, since: int) -> tuple[Graph, Chains]:
    """One member for each sighting, in their order; those that have not moved or changed are the same objects.

    Only sightings of sweeps, and of landmarks seen, from number `since` on can have moved.
    """
    rows = np.flatnonzero((graph.sweep >= since) | (graph.seen[graph.landmark] >= since))
    alpha, rho, ends = _segments(graph, rows)
    kind = np.stack([graph.landmark[rows], graph.nature[graph.landmark[rows]]], axis=1)
    still = (np.abs(ends - graph.drawn[rows]).max(axis=1, initial=0.0) <= MOVED_M) & (graph.drawn_as[rows] == kind).all(
        axis=1
    )
    members: list[Member | None] = [*chains.members, *[None] * (len(graph.sweep) - len(chains.members))]
    for k in np.flatnonzero(~still).tolist():
        (x0, y0, x1, y1), (chain, nature), row = ends[k].tolist(), kind[k].tolist(), int(rows[k])
        piece = Segment(float(alpha[k]), float(rho[k]), (x0, y0), (x1, y1))
        members[row] = Member(chain, int(graph.sweep[row]), piece, nature)
    where, as_what = graph.drawn.copy(), graph.drawn_as.copy()
    where[rows[~still]], as_what[rows[~still]] = ends[~still], kind[~still]
    return replace(graph, drawn=where, drawn_as=as_what), Chains(
        cast(tuple[Member, ...], tuple(members)), _roots(graph)
    )


def _roots(graph: Graph) -> tuple[int, ...]:
    """Each chain's first member; −1 for a chain that has joined another."""
    first = np.full(len(graph.nature), len(graph.landmark), dtype=np.int64)
    np.minimum.at(first, graph.landmark, np.arange(len(graph.landmark)))
    return tuple(np.where(first < len(graph.landmark), first, -1).tolist())


def _segments(graph: Graph, rows: Ints) -> tuple[Floats, Floats, Floats]:
    """Of each sighting: α, ρ (r,), and its ends (r, 4); a wall on its landmark's line, all else as it was seen."""
    of, poses = graph.landmark[rows], graph.poses[graph.sweep[rows]]
    on_line = graph.nature[of] == WALL
    alpha = np.where(on_line, graph.line[of, 0], poses[:, 2] + graph.bearing[rows] + float(graph.errors[RING]))
    alpha = wrap(alpha)
    sine, cosine = dmath.sincos(alpha)
    along, off, far = along_lines(graph, rows), graph.line[of, 1], graph.distance[rows]
    x = np.where(on_line, graph.anchor[of, 0] + (cosine * off - sine * along), poses[:, 0] + cosine * far)
    y = np.where(on_line, graph.anchor[of, 1] + (sine * off + cosine * along), poses[:, 1] + sine * far)
    left, right = graph.left[rows], graph.right[rows]
    ends = np.stack([x - left * sine, y + left * cosine, x - right * sine, y + right * cosine], axis=1)
    return alpha, cosine * x + sine * y, ends
