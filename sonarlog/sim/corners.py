"""Where walls meet: the corners that mirror sound back, and the edges that only scatter a little.

Must not know: sonar, robots.
"""

from dataclasses import dataclass

from slam.dmath import DEGREE, cos
from sonarlog.sim.world import Wall

TOUCH_M = 1e-4  # walls this close meet
CORNER_DEG = (25.0, 155.0)
"""Flatter or narrower than this, two walls are no corner."""

Direction = tuple[float, float]


@dataclass(frozen=True)
class Corner:
    """Two walls that leave (x, y) along the unit vectors (ux, uy) and (wx, wy), counter-clockwise from u to w.

    Seen from between the two it is a concave corner, from anywhere else a convex edge (if it is one at all: where
    a wall ends in the middle of another, there is no edge). A wall's free end has u = w: an edge from everywhere.
    """

    x: float
    y: float
    ux: float
    uy: float
    wx: float
    wy: float
    concave: bool
    edge: bool

    def faces(self, dx: float, dy: float) -> bool:
        """Whether both walls are seen from (x + dx, y + dy)."""
        return self.ux * dy - self.uy * dx > 0.0 and dx * self.wy - dy * self.wx > 0.0


def find_corners(walls: tuple[Wall, ...]) -> list[Corner]:
    """All places where two walls meet at an angle, and free ends."""
    corners: list[Corner] = []
    for i, wall in enumerate(walls):
        for end, along in ((0, 1.0), (1, -1.0)):
            x, y = (wall.x0, wall.y0) if end == 0 else (wall.x1, wall.y1)
            u = _unit(wall, along)
            met = [(j, w) for j, other in enumerate(walls) if j != i for w in _directions(other, x, y)]
            through = len(met) == 2 and met[0][0] == met[1][0]
            corners.extend(_corner(x, y, u, w, edge=len(met) == 1) for j, w in met if through or i < j)
            if not met:
                corners.append(Corner(x, y, *u, *u, concave=False, edge=True))
    return [corner for corner in corners if corner.concave or corner.edge]


def _unit(wall: Wall, along: float) -> Direction:
    return (wall.x1 - wall.x0) / wall.length * along, (wall.y1 - wall.y0) / wall.length * along


def _directions(wall: Wall, x: float, y: float) -> list[Direction]:
    """In which directions that wall leaves the point: none, one from its end, both from its middle."""
    ux, uy = _unit(wall, 1.0)
    dx, dy = x - wall.x0, y - wall.y0
    along = dx * ux + dy * uy
    if abs(dx * uy - dy * ux) > TOUCH_M or not -TOUCH_M <= along <= wall.length + TOUCH_M:
        return []
    if along <= TOUCH_M:
        return [(ux, uy)]
    if along >= wall.length - TOUCH_M:
        return [(-ux, -uy)]
    return [(ux, uy), (-ux, -uy)]


def _corner(x: float, y: float, u: Direction, w: Direction, *, edge: bool) -> Corner:
    if u[0] * w[1] - u[1] * w[0] < 0.0:
        u, w = w, u
    cosine = u[0] * w[0] + u[1] * w[1]
    narrow, flat = (cos(degrees * DEGREE) for degrees in CORNER_DEG)
    return Corner(x, y, *u, *w, concave=flat <= cosine <= narrow, edge=edge and cosine >= flat)
