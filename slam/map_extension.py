"""Block H, map extension: the sweep's features and readings as evidence on the occupancy grid [III.H].

A wall marks its segment and frees the fan in front of it. Between two neighbouring members of a chain the wall goes
on, unless what was seen there speaks against it. Readings of class (ii) sharpen their RCD; those of class (iii) weigh
little and free only what lies well before them; readings without an echo say nothing, for most specular walls give
none. Sweeps whose pose has moved since, or whose walls are known better now, are drawn anew.
"""

from dataclasses import dataclass, field
from operator import is_

import numpy as np

from slam import dmath
from slam.association import Chains, Member
from slam.dmath import DEGREE
from slam.evidence import Evidence, Layer
from slam.features import Features
from slam.geometry import Pose, wrap
from slam.grid import Grid, Patch
from slam.links import Gap, gaps
from slam.reliability import Reliability
from slam.rendering import MapConfig, render
from slam.self_calibration import Calibrated
from slam.sight import Sight, sight_of
from slam.sweep import Ints


@dataclass(frozen=True)
class Painted:
    """A sweep on the map: what it saw, and the pose and the walls that it was drawn with.

    `partners` are the older sweeps whose walls it is linked with, `layer` the evidence that came of it.
    """

    sight: Sight
    pose: Pose
    members: tuple[Member, ...]
    partners: tuple[int, ...]
    layer: Layer


@dataclass(frozen=True)
class Map:
    """The occupancy grid, and what it takes to draw parts of it again.

    `poses` and `members` are those that it was last held against: what is the same object still has not changed.
    """

    grid: Grid
    evidence: Evidence = field(default_factory=Evidence)
    painted: tuple[Painted, ...] = ()
    poses: tuple[Pose, ...] = ()
    members: tuple[Member, ...] = ()


def extend_map(
    before: Map,
    calibrated: Calibrated,
    reliability: Reliability,
    features: Features,
    chains: Chains,
    poses: tuple[Pose, ...],
    config: MapConfig,
) -> tuple[Map, Patch]:
    """The map with this sweep in it and with older ones where they are known to be now, and what changed in the grid.

    `poses` are all sweeps' so far, this one's last; `chains.members` all walls at those poses, in order of their
    sweeps and, of one sweep, in the order of its features. A sweep is drawn anew if its pose, or an end of one of its
    walls, lies over `repaint_m` (or `repaint_deg`) from where it was drawn, or if the nature of a wall has changed.
    """
    known = _Known(chains, poses)
    again = _to_repaint(before, known, config)
    sight = sight_of(calibrated, reliability, features, every_beam=config.plain_cone)
    painted = list(before.painted)
    for k in again:
        painted[k] = _paint(painted[k].sight, k, known, before.grid, config)
    painted.append(_paint(sight, len(poses) - 1, known, before.grid, config))
    evidence = before.evidence.changed(
        [before.painted[k].layer for k in again], [painted[k].layer for k in (*again, len(poses) - 1)]
    )
    grid, patch = evidence.shown(before.evidence, before.grid)
    return Map(grid, evidence, tuple(painted), poses, chains.members), patch


class _Known:
    """All poses and walls as known now, the walls by sweep and by chain."""

    def __init__(self, chains: Chains, poses: tuple[Pose, ...]) -> None:
        self.poses, self.members = poses, chains.members
        sweeps: Ints = np.array([member.sweep for member in chains.members], dtype=np.int64)
        self._borders = [0, *np.cumsum(np.bincount(sweeps, minlength=len(poses))).tolist()]
        self._chains: dict[int, list[Member]] = {}

    def of_sweep(self, k: int) -> tuple[Member, ...]:
        """The sweep's walls."""
        return self.members[self._borders[k] : self._borders[k + 1]]

    def of_chain(self, chain: int) -> list[Member]:
        """The chain's members."""
        if not self._chains:
            for member in self.members:
                self._chains.setdefault(member.chain, []).append(member)
        return self._chains[chain]


def _to_repaint(before: Map, known: _Known, config: MapConfig) -> list[int]:
    """The sweeps that were drawn with what is no longer true, and those linked with them, in order."""
    changed = {k for k, same in enumerate(map(is_, before.poses, known.poses)) if not same}
    for same, old, new in zip(map(is_, before.members, known.members), before.members, known.members, strict=False):
        if not same:
            changed |= {old.sweep, new.sweep}
    changed |= {member.sweep for member in before.members[len(known.members) :]}
    moved = {k for k, old in enumerate(before.painted) if k in changed and _moved(old, known, k, config)}
    if not moved:
        return []
    return [k for k, old in enumerate(before.painted) if k in moved or any(p in moved for p in old.partners)]


def _moved(old: Painted, known: _Known, k: int, config: MapConfig) -> bool:
    """Whether a sweep lies visibly elsewhere now than where it was drawn, or is known to have seen other things."""
    pose, members = known.poses[k], known.of_sweep(k)
    shift = dmath.hypot(pose.x - old.pose.x, pose.y - old.pose.y)
    if shift > config.repaint_m or abs(wrap(pose.theta - old.pose.theta)) > config.repaint_deg * DEGREE:
        return True
    return len(members) != len(old.members) or any(
        new is not was and _differs(new, was, config) for new, was in zip(members, old.members, strict=True)
    )


def _differs(new: Member, old: Member, config: MapConfig) -> bool:
    ends = ((new.segment.start, old.segment.start), (new.segment.end, old.segment.end))
    far = any(dmath.hypot(a[0] - b[0], a[1] - b[1]) > config.repaint_m for a, b in ends)
    return far or new.nature != old.nature


def _paint(sight: Sight, k: int, known: _Known, grid: Grid, config: MapConfig) -> Painted:
    """Sweep number `k`, drawn as everything is known now."""
    members = known.of_sweep(k)
    found: list[Gap] = []
    for member in members:
        found += gaps(member, known.of_chain(member.chain), known.poses, config.link_gap_m)
    layer = render(sight, known.poses[k], members, found, grid, config)
    return Painted(sight, known.poses[k], members, tuple(gap.sweep for gap in found), layer)
