"""Block E, feature association: which chain each wall of the sweep belongs to [III.E].

A wall is compared with every member of every chain; the chain's first member is its root. Walls that join no chain
become the roots of new ones, once the sweep's pose is known.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from slam import dmath
from slam.dmath import DEGREE, Floats
from slam.features import Wall
from slam.geometry import Bools, Pose, Segment, wrap


@dataclass(frozen=True)
class AssociationConfig:
    """The paper's thresholds: distance d1, gap d2, angle a1; and when a feature's nature is told by parallax.

    `tell_points = false` takes every feature for the wall that one sweep alone would make of it, as the paper does.
    From `parallax_chi2` on the sonars of one sweep tell it by themselves.
    """

    d1_m: float = 0.20
    d2_m: float = 0.50
    a1_deg: float = 20.0
    tell_points: bool = True
    parallax_m: float = 0.15
    parallax_of_distance: float = 0.04
    parallax_chi2: float = 10.0


OPEN, WALL, POINT = 0, 1, 2
"""The nature of a feature: not told yet, a wall, or a point (a corner, an edge, a pole) that answers like a wall."""


@dataclass(frozen=True)
class Member:
    """A wall in the map: the `sweep` that saw it, the `chain` that it is a link of, its bearing good to `sigma` rad."""

    chain: int
    sweep: int
    segment: Segment
    nature: int = OPEN
    sigma: float = 0.0


@dataclass(frozen=True)
class Chains:
    """All chains' members in the order in which they joined; `roots[c]` is the place of chain c's first member."""

    members: tuple[Member, ...] = ()
    roots: tuple[int, ...] = ()

    def root(self, chain: int) -> Segment:
        """The wall that the chain began with."""
        return self.members[self.roots[chain]].segment

    def of(self, chain: int) -> list[Member]:
        """The chain's members, oldest first."""
        return [self.members[k] for k in np.flatnonzero(self.table[:, 6] == chain).tolist()]

    @cached_property
    def table(self) -> Floats:
        """The members as rows (m, 7): α, ρ, the ends' x and y, and the chain's number."""
        return _rows(self.members)

    def joined(
        self, walls: list[tuple[int | None, int, Segment]], sweep: int, sigmas: tuple[float, ...] = ()
    ) -> "Chains":
        """With the walls linked in: each (chain, nature, segment) to its chain, or to a new one for None.

        `sigmas` are those of the walls' bearings, in rad, for whoever weighs by them.
        """
        members, roots = list(self.members), list(self.roots)
        for (chain, nature, wall), sigma in zip(walls, sigmas or [0.0] * len(walls), strict=True):
            if chain is None:
                roots.append(len(members))
            members.append(Member(len(roots) - 1 if chain is None else chain, sweep, wall, nature, sigma))
        longer = Chains(tuple(members), tuple(roots))
        # A log of a kilometre has thousands of members; they are not put into rows anew at every sweep.
        vars(longer)["table"] = np.concatenate([self.table, _rows(longer.members[len(self.members) :])])
        return longer


def _rows(members: tuple[Member, ...]) -> Floats:
    pieces = [(m.segment, m.chain) for m in members]
    return np.array([(s.alpha, s.rho, *s.start, *s.end, chain) for s, chain in pieces], dtype=np.float64).reshape(-1, 7)


@dataclass(frozen=True)
class Link:
    """Wall number `wall` of the sweep joins `chain` because of its member number `member`."""

    wall: int
    chain: int
    member: int
    d1: float
    a1: float
    gap: float  # 0 where the two overlap
    nature: int = WALL


@dataclass(frozen=True)
class Association:
    """The links found at the predicted pose, the walls without one, and all walls at that pose (map frame).

    `postponed` walls could be either of two things: nothing may join their chains. `pose` is where the links by
    themselves put the robot, if association had to know.
    """

    links: tuple[Link, ...]
    unlinked: tuple[int, ...]
    predicted: tuple[Segment, ...]
    postponed: tuple[int, ...] = ()
    pose: Pose | None = None

    def chained(self, walls: tuple[Segment, ...]) -> list[tuple[int | None, int, Segment]]:
        """The walls, as they lie at the corrected pose, each with the chain it joins (None: its own) and its nature."""
        link_of = {link.wall: (link.chain, link.nature) for link in self.links}
        return [(*link_of.get(k, (None, OPEN)), wall) for k, wall in enumerate(walls)]


def associate(
    walls: tuple[Wall, ...], chains: Chains, poses: tuple[Pose, ...], predicted: Pose, config: AssociationConfig
) -> Association:
    """For each wall the member with the smallest d1; ties go to the lower chain, then to the older member.

    `poses` are those of the sweeps so far: a feature's nature shows by how it moved as the robot did.
    """
    placed = tuple(wall.segment.moved(predicted) for wall in walls)
    links = [link for k, wall in enumerate(placed) if (link := _best(k, wall, chains, config)) is not None]
    if config.tell_points:
        links = [link for link in (_told(link, placed, predicted, chains, poses, config) for link in links) if link]
    linked = {link.wall for link in links}
    unlinked = tuple(k for k in range(len(walls)) if k not in linked)
    return Association(tuple(links), unlinked, placed, pose=predicted)


def _best(k: int, wall: Segment, chains: Chains, config: AssociationConfig) -> Link | None:
    if not chains.members:
        return None
    a1 = np.abs(wrap(wall.alpha - chains.table[:, 0]))
    alike = np.flatnonzero(a1 <= config.a1_deg * DEGREE)  # of a long log's members most look another way
    rows = chains.table[alike]
    alpha, rho, ends = rows[:, 0], rows[:, 1], rows[:, 2:6].reshape(-1, 2, 2)
    d1 = mean_distance(wall, alpha, rho)
    gap = np.where(overlapping(wall, alpha, ends), 0.0, end_gap(wall, ends))
    good = (d1 <= config.d1_m) & (gap <= config.d2_m)
    if not bool(good.any()):
        return None
    nearest = np.flatnonzero(good & (d1 == d1[good].min())).tolist()
    best = min(nearest, key=lambda m: (int(rows[m, 6]), m))
    member = int(alike[best])
    return Link(k, int(rows[best, 6]), member, float(d1[best]), float(a1[member]), float(gap[best]))


def _told(
    link: Link,
    placed: tuple[Segment, ...],
    here: Pose,
    chains: Chains,
    poses: tuple[Pose, ...],
    config: AssociationConfig,
) -> Link | None:
    """The link with its nature; None where a wall would join a chain of points, or a point one of walls."""
    members = chains.of(link.chain)
    nature = nature_of(placed[link.wall], here, members, poses, config)
    before = next((member.nature for member in reversed(members) if member.nature != OPEN), OPEN)
    if OPEN not in (nature, before) and nature != before:
        return None
    return replace(link, nature=nature)


def nature_of(
    wall: Segment,
    here: Pose,
    members: list[Member],
    poses: tuple[Pose, ...],
    config: AssociationConfig,
    sigma: float = 0.0,
) -> int:
    """Wall or point, by parallax: as the robot goes along a wall its foot point goes with it; a point's stays.

    Told by the member whose station lies least far along the wall from here, but far enough; OPEN while none does.
    From far away a corner at the end of a wall looks like a piece of it. A foot point is no better than its bearing:
    `sigma` is that of the wall's, in rad.
    """
    spot = foot(wall, here)
    distance = dmath.hypot(spot[0] - here.x, spot[1] - here.y)
    alpha = np.array([member.segment.alpha for member in members])
    sigmas = np.array([dmath.hypot(sigma, member.sigma) for member in members])
    enough = np.maximum(config.parallax_m, distance * np.maximum(config.parallax_of_distance, sigmas))
    x, y = (np.array([getattr(poses[member.sweep], name) for member in members]) for name in ("x", "y"))
    sine, cosine = dmath.sincos(alpha)
    moved = cosine * (here.y - y) - sine * (here.x - x)
    far = np.flatnonzero(np.abs(moved) >= enough)
    if not len(far):
        return OPEN
    best = int(far[np.argmin(np.abs(moved[far]))])
    was = foot(members[best].segment, poses[members[best].sweep])
    followed = float(cosine[best]) * (spot[1] - was[1]) - float(sine[best]) * (spot[0] - was[0])
    along = float(moved[best])
    return WALL if abs(followed - along) < 0.5 * abs(along) else POINT


def nature_alone(wall: Wall, config: AssociationConfig) -> int:
    """Wall or point by the parallax between the sonars of its own sweep; OPEN where that is too little to tell."""
    if not config.tell_points or abs(wall.parallax) < config.parallax_chi2:
        return OPEN
    return POINT if wall.parallax > 0.0 else WALL


def foot(wall: Segment, station: Pose) -> tuple[float, float]:
    """The point of the wall's line nearest to a station, in the map frame."""
    sine, cosine = dmath.sincos(wall.alpha)
    off = wall.rho - (cosine * station.x + sine * station.y)
    return station.x + off * cosine, station.y + off * sine


def mean_distance(wall: Segment, alpha: Floats, rho: Floats) -> Floats:
    """d1 [III.E] in metres: mean distance of the wall's two ends and middle from each of the infinite lines (m,)."""
    sine, cosine = dmath.sincos(alpha)
    probe = wall.probe()
    distance = [np.abs((cosine * x + sine * y) - rho) for x, y in probe.tolist()]
    return np.asarray((distance[0] + distance[1] + distance[2]) / 3.0)


def overlapping(wall: Segment, alpha: Floats, ends: Floats) -> Bools:
    """Whether the wall's projection on each line (m,) meets the segment there, given its ends (m, 2, 2)."""
    sine, cosine = dmath.sincos(alpha)
    own = [cosine * y - sine * x for x, y in (wall.start, wall.end)]
    other = [cosine * ends[:, e, 1] - sine * ends[:, e, 0] for e in (0, 1)]
    low, high = np.minimum(*own), np.maximum(*own)
    return (low <= np.maximum(*other)) & (np.minimum(*other) <= high)


def end_gap(wall: Segment, ends: Floats) -> Floats:
    """d2 [III.E] in metres: the smallest distance between an end of the wall and an end of each other (m, 2, 2)."""
    gaps = [dmath.hypot(ends[:, e, 0] - x, ends[:, e, 1] - y) for x, y in (wall.start, wall.end) for e in (0, 1)]
    return np.minimum(np.minimum(gaps[0], gaps[1]), np.minimum(gaps[2], gaps[3]))
