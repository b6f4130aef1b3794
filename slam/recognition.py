"""Block E of `paper`: which chain each wall of the sweep belongs to, as a wall or as a point [III.E].

A chain of points shows from everywhere the wall that its point answers like: the one across the line of sight. So d1
and a1 are the same for both. Whatever joins a chain must fit its line, too, because the line is what corrects the pose.

Must not know: how a pose is corrected.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.association import (
    OPEN,
    POINT,
    WALL,
    Association,
    AssociationConfig,
    Chains,
    Link,
    end_gap,
    foot,
    mean_distance,
    nature_alone,
    nature_of,
    overlapping,
)
from slam.dmath import DEGREE
from slam.features import Wall
from slam.geometry import Pose, Segment, wrap
from slam.landmarks import Landmarks, Line

REACH_M = 1.0
"""Farther from a wall's middle no point can be what answers there."""


@dataclass(frozen=True)
class Sight:
    """Wall `number` of the sweep as it lies at the predicted pose, its bearing good to `sigma` rad.

    `alone` is what its own sweep tells of its nature.
    """

    number: int
    wall: Segment
    sigma: float
    alone: int


@dataclass(frozen=True)
class RecognitionConfig:
    """Thresholds d1 and a1 that are tried first; those of the association if they link `explained` of the walls."""

    d1_m: float = 0.10
    a1_deg: float = 10.0
    explained: float = 0.75


def recognise(
    walls: tuple[Wall, ...],
    landmarks: Landmarks,
    predicted: Pose,
    thresholds: AssociationConfig,
    config: RecognitionConfig,
) -> Association:
    """For each wall the chain with the smallest d1 that it can be of; of equal ones the lower chain.

    Odometry is seldom off by as much as the thresholds allow, so narrower ones come first. A robot that was pushed
    leaves them without a link, or with few where the wider ones link nearly all.
    """
    placed = tuple(wall.segment.moved(predicted) for wall in walls)
    sights = [
        Sight(k, segment, wall.sigma, nature_alone(wall, thresholds))
        for k, (wall, segment) in enumerate(zip(walls, placed, strict=True))
    ]
    narrow = replace(thresholds, d1_m=min(config.d1_m, thresholds.d1_m), a1_deg=min(config.a1_deg, thresholds.a1_deg))
    links = _links(sights, landmarks, predicted, narrow)
    if len(links) < len(walls):
        wider = _links(sights, landmarks, predicted, thresholds)
        if len(wider) > len(links) and (not links or len(wider) >= config.explained * len(walls)):
            links = wider
    linked = {link.wall for link in links}
    unlinked = tuple(k for k in range(len(walls)) if k not in linked)
    return Association(tuple(links), unlinked, placed, pose=predicted)


def _links(sights: list[Sight], landmarks: Landmarks, here: Pose, thresholds: AssociationConfig) -> list[Link]:
    chains, links = landmarks.chains, []
    for sight in sights:
        looks = _as_walls(sight, chains, thresholds)
        if thresholds.tell_points:
            looks += [_as_point(sight, chain, landmarks, here) for chain in _near(sight.wall, chains)]
        looks = [
            look
            for look in looks
            if look.d1 <= thresholds.d1_m
            and look.a1 <= thresholds.a1_deg * DEGREE
            and landmarks.nature(look.chain) in (OPEN, look.nature)
        ]
        if looks:
            nearest = min(looks, key=lambda look: (look.d1, look.chain))
            of_chain = [look for look in looks if look.chain == nearest.chain]
            links.append(_settled(of_chain, sight, landmarks, here, thresholds))
    return [link for link in links if link is not None]


def _as_walls(sight: Sight, chains: Chains, thresholds: AssociationConfig) -> list[Link]:
    """To each chain with a member that the wall overlaps or goes on: the nearest of these."""
    wall = sight.wall
    a1 = np.abs(wrap(wall.alpha - chains.table[:, 0]))
    alike = np.flatnonzero(a1 <= thresholds.a1_deg * DEGREE)
    rows = chains.table[alike]
    d1 = mean_distance(wall, rows[:, 0], rows[:, 1])
    near = np.flatnonzero(d1 <= thresholds.d1_m)
    rows, d1 = rows[near], d1[near]
    ends = rows[:, 2:6].reshape(-1, 2, 2)
    gap = np.where(overlapping(wall, rows[:, 0], ends), 0.0, end_gap(wall, ends))
    best: dict[int, Link] = {}
    for row in np.flatnonzero(gap <= thresholds.d2_m).tolist():
        chain, member = int(rows[row, 6]), int(alike[near[row]])
        if chain not in best or float(d1[row]) < best[chain].d1:
            best[chain] = Link(sight.number, chain, member, float(d1[row]), float(a1[member]), float(gap[row]), WALL)
    return list(best.values())


def _near(wall: Segment, chains: Chains) -> list[int]:
    """The chains with a member near the wall, in order."""
    table = chains.table
    x, y = wall.middle
    dx, dy = 0.5 * (table[:, 2] + table[:, 4]) - x, 0.5 * (table[:, 3] + table[:, 5]) - y
    near = dx * dx + dy * dy <= REACH_M * REACH_M
    return [int(chain) for chain in np.unique(table[near, 6]).tolist()]


def _as_point(sight: Sight, chain: int, landmarks: Landmarks, here: Pose) -> Link:
    line = landmarks.point(chain, here)
    newest = int(np.flatnonzero(landmarks.chains.table[:, 6] == chain)[-1])
    return Link(sight.number, chain, newest, *_off(sight.wall, line), 0.0, POINT)


def _off(wall: Segment, line: Line) -> tuple[float, float]:
    """d1 and a1 from a line."""
    sine, cosine = dmath.sincos(line.alpha)
    off = [abs((cosine * x + sine * y) - line.rho) for x, y in (wall.start, wall.middle, wall.end)]
    return (off[0] + off[1] + off[2]) / 3.0, abs(wrap(wall.alpha - line.alpha))


def _settled(
    looks: list[Link], sight: Sight, landmarks: Landmarks, here: Pose, thresholds: AssociationConfig
) -> Link | None:
    """The link with its nature; None where parallax speaks against what the chain is, or its line does."""
    chain, wall = looks[0].chain, sight.wall
    before, nature = landmarks.nature(chain), _nature(sight, chain, landmarks, here, thresholds)
    if OPEN not in (nature, before) and nature != before:
        return None
    nature = nature or before
    d1, a1 = _off(wall, landmarks.wall(chain, foot(wall, here)))
    on_line = d1 <= thresholds.d1_m and a1 <= thresholds.a1_deg * DEGREE
    fitting = [look for look in looks if nature in (OPEN, look.nature) and (look.nature == POINT or on_line)]
    return replace(min(fitting, key=lambda look: look.d1), nature=nature) if fitting else None


def _nature(sight: Sight, chain: int, landmarks: Landmarks, here: Pose, thresholds: AssociationConfig) -> int:
    """By parallax from sweep to sweep and within this one; OPEN where they disagree, or none tells."""
    if not thresholds.tell_points:
        return WALL
    told = nature_of(sight.wall, here, landmarks.chains.of(chain), landmarks.poses, thresholds, sight.sigma)
    if OPEN in (told, sight.alone):
        return told or sight.alone
    return told if told == sight.alone else OPEN
