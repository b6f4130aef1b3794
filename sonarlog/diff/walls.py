"""The walls of a map: each the union of those members of a chain, or of several, that lie on one line.

Must not know: runs, what walls are compared with.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam.association import POINT, Chains, Member
from slam.geometry import ORIGIN, Pose, Segment
from sonarlog.log import Floats

SHORTEST_M = 0.25
"""What is shorter is an edge or a pole that answered like a wall."""
BESIDE_M = 0.30
TURNED_RAD = np.radians(20.0)
"""A member is of a wall if it lies nearer to the wall's line than this, and within this angle."""
BREAK_M = 1.0
"""Where nothing was seen of a chain for longer than this, another wall begins: stations are nearer than that."""
LIES_ON_M, GOES_ON_M = 0.06, 0.30
"""Walls of several chains are one if one lies so near to the other's line, and no further on along it."""
SIDES = ("east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east")


@dataclass(frozen=True)
class Wall:
    """Wall `number` of a map: the line (α, ρ) that fits its pieces best, and its ends as seen from the robot's side.

    The normal points away from the robot. `pieces` are what sweeps saw of it, the first of them in `first_sweep` as a
    link of `chain`; `bent_m` is the largest distance of a piece's end from the line. Metres and radians, in the map's
    frame.
    """

    number: int
    chain: int
    alpha: float
    rho: float
    start: tuple[float, float]
    end: tuple[float, float]
    pieces: tuple[Segment, ...]
    first_sweep: int
    bent_m: float

    @property
    def length_m(self) -> float:
        """From end to end."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))

    @property
    def middle(self) -> tuple[float, float]:
        """The point halfway."""
        return 0.5 * (self.start[0] + self.end[0]), 0.5 * (self.start[1] + self.end[1])

    @property
    def name(self) -> str:
        """By the side of the robot on which it stands, x being east: `east wall 3`."""
        return f"{SIDES[round(self.alpha / (np.pi / 4)) % 8]} wall {self.number}"

    def moved(self, pose: Pose) -> "Wall":
        """This wall of the pose's frame, in the frame that the pose is given in."""
        if pose == ORIGIN:
            return self
        line = Segment(self.alpha, self.rho, self.start, self.end).moved(pose)
        pieces = tuple(piece.moved(pose) for piece in self.pieces)
        return replace(self, alpha=line.alpha, rho=line.rho, start=line.start, end=line.end, pieces=pieces)


def walls_of(chains: Chains) -> tuple[Wall, ...]:
    """The walls of all chains, in the order in which they were first seen."""
    groups = []
    for chain in range(len(chains.roots)):
        members = [member for member in chains.of(chain) if member.nature != POINT]
        groups += [part for group in _collinear(members) for part in _unbroken(group)] if members else []
    walls = [wall for wall in map(_fitted, _laid_together(groups)) if wall.length_m >= SHORTEST_M]
    walls.sort(key=lambda wall: (wall.first_sweep, wall.chain, wall.start))
    return tuple(replace(wall, number=number) for number, wall in enumerate(walls))


def _collinear(members: list[Member]) -> list[list[Member]]:
    """The members in groups, each along one line; a chain that turns a corner is parted where it is furthest off."""
    wall = _fitted(members)
    cosine, sine = np.cos(wall.alpha), np.sin(wall.alpha)
    off = np.array([max(abs(cosine * x + sine * y - wall.rho) for x, y in _ends(m)) for m in members])
    turned = np.array([abs(_wrapped(m.segment.alpha - wall.alpha)) for m in members])
    if len(members) == 1 or (float(off.max()) <= BESIDE_M and float(turned.max()) <= TURNED_RAD):
        return [members]
    # Those that fit the middle one's line stay together, so that one bad member does not part a good wall.
    middle = members[int(np.argsort(off, kind="stable")[0])].segment
    cosine, sine = np.cos(middle.alpha), np.sin(middle.alpha)
    near = [
        abs(_wrapped(m.segment.alpha - middle.alpha)) <= TURNED_RAD / 2
        and max(abs(cosine * x + sine * y - middle.rho) for x, y in _ends(m)) <= BESIDE_M
        for m in members
    ]
    one = [member for member, fits in zip(members, near, strict=True) if fits]
    rest = [member for member, fits in zip(members, near, strict=True) if not fits]
    if not one or not rest:
        half = max(1, len(members) // 2)
        one, rest = members[:half], members[half:]
    return [*_collinear(one), *_collinear(rest)]


def _unbroken(members: list[Member]) -> list[list[Member]]:
    """The members of one line in groups without a gap that a robot fits through, as a doorway is."""
    wall = _fitted(members)
    along = np.array([-np.sin(wall.alpha), np.cos(wall.alpha)])
    extents = [sorted(float(along @ end) for end in _ends(member)) for member in members]
    order = sorted(range(len(members)), key=lambda k: extents[k])
    parts, reached = [[order[0]]], extents[order[0]][1]
    for k in order[1:]:
        if extents[k][0] - reached > BREAK_M:
            parts.append([])
        parts[-1].append(k)
        reached = max(reached, extents[k][1])
    return [[members[k] for k in sorted(part)] for part in parts]


def _laid_together(groups: list[list[Member]]) -> list[list[Member]]:
    """Groups that lie on one another are one: which chain a piece of wall was put to does not show in the map."""
    left = sorted(groups, key=lambda group: (-_fitted(group).length_m, group[0].chain, group[0].sweep))
    together = []
    while left:
        group, left = left[0], left[1:]
        while True:
            wall = _fitted(group)
            on = [_lies_on(_fitted(other), wall) for other in left]
            if not any(on):
                break
            group = group + [member for other, lies in zip(left, on, strict=True) if lies for member in other]
            left = [other for other, lies in zip(left, on, strict=True) if not lies]
        together.append(sorted(group, key=lambda member: (member.sweep, member.chain)))
    return together


def _lies_on(short: Wall, long: Wall) -> bool:
    """Whether a wall lies on a longer one, or goes it on."""
    normal = np.array([np.cos(long.alpha), np.sin(long.alpha)])
    along = np.array([-normal[1], normal[0]])
    mine, yours = np.array([short.start, short.end]), np.array([long.start, long.end])
    here, there = np.sort(mine @ along), np.sort(yours @ along)
    near = here[0] <= there[1] + GOES_ON_M and here[1] >= there[0] - GOES_ON_M
    off = float(np.abs(mine @ normal - long.rho).max())
    return bool(near) and off <= LIES_ON_M and abs(_wrapped(short.alpha - long.alpha)) <= float(TURNED_RAD)


def _ends(member: Member) -> tuple[tuple[float, float], tuple[float, float]]:
    return member.segment.start, member.segment.end


def _fitted(members: list[Member]) -> Wall:
    """Total least squares through the ends of the members, its normal on the side of theirs; number −1."""
    points = np.array([end for member in members for end in _ends(member)])
    normal = np.array([(np.cos(m.segment.alpha), np.sin(m.segment.alpha)) for m in members]).sum(axis=0)
    centre = points.mean(axis=0)
    alpha = _direction(points - centre, normal)
    n, along = np.array([np.cos(alpha), np.sin(alpha)]), np.array([-np.sin(alpha), np.cos(alpha)])
    rho = float(n @ centre)
    places = points @ along
    ends = [rho * n + place * along for place in (float(places.min()), float(places.max()))]
    return Wall(
        number=-1,
        chain=members[0].chain,
        alpha=alpha,
        rho=rho,
        start=(float(ends[0][0]), float(ends[0][1])),
        end=(float(ends[1][0]), float(ends[1][1])),
        pieces=tuple(member.segment for member in members),
        first_sweep=min(member.sweep for member in members),
        bent_m=float(np.abs(points @ n - rho).max()),
    )


def _direction(centred: Floats, normal: Floats) -> float:
    """The angle of the normal of the best line through centred points (n, 2), on the side of the one given."""
    xx, yy, xy = (float(np.sum(centred[:, i] * centred[:, j])) for i, j in ((0, 0), (1, 1), (0, 1)))
    alpha = 0.5 * float(np.arctan2(2.0 * xy, xx - yy)) + np.pi / 2
    if np.cos(alpha) * normal[0] + np.sin(alpha) * normal[1] < 0:
        alpha -= np.pi
    return float(np.arctan2(np.sin(alpha), np.cos(alpha)))


def _wrapped(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)))
