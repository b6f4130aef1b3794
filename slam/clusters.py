"""Clusters: arcs of different sonars that agree in bearing and distance, seen of one surface [II].

Must not know: readings, what the surface is.
"""

import numpy as np

from slam import dmath
from slam.arcs import Arc, ArcConfig
from slam.dmath import DEGREE
from slam.geometry import wrap


def cluster(arcs: list[Arc], config: ArcConfig) -> list[tuple[int, ...]]:
    """Arcs (indices) of at least `min_sonars` sonars that agree in bearing and distance, the largest group first."""
    if not arcs:
        return []
    bearing = np.array([arc.bearing for arc in arcs])
    distance = np.array([arc.distance for arc in arcs])
    sonar = np.array([arc.sonar for arc in arcs])
    free = np.ones(len(arcs), dtype=bool)
    groups: list[tuple[int, ...]] = []
    near = (np.abs(wrap(bearing[:, None] - bearing[None, :])) <= config.agree_deg * DEGREE) & (
        np.abs(distance[:, None] - distance[None, :]) <= config.agree_m
    )
    while True:
        seed = int(np.argmax(np.count_nonzero(near & free[None, :], axis=1) * free))
        members = np.flatnonzero(near[seed] & free)
        if len(members) < config.min_sonars:
            return groups
        centre = bearing[seed] + dmath.mean(wrap(bearing[members] - bearing[seed]))
        level = dmath.mean(distance[members])
        about = np.abs(wrap(bearing - centre)) <= config.agree_deg * DEGREE
        members = np.flatnonzero(free & about & (np.abs(distance - level) <= config.agree_m))
        if len(members) == 0:
            members = np.array([seed])
        elif len(set(sonar[members].tolist())) >= config.min_sonars:
            groups.append(tuple(members.tolist()))
        free[members] = False
