"""Block E of `paper`: which chain each wall of the sweep belongs to, as a wall or as a point [III.E].

A chain of points shows from everywhere the wall that its point answers like: the one across the line of sight. So d1
and a1 are the same for both. Whatever joins a chain must fit its root, too, because the root is what corrects the pose.

Must not know: how a pose is corrected.
"""

from collections.abc import Iterable
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
    Member,
    end_gap,
    foot,
    mean_distance,
    nature_of,
    overlapping,
)
from slam.dmath import DEGREE
from slam.features import Wall
from slam.geometry import Pose, Segment, wrap
from slam.linear import solve_spd

REACH_M = 1.0
"""Farther from a wall's middle no point can be what answers there."""


@dataclass(frozen=True)
class RecognitionConfig:
    """Thresholds d1 and a1 that are tried first; those of the association if with them `explained` of the walls link.

    A sighting fixes a point to `along_m` along the line of sight, and across it to the bearing's own sigma and to
    `heading_deg`, of the heading it was seen with.
    """

    d1_m: float = 0.10
    a1_deg: float = 10.0
    explained: float = 0.75
    along_m: float = 0.02
    heading_deg: float = 1.0


@dataclass(frozen=True)
class Place:
    """Where a chain's point stands, x and y in m, and how uncertain that is: its covariance in m²."""

    x: float
    y: float
    xx: float
    xy: float
    yy: float

    def line(self, here: Pose) -> tuple[float, float]:
        """The line (α, ρ) that the point answers like to a robot that stands here."""
        alpha = dmath.atan2(self.y - here.y, self.x - here.x)
        sine, cosine = dmath.sincos(alpha)
        return alpha, cosine * self.x + sine * self.y

    def across(self, alpha: float) -> float:
        """How uncertain it is across a line of sight of this bearing, in m."""
        sine, cosine = dmath.sincos(alpha)
        return dmath.sqrt(sine * sine * self.xx - 2.0 * sine * cosine * self.xy + cosine * cosine * self.yy)


def place_of(members: Iterable[Member], poses: tuple[Pose, ...], config: RecognitionConfig) -> Place:
    """Where the members' lines of sight cross: each foot point counts by how good its bearing and distance are."""
    whole, right = np.zeros((2, 2)), np.zeros(2)
    along = 1.0 / (config.along_m * config.along_m)
    heading = config.heading_deg * DEGREE
    for member in members:
        station = poses[member.sweep]
        spot = np.array(foot(member.segment, station))
        distance = dmath.hypot(float(spot[0]) - station.x, float(spot[1]) - station.y)
        aside = distance * dmath.hypot(member.sigma, heading)
        across = 1.0 / (aside * aside + config.along_m * config.along_m)
        sine, cosine = dmath.sincos(member.segment.alpha)
        mixed = (along - across) * sine * cosine
        each = np.array(
            [
                [along * cosine * cosine + across * sine * sine, mixed],
                [mixed, along * sine * sine + across * cosine * cosine],
            ]
        )
        whole = whole + each
        right = right + (each[:, 0] * spot[0] + each[:, 1] * spot[1])
    x, y = solve_spd(whole, right).tolist()
    (a, b), (_, c) = whole.tolist()
    determinant = a * c - b * b
    return Place(x, y, c / determinant, -b / determinant, a / determinant)


def recognise(
    walls: tuple[Wall, ...],
    chains: Chains,
    poses: tuple[Pose, ...],
    predicted: Pose,
    thresholds: AssociationConfig,
    config: RecognitionConfig,
) -> Association:
    """For each wall the chain with the smallest d1 that it can be of; of equal ones the lower chain.

    Odometry is seldom off by as much as the thresholds allow, so narrower ones come first. A robot that was pushed
    leaves them without a link, or with few where the wider ones link nearly all.
    """
    placed = tuple(wall.segment.moved(predicted) for wall in walls)
    narrow = replace(thresholds, d1_m=min(config.d1_m, thresholds.d1_m), a1_deg=min(config.a1_deg, thresholds.a1_deg))
    links = _links(placed, chains, poses, predicted, narrow, config)
    if len(links) < len(walls):
        wider = _links(placed, chains, poses, predicted, thresholds, config)
        if len(wider) > len(links) and (not links or len(wider) >= config.explained * len(walls)):
            links = wider
    linked = {link.wall for link in links}
    unlinked = tuple(k for k in range(len(walls)) if k not in linked)
    return Association(tuple(links), unlinked, placed, pose=predicted)


def _links(
    placed: tuple[Segment, ...],
    chains: Chains,
    poses: tuple[Pose, ...],
    here: Pose,
    thresholds: AssociationConfig,
    config: RecognitionConfig,
) -> list[Link]:
    natures: dict[int, int] = {}
    places: dict[int, Place] = {}
    links = []
    for k, wall in enumerate(placed):
        looks = _as_walls(k, wall, chains, thresholds)
        for chain in _near(wall, chains) if thresholds.tell_points else []:
            if chain not in places:
                places[chain] = place_of(chains.of(chain), poses, config)
            looks.append(_as_point(k, wall, chain, chains, places[chain], here))
        for look in looks:
            if look.chain not in natures:
                natures[look.chain] = told(chains.of(look.chain))
        looks = [
            look
            for look in looks
            if look.d1 <= thresholds.d1_m
            and look.a1 <= thresholds.a1_deg * DEGREE
            and natures[look.chain] in (OPEN, look.nature)
        ]
        if looks:
            nearest = min(looks, key=lambda look: (look.d1, look.chain))
            of_chain = [look for look in looks if look.chain == nearest.chain]
            links.append(_settled(of_chain, natures[nearest.chain], wall, chains, poses, here, thresholds))
    return [link for link in links if link is not None]


def told(members: list[Member]) -> int:
    """The nature of a chain: what was told of it last; OPEN while nothing was."""
    return next((member.nature for member in reversed(members) if member.nature != OPEN), OPEN)


def _as_walls(k: int, wall: Segment, chains: Chains, thresholds: AssociationConfig) -> list[Link]:
    """To each chain with a member that the wall overlaps or goes on: the nearest of these."""
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
            best[chain] = Link(k, chain, member, float(d1[row]), float(a1[member]), float(gap[row]), WALL)
    return list(best.values())


def _near(wall: Segment, chains: Chains) -> list[int]:
    """The chains with a member near the wall, in order."""
    table = chains.table
    x, y = wall.middle
    dx, dy = 0.5 * (table[:, 2] + table[:, 4]) - x, 0.5 * (table[:, 3] + table[:, 5]) - y
    near = dx * dx + dy * dy <= REACH_M * REACH_M
    return [int(chain) for chain in np.unique(table[near, 6]).tolist()]


def _as_point(k: int, wall: Segment, chain: int, chains: Chains, place: Place, here: Pose) -> Link:
    alpha, rho = place.line(here)
    d1 = float(mean_distance(wall, np.array([alpha]), np.array([rho]))[0])
    newest = int(np.flatnonzero(chains.table[:, 6] == chain)[-1])
    return Link(k, chain, newest, d1, abs(wrap(wall.alpha - alpha)), 0.0, POINT)


def _settled(
    looks: list[Link],
    before: int,
    wall: Segment,
    chains: Chains,
    poses: tuple[Pose, ...],
    here: Pose,
    thresholds: AssociationConfig,
) -> Link | None:
    """The link with its nature; None where parallax speaks against what the chain is, or its root does."""
    members = chains.of(looks[0].chain)
    nature = nature_of(wall, here, members, poses, thresholds) if thresholds.tell_points else WALL
    if OPEN not in (nature, before) and nature != before:
        return None
    nature = nature or before
    root = members[0].segment
    d1 = float(mean_distance(wall, np.array([root.alpha]), np.array([root.rho]))[0])
    on_root = d1 <= thresholds.d1_m and abs(wrap(wall.alpha - root.alpha)) <= thresholds.a1_deg * DEGREE
    fitting = [look for look in looks if nature in (OPEN, look.nature) and (look.nature == POINT or on_root)]
    return replace(min(fitting, key=lambda look: look.d1), nature=nature) if fitting else None
