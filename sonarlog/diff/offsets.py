"""How far one wall lies from another, piece by piece: where both were seen, not where their best lines would lead.

So a wall that is bent alike in both has moved by nothing. Must not know: how walls were matched, words.
"""

from dataclasses import dataclass

import numpy as np

from sonarlog.diff.walls import Wall
from sonarlog.log import Floats

ASIDE_M = 0.30
"""Pieces further apart along the wall do not tell of one another."""
SIGMAS = 2.0


@dataclass(frozen=True)
class Offset:
    """From A to B: moved across, at the middle of what both saw, away from the robot positive; and turned about it.

    Each with its standard error, 0 where there are too few pieces to tell.
    """

    moved_m: float
    turned_rad: float
    moved_error_m: float = 0.0
    turned_error_rad: float = 0.0

    @property
    def moved(self) -> bool:
        """Whether the pieces agree that it moved at all."""
        return abs(self.moved_m) > SIGMAS * self.moved_error_m

    @property
    def turned(self) -> bool:
        """Whether they agree that it turned at all."""
        return abs(self.turned_rad) > SIGMAS * self.turned_error_rad


def offset(a: Wall, b: Wall, alpha: float, lines: tuple[float, float]) -> Offset:
    """How far B lies from A across the direction `alpha` halfway between their normals.

    `lines` are how far and how turned their best lines lie, which stands where fewer than three pieces tell more.
    """
    rows = [*_pairs(a, b, alpha, 1.0), *_pairs(b, a, alpha, -1.0)]
    if len(rows) < 3:
        return Offset(*lines)
    place, off = np.array(rows).T
    place = place - place.mean()
    spread = float(np.sum(place * place))
    moved = float(off.mean())
    if spread < ASIDE_M**2:
        return Offset(moved, lines[1], float(off.std()) / np.sqrt(len(off)))
    slope = float(np.sum(place * off)) / spread
    left = off - moved - slope * place
    sigma = float(np.sqrt(np.sum(left * left) / max(1, len(off) - 2)))
    return Offset(moved, float(np.arctan(slope)), sigma / float(np.sqrt(len(off))), sigma / float(np.sqrt(spread)))


def _pairs(a: Wall, b: Wall, alpha: float, sign: float) -> list[tuple[float, float]]:
    """For each piece of A the nearest of B along the wall: where, and how far B's lies across."""
    normal, along = np.array([np.cos(alpha), np.sin(alpha)]), np.array([-np.sin(alpha), np.cos(alpha)])
    mine, yours = _middles(a), _middles(b)
    here, there = mine @ along, yours @ along
    rows = []
    for k in range(len(mine)):
        nearest = int(np.argmin(np.abs(there - here[k])))
        if abs(there[nearest] - here[k]) <= ASIDE_M:
            # The piece's own direction carries it to the same place along the wall.
            piece = b.pieces[nearest]
            lean = float(np.tan(piece.alpha - alpha))
            across = float(normal @ yours[nearest]) - lean * float(here[k] - there[nearest])
            rows.append((float(here[k]), sign * (across - float(normal @ mine[k]))))
    return rows


def _middles(wall: Wall) -> Floats:
    return np.array([piece.middle for piece in wall.pieces])
