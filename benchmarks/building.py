"""A large building for long logs, as a world file: one corridor, folded and closed to a ring, with doors and rooms.

The same lengths give the same building. Must not know: robots, recordings.
"""

from collections.abc import Iterator
from dataclasses import dataclass

HALF_WIDTH_M = 1.0  # of the corridor
PITCH_M = 6.0  # from one leg of the corridor to the next
MARGIN_M = 3.0  # no doors so near to a bend
ROOM_M = 1.9  # deep: two rooms back to back fit between two legs
STATION_M = 0.8

MATERIALS = """[materials]
plaster = { half_beam_deg = 14.0 }
door = { half_beam_deg = 15.0 }
wood = { half_beam_deg = 13.0 }
"""

Point = tuple[float, float]


@dataclass(frozen=True)
class Building:
    """`legs` (even) parallel stretches of corridor, each `leg_m` long, and one that leads from the last to the first.

    The robot starts at (0, 0) in the first leg, which runs along x.
    """

    legs: int = 10
    leg_m: float = 40.0

    def ring(self) -> list[Point]:
        """The corridor's middle: corners in order, counter-clockwise."""
        points: list[Point] = [(-2.0 * PITCH_M, 0.0)]
        for leg in range(self.legs):
            y = PITCH_M * leg
            inner, outer = (0.0, self.leg_m) if leg % 2 == 0 else (self.leg_m, 0.0)
            points += [(inner, y)] if leg and leg % 2 == 0 else []
            points += [(outer, y)] if leg < self.legs - 1 else [(-2.0 * PITCH_M, y)]
            points += [(self.leg_m, y + PITCH_M)] if leg % 2 == 0 else []
        return points

    def length_m(self) -> float:
        """Once round."""
        ring = self.ring()
        return sum(abs(b[0] - a[0]) + abs(b[1] - a[1]) for a, b in zip(ring, [*ring[1:], ring[0]], strict=True))

    def toml(self, metres: float) -> str:
        """The world file, its tour so many metres long."""
        ring = self.ring()
        stations = max(1, round(metres / STATION_M))
        about = f"folded corridor of {self.length_m():.0f} m with doors and rooms"
        tour = f"repeat {stations} (scan; follow {STATION_M})"
        return "\n".join(
            [f'about = "{about}"\ntour = "{tour}"\n', MATERIALS, *self._side(ring, 1.0), *self._side(ring, -1.0)]
        )

    def _side(self, ring: list[Point], side: float) -> Iterator[str]:
        """One side of the corridor (1: left), stretch by stretch."""
        count = len(ring)
        corners = [_corner(ring[k - 1], ring[k], ring[(k + 1) % count], side) for k in range(count)]
        for k in range(count):
            yield from _stretch(corners[k], corners[(k + 1) % count], side, k)


def _corner(before: Point, here: Point, after: Point, side: float) -> Point:
    """Where the two walls on that side of a bend meet."""
    ax, ay = _direction(before, here)
    bx, by = _direction(here, after)
    x = here[0] - side * HALF_WIDTH_M * (ay + by)
    y = here[1] + side * HALF_WIDTH_M * (ax + bx)
    return (x, y) if (ax, ay) != (bx, by) else (here[0] - side * HALF_WIDTH_M * ay, here[1] + side * HALF_WIDTH_M * ax)


def _direction(a: Point, b: Point) -> Point:
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = abs(dx) + abs(dy)
    return dx / length, dy / length


def _stretch(a: Point, b: Point, side: float, number: int) -> Iterator[str]:
    """A wall from bend to bend: closed doors set back by 12 cm, and rooms behind open ones, at uneven distances."""
    (dx, dy), length = _direction(a, b), abs(b[0] - a[0]) + abs(b[1] - a[1])

    def at(along: float, out: float) -> Point:
        return a[0] + along * dx - side * out * dy, a[1] + along * dy + side * out * dx

    wall, place, k = [at(0.0, 0.0)], MARGIN_M + 0.7 * (number % 3) + (1.1 if side > 0 else 0.0), number
    while place + 3.2 < length - MARGIN_M:
        if k % 3:
            wall += [at(place, 0.0), at(place, 0.12)]
            yield _wall("door", [at(place, 0.12), at(place + 0.9, 0.12)])
            yield _wall("plaster", wall)
            wall = [at(place + 0.9, 0.12), at(place + 0.9, 0.0)]
        elif side > 0:  # the rooms between two legs belong to the leg that has them on its left
            yield _wall("plaster", [*wall, at(place + 1.0, 0.0)])
            wall = [at(place + 2.0, 0.0)]
            yield from _room(at(place, 0.0), at(place + 3.2, 0.0), at(place + 3.2, ROOM_M), at(place, ROOM_M), k)
        place += 4.1 + 0.6 * (k % 4)
        k += 1
    yield _wall("plaster", [*wall, at(length, 0.0)])


def _room(a: Point, b: Point, c: Point, d: Point, number: int) -> Iterator[str]:
    """Three walls, and in every other room a cupboard in a corner."""
    yield _wall("plaster", [a, d, c, b])
    if number % 2:
        ex, ey = _direction(d, c)
        fx, fy = _direction(d, a)
        yield _wall(
            "wood",
            [
                (d[0] + 1.1 * ex, d[1] + 1.1 * ey),
                (d[0] + 1.1 * ex + 0.5 * fx, d[1] + 1.1 * ey + 0.5 * fy),
                (d[0] + 0.5 * fx, d[1] + 0.5 * fy),
            ],
        )


def _wall(material: str, points: list[Point]) -> str:
    text = ", ".join(f"[{x:.3f}, {y:.3f}]" for x, y in points)
    return f'[[walls]]\nmaterial = "{material}"\npoints = [{text}]\n'
