"""Outlines of free space, drawn as rooms are built: a strip along a line, niches, rooms and panes let into its walls.

Points are (x, y) in metres; an outline runs round the free space with it on the left. + − * / sqrt and `slam.dmath`
only. Must not know: chance, robots, sonar.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from slam.dmath import DEGREE, hypot, sincos

Point = tuple[float, float]


@dataclass(frozen=True)
class Edge:
    """One straight piece of an outline, its free space on the left; `material` by name."""

    start: Point
    end: Point
    material: str

    @property
    def length(self) -> float:
        """Metres."""
        return hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    def at(self, along: float, out: float = 0.0) -> Point:
        """The point so far along the edge, and so far behind it."""
        ux, uy = (self.end[0] - self.start[0]) / self.length, (self.end[1] - self.start[1]) / self.length
        return self.start[0] + along * ux + out * uy, self.start[1] + along * uy - out * ux


Outline = list[Edge]


@dataclass(frozen=True)
class Leg:
    """A straight piece of the way: so long, so much free to its left and right, then a turn (degrees, left positive).

    Where it turns, the next leg is as wide.
    """

    length: float
    left: float
    right: float
    turn: float = 0.0


@dataclass(frozen=True)
class Stretch:
    """A leg laid into the plane: where it begins, the unit vector along it, and its way."""

    start: Point
    ux: float
    uy: float
    leg: Leg

    def at(self, along: float, left: float = 0.0) -> Point:
        """The point so far along the leg, and so far to the left of it."""
        return self.start[0] + along * self.ux - left * self.uy, self.start[1] + along * self.uy + left * self.ux


def laid(legs: Sequence[Leg], before: float) -> list[Stretch]:
    """The legs one after the other; (0, 0) lies `before` metres along the first, which runs along x."""
    x, y, heading = -before, 0.0, 0.0
    stretches = []
    for leg in legs:
        uy, ux = sincos(heading * DEGREE)
        stretches.append(Stretch((x, y), ux, uy, leg))
        x, y = stretches[-1].at(leg.length)
        heading += leg.turn
    return stretches


def strip(stretches: Sequence[Stretch], material: str) -> Outline:
    """The outline of the space along the legs, closed at both ends."""
    first, last = stretches[0], stretches[-1]
    end = last.leg.length
    right = [first.at(0.0, -first.leg.right), *_side(stretches, -1.0), last.at(end, -last.leg.right)]
    left = [first.at(0.0, first.leg.left), *_side(stretches, 1.0), last.at(end, last.leg.left)]
    return closed([*right, *reversed(left)], material)


def ring(stretches: Sequence[Stretch], material: str) -> list[Outline]:
    """The two outlines of the space along legs that come back to where they began, turning left: without, within."""
    round_again = [*stretches, stretches[0]]
    right, left = list(_side(round_again, -1.0)), list(_side(round_again, 1.0))
    return [closed(right, material), closed(left[::-1], material)]


def closed(points: Sequence[Point], material: str) -> Outline:
    """The polygon through these points, all of one material."""
    return [Edge(a, b, material) for a, b in pairwise([*points, points[0]])]


def _side(stretches: Sequence[Stretch], side: float) -> Iterator[Point]:
    """Where the wall on that side (1 left, -1 right) bends from leg to leg: a turn has one point, a step two."""
    for a, b in pairwise(stretches):
        here, there = (s.leg.left if side > 0 else s.leg.right for s in (a, b))
        if a.leg.turn == 0.0:
            if here != there:
                yield a.at(a.leg.length, side * here)
                yield b.at(0.0, side * there)
            continue
        # Both lines' offset n·p = here, solved: the sum of the normals, over one and the cosine between them.
        share = side * here / (1.0 + a.ux * b.ux + a.uy * b.uy)
        x, y = b.start
        yield x - share * (a.uy + b.uy), y + share * (a.ux + b.ux)


def niche(edge: Edge, along: float, width: float, depth: float, back: str) -> Outline:
    """The edge with a recess so far behind it (in front, if negative), its back of another material."""
    p, q, far = edge.at(along), edge.at(along + width), edge.at(along + width, depth)
    near = edge.at(along, depth)
    return [
        Edge(edge.start, p, edge.material),
        Edge(p, near, edge.material),
        Edge(near, far, back),
        Edge(far, q, edge.material),
        Edge(q, edge.end, edge.material),
    ]


def room(edge: Edge, along: float, door: float, jamb: float, size: tuple[float, float, float]) -> Outline:
    """The edge with a doorway and a room behind it; `size`: to the door's one side, to its other side, depth."""
    before, after, depth = size
    m = edge.material
    p, q = edge.at(along), edge.at(along + door)
    points = [
        p,
        edge.at(along, jamb),
        edge.at(along - before, jamb),
        edge.at(along - before, jamb + depth),
        edge.at(along + door + after, jamb + depth),
        edge.at(along + door + after, jamb),
        edge.at(along + door, jamb),
        q,
    ]
    return [Edge(edge.start, p, m), *(Edge(a, b, m) for a, b in pairwise(points)), Edge(q, edge.end, m)]


def pane(edge: Edge, along: float, width: float, material: str) -> Outline:
    """The edge with a piece of another material in its line."""
    p, q = edge.at(along), edge.at(along + width)
    return [Edge(edge.start, p, edge.material), Edge(p, q, material), Edge(q, edge.end, edge.material)]


def box(x: float, y: float, size: tuple[float, float], turned_deg: float, material: str) -> Outline:
    """A rectangle round that centre."""
    sine, cosine = sincos(turned_deg * DEGREE)
    corners = [(sx * size[0] / 2, sy * size[1] / 2) for sx, sy in ((-1, -1), (-1, 1), (1, 1), (1, -1))]
    return closed([(x + a * cosine - b * sine, y + a * sine + b * cosine) for a, b in corners], material)


def gap(a: Edge, b: Edge) -> float:
    """Metres between two pieces; 0 where they cross."""
    if _crosses(a, b) and _crosses(b, a):
        return 0.0
    return min(from_edge(a.start, b), from_edge(a.end, b), from_edge(b.start, a), from_edge(b.end, a))


def from_edge(point: Point, edge: Edge) -> float:
    """Metres from a point to a piece."""
    dx, dy = edge.end[0] - edge.start[0], edge.end[1] - edge.start[1]
    px, py = point[0] - edge.start[0], point[1] - edge.start[1]
    part = min(max((px * dx + py * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return hypot(px - part * dx, py - part * dy)


def is_simple(outline: Outline, apart: float) -> bool:
    """Whether all pieces that are no neighbours are at least so far apart."""
    last = len(outline) - 1
    return all(
        gap(outline[i], outline[k]) >= apart
        for i in range(len(outline))
        for k in range(i + 2, len(outline))
        if (i, k) != (0, last)
    )


def _crosses(a: Edge, b: Edge) -> bool:
    """Whether the ends of b lie on different sides of a's line."""
    ux, uy = a.end[0] - a.start[0], a.end[1] - a.start[1]
    sides = [ux * (p[1] - a.start[1]) - uy * (p[0] - a.start[0]) for p in (b.start, b.end)]
    return sides[0] * sides[1] < 0.0
