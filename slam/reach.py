"""How far a wall is drawn to either side of where it answered: as far as it was seen, or to what speaks against it.

A wall answers from the foot of the perpendicular alone; that it goes on to either side, as far as the beam is wide, is
a guess. It ends where something stands in line with it that was heard from aside, where sound or the robot went
through, and where a wall would have been heard, and was not. Must not know: the grid, natures, what is drawn.
"""

from dataclasses import dataclass

import numpy as np

from slam.dmath import Floats
from slam.geometry import Bools
from slam.links import EndConfig, ended_at, heard_through, heard_through_at
from slam.silence import missing
from slam.sweep import Ints

LEAST_M = 0.1
"""Where a wall answered there is so much of it to either side."""

OPEN_M = 0.2
"""What went through, or was not heard, tells of an opening that reaches so far to either side: a robot is as wide."""

BEHIND_M = 0.03
"""So far behind its foot what ends a wall still does: where a jamb answers, nobody knows on which side the wall is."""


@dataclass(frozen=True)
class Witnesses:
    """What may speak against a wall.

    `stations` (s, 3) and how far each heard nothing (`profiles` (s, DIRECTIONS) m), unless one of the walls `strokes`
    (w, 4) stands between; `spots` (k, 4), x, y and the direction (cos, sin) that each was heard in, that may be ends
    of walls; `ways` (p, 4) of sound to what answered, and of the robot.
    """

    stations: Floats
    profiles: Floats
    strokes: Floats
    spots: Floats
    ways: Floats


def trimmed(feet: Floats, ends: Floats, against: Witnesses, config: EndConfig) -> Floats:
    """Walls' ends (n, 4), drawn in to the first thing on either side of their feet (n, 2) that speaks against them."""
    count = len(feet)
    if count == 0:
        return ends
    halves = np.concatenate([np.tile(feet, (2, 1)), np.concatenate([ends[:, :2], ends[:, 2:]])], axis=1)
    dx, dy = halves[:, 2] - halves[:, 0], halves[:, 3] - halves[:, 1]
    length = np.maximum(np.sqrt(dx * dx + dy * dy), 1e-9)
    kept = np.minimum(
        ended_at(halves, against.spots, config, -BEHIND_M).min(axis=1, initial=np.inf),
        heard_through_at(halves, against.ways, LEAST_M).min(axis=1, initial=np.inf) - OPEN_M,
    )
    half, ways = _unheard(halves, against)
    place = ((ways[:, 2] - halves[half, 0]) * dx[half] + (ways[:, 3] - halves[half, 1]) * dy[half]) / length[half]
    np.minimum.at(kept, half, place - OPEN_M)
    part = np.minimum(np.maximum(kept, LEAST_M) / length, 1.0)
    found = halves[:, :2] + part[:, None] * np.stack([dx, dy], axis=1)
    return np.concatenate([found[:count], found[count:]], axis=1)


def refuted(gaps: Floats, against: Witnesses) -> Bools:
    """In which of the gaps (g, 4) there is no wall: something went through, or one would have been heard there."""
    found = heard_through(gaps, against.ways)
    found[_unheard(gaps, against)[0]] = True
    return found


def _unheard(gaps: Floats, against: Witnesses) -> tuple[Ints, Floats]:
    """In which of the gaps (g, 4) a wall would have been heard, and was not: numbers and ways of sound (k, 4).

    A known wall in the way mirrors sound elsewhere: behind it silence says nothing.
    """
    gap, _, ways = missing(gaps, against.stations, against.profiles)
    seen = ~heard_through(ways, against.strokes, 0.0)
    return gap[seen], ways[seen]
