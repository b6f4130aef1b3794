"""A random place in the making: the numbers it is drawn by, its outlines, its tour, and the room that is left to that.

Must not know: what kinds of places there are.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from sonarlog.sim.outline import Edge, Outline, from_edge, gap
from sonarlog.sim.random_tour import Tour
from sonarlog.sim.rng import Noise

WALL_M = 0.12
"""No two walls are nearer to one another."""
ROOM_TO_PASS_M = 0.5
"""The tour's line is nowhere nearer to a surface."""


class Dice:
    """Numbers in the order they are asked for."""

    def __init__(self, number: int) -> None:
        self._noise = Noise(number, "random world")
        self._count = 0

    def between(self, low: float, high: float) -> float:
        """Evenly, in whole hundredths."""
        self._count += 1
        return round(low + (high - low) * self._noise.uniform(self._count), 2)

    def whole(self, low: int, high: int) -> int:
        """Evenly, both ends included."""
        self._count += 1
        return low + self._noise.bits(self._count) % (high - low + 1)

    def chance(self, share: float) -> bool:
        """True so often."""
        self._count += 1
        return self._noise.uniform(self._count) < share

    def side(self) -> int:
        """1 left, -1 right."""
        return 1 if self.chance(0.5) else -1


@dataclass
class Place:
    """A world in the making."""

    about: str
    outlines: list[Outline]
    tour: Tour
    poles: list[tuple[float, float, float]]
    narrow: bool = False
    glass: tuple[str, ...] = ("silent", "seldom", "narrow")

    def edges(self) -> list[Edge]:
        """All pieces of all outlines."""
        return [edge for outline in self.outlines for edge in outline]


def clear(place: Place, edges: Sequence[Edge], poles: Sequence[tuple[float, float, float]] = ()) -> bool:
    """Whether the tour passes all of these with room."""
    line = place.tour.line
    ways = [Edge(a, b, "") for a, b in zip(line[::2], line[1::2], strict=True) if a != b]
    return all(gap(way, edge) >= ROOM_TO_PASS_M for way in ways for edge in edges) and all(
        from_edge((x, y), way) - radius >= ROOM_TO_PASS_M for way in ways for x, y, radius in poles
    )


def replaced(outline: Outline, all_outlines: Sequence[Outline], n: int, pieces: Outline) -> bool:
    """Put these pieces in the place of edge n, unless they come too near to anything."""
    near = {id(outline[n - 1]), id(outline[n]), id(outline[(n + 1) % len(outline)])}
    others = [edge for each in all_outlines for edge in each if id(edge) not in near]
    added = pieces[1:-1]
    if any(gap(piece, other) < WALL_M for piece in added for other in others):
        return False
    beside = [outline[n - 1], outline[(n + 1) % len(outline)]]
    if any(gap(piece, other) < WALL_M for piece in added[1:-1] for other in beside):
        return False
    outline[n : n + 1] = pieces
    return True
