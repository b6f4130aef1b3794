"""Where things that were heard square on stand in line: a wall that answers now and then, as glass and cloth do.

Such a wall is heard from each station in one place, and of it no more than a few readings. An edge or a pole is heard
from aside too. Must not know: the grid, chains, how things are drawn.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.dmath import DEGREE
from slam.geometry import Bools
from slam.links import Gaps, Spots
from slam.sweep import Ints


@dataclass(frozen=True)
class SeamConfig:
    """What is one wall: things heard from so near, so far apart, so little beside each other's line and askew to it.

    What was heard so far from aside, by anyone, so near to a thing, makes it none.
    """

    reach_m: float = 2.5
    longest_m: float = 1.2
    beside_m: float = 0.06
    askew_deg: float = 6.0
    aside_deg: float = 25.0
    round_m: float = 0.15


def seams(spots: Spots, known: Bools, sweep: int, config: SeamConfig, weight: int) -> Gaps:
    """The gaps between a sweep's spots and the nearest in line of other sweeps, on either side.

    Which of the spots (s,) are drawn as walls is `known`: what lies between two of these is their chain's business.
    """
    mine, theirs = np.flatnonzero(spots.sweep == sweep), np.flatnonzero(spots.sweep != sweep)
    normal, other = spots.normal[mine], spots.normal[theirs]
    dx = spots.point[theirs, 0] - spots.point[mine, :1]
    dy = spots.point[theirs, 1] - spots.point[mine, 1:]
    along = normal[:, :1] * dy - normal[:, 1:] * dx
    fits = np.abs(normal[:, :1] * dx + normal[:, 1:] * dy) <= config.beside_m
    fits &= np.abs(other[:, 0] * dx + other[:, 1] * dy) <= config.beside_m
    fits &= normal[:, :1] * other[:, 0] + normal[:, 1:] * other[:, 1] >= dmath.sincos(config.askew_deg * DEGREE)[1]
    fits &= ~(known[mine, None] & known[theirs])
    pairs = []
    for place in (along, -along):
        gap = np.where(fits & (place > 0.0) & (place <= config.longest_m), place, np.inf)
        found = np.flatnonzero(np.isfinite(gap.min(axis=1, initial=np.inf)))
        if len(found):
            pairs.append(np.stack([mine[found], theirs[gap[found].argmin(axis=1)]], axis=1))
    rows = np.concatenate([np.zeros((0, 2), dtype=np.int64), *pairs])
    rows = rows[~_aside(spots, rows.reshape(-1), config).reshape(-1, 2).any(axis=1)]
    return Gaps(spots.point[rows].reshape(-1, 4), np.full(len(rows), weight))


def _aside(spots: Spots, which: Ints, config: SeamConfig) -> Bools:
    """Of those (k,) of the spots (s,), which have another so near that was heard from another direction."""
    some = spots.at(which)
    dx, dy = (spots.point[:, k] - some.point[:, k : k + 1] for k in (0, 1))
    near = dx * dx + dy * dy <= config.round_m * config.round_m
    facing = some.normal[:, :1] * spots.normal[:, 0] + some.normal[:, 1:] * spots.normal[:, 1]
    return np.asarray((near & (facing < dmath.sincos(config.aside_deg * DEGREE)[1])).any(axis=1))
