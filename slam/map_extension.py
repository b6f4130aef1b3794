"""Block H, map extension: the sweep's features and readings as evidence on the occupancy grid [III.H].

A wall marks its segment and frees the fan in front of it, as far as no known wall stands in the way. Between two
neighbouring members of a chain the wall goes on, and so it does to the corner it ends in, unless what was seen there
speaks against it. Readings of class (ii) sharpen their RCD; those of class (iii) weigh little and free only what lies
well before them; readings without an echo say nothing, for most specular walls give none. Sweeps whose pose has moved
since, or whose walls are known better now, are drawn anew.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import is_

import numpy as np

from slam import dmath
from slam.association import OPEN, Chains, Member
from slam.cones import render_cones
from slam.dmath import DEGREE, Floats
from slam.evidence import NOTHING, Evidence, Layer
from slam.features import Features
from slam.geometry import Pose, wrap
from slam.grid import Grid, Patch
from slam.links import Gap, Spot, chain_gaps, end_gaps, heard_through
from slam.reliability import Reliability
from slam.rendering import MapConfig, render
from slam.self_calibration import Calibrated
from slam.shapes import Shape, shapes_of
from slam.sight import Sight, sight_of
from slam.sweep import Ints


@dataclass(frozen=True)
class Painted:
    """A sweep on the map: what it saw, and the pose and the walls that it was drawn with.

    `shapes` are what it was drawn as; (n, 4) by their ends: `strokes` the walls among them, `paths` the ways of sound
    to these, `gaps` those that it filled. `partners` are the older sweeps whose walls it met, `layer` the evidence.
    """

    sight: Sight
    pose: Pose
    members: tuple[Member, ...]
    shapes: tuple[Shape, ...]
    strokes: Floats
    paths: Floats
    gaps: Floats
    partners: tuple[int, ...]
    layer: Layer


@dataclass(frozen=True)
class Map:
    """The occupancy grid, and what it takes to draw parts of it again.

    `poses`, `members` and the natures `told` of chains are those that it was last held against: what is the same object
    still has not changed.
    """

    grid: Grid
    evidence: Evidence = field(default_factory=Evidence)
    painted: tuple[Painted, ...] = ()
    poses: tuple[Pose, ...] = ()
    members: tuple[Member, ...] = ()
    told: Mapping[int, int] = field(default_factory=dict)


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
    sight = sight_of(calibrated, reliability, features, every_beam=config.plain_cone)
    drawing = _Drawing(before, (*(old.sight for old in before.painted), sight), known, config)
    newest = len(poses) - 1
    drawing.draw([*_to_repaint(before, known, config), newest])
    drawing.draw(_heard_through(drawing.painted, newest, known.poses, config))
    grid, patch = drawing.evidence.shown(before.evidence, before.grid)
    painted = tuple(each for each in drawing.painted if each)
    return Map(grid, drawing.evidence, painted, poses, chains.members, known.told), patch


class _Drawing:
    """A map on which sweeps are drawn: what is painted so far, and the grid that shows it."""

    def __init__(self, before: Map, sights: tuple[Sight, ...], known: "_Known", config: MapConfig) -> None:
        self.painted: list[Painted | None] = [*before.painted, None]
        self.evidence, self._grid = before.evidence, before.grid
        self._sights, self._known, self._config = sights, known, config

    def draw(self, sweeps: list[int]) -> None:
        """Take these sweeps off the map and draw them, one after the other, each as if it came only now."""
        self._change([old.layer for k in sweeps if (old := self.painted[k])], [])
        for k in sweeps:
            self.painted[k] = None
        for k in sweeps:
            drawn = _paint(self._sights[k], k, self._known, self.painted, self._grid, self._config)
            self.painted[k] = drawn
            self._change([], [drawn.layer])

    def _change(self, gone: list[Layer], new: list[Layer]) -> None:
        changed = self.evidence.changed(gone, new)
        self._grid, _ = changed.shown(self.evidence, self._grid)
        self.evidence = changed


class _Known:
    """All poses and walls as known now, the walls by sweep and by chain.

    What one member of a chain tells of its nature holds for all: a point never joins a chain of walls.
    """

    def __init__(self, chains: Chains, poses: tuple[Pose, ...]) -> None:
        self.poses, self.members = poses, chains.members
        sweeps: Ints = np.array([member.sweep for member in chains.members], dtype=np.int64)
        self._borders = [0, *np.cumsum(np.bincount(sweeps, minlength=len(poses))).tolist()]
        self._chains: dict[int, list[Member]] = {}
        self.told = {member.chain: member.nature for member in chains.members if member.nature != OPEN}

    def of_sweep(self, k: int) -> tuple[Member, ...]:
        """The sweep's walls."""
        return tuple(self._told(member) for member in self.members[self._borders[k] : self._borders[k + 1]])

    def of_chain(self, chain: int) -> list[Member]:
        """The chain's members."""
        if not self._chains:
            for member in self.members:
                self._chains.setdefault(member.chain, []).append(self._told(member))
        return self._chains[chain]

    def _told(self, member: Member) -> Member:
        if member.nature != OPEN or member.chain not in self.told:
            return member
        return replace(member, nature=self.told[member.chain])


def _to_repaint(before: Map, known: _Known, config: MapConfig) -> list[int]:
    """The sweeps that were drawn with what is no longer true, and those linked with them, in order."""
    changed = {k for k, same in enumerate(map(is_, before.poses, known.poses)) if not same}
    for same, old, new in zip(map(is_, before.members, known.members), before.members, known.members, strict=False):
        if not same:
            changed |= {old.sweep, new.sweep}
    changed |= {member.sweep for member in before.members[len(known.members) :]}
    if before.told != known.told:
        news = {chain for chain, nature in known.told.items() if before.told.get(chain) != nature}
        changed |= {member.sweep for member in known.members if member.chain in news}
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


def _paint(
    sight: Sight, k: int, known: _Known, painted: Sequence[Painted | None], grid: Grid, config: MapConfig
) -> Painted:
    """Sweep number `k`, drawn as everything is known now, among those that are painted already."""
    pose, members = known.poses[k], known.of_sweep(k)
    bare = Painted(sight, pose, members, (), _rows([]), _rows([]), _rows([]), (), NOTHING)
    if len(sight.beams) == 0 and not sight.things:
        return bare  # a sweep without any echo says nothing, not even where the robot stood
    if config.plain_cone:
        return replace(bare, layer=render_cones(sight, pose, config.cell_m))
    near = [(j, old) for j, old in enumerate(painted) if old and _near(known.poses[j], pose, config)]
    around = np.concatenate([bare.strokes, *(old.strokes for _, old in near)])
    shapes = shapes_of(sight, pose, members, around, config.shapes)
    links = [
        gap
        for member in members
        for gap in chain_gaps(member, known.of_chain(member.chain), known.poses, config.link_gap_m)
    ]
    older = [(j, old.shapes) for j, old in near if j < k]
    walls = [wall for j, seen in (*older, (k, shapes)) for wall in _walls(seen, known.of_sweep(j))]
    spots = [spot for j, seen in (*older, (k, shapes)) for spot in _spots(seen, j)]
    ends = end_gaps(walls, spots, k, known.poses, config.ends) if config.end else []
    paths = np.concatenate([_paths(shapes, pose), *(old.paths for _, old in near)])
    links, ends = _unheard(links, paths), _unheard(ends, paths)
    return replace(
        bare,
        shapes=shapes,
        strokes=np.array([(*shape.start, *shape.end) for shape in shapes if shape.wall >= 0]).reshape(-1, 4),
        paths=_paths(shapes, pose),
        gaps=_rows([*links, *ends]),
        partners=tuple(gap.sweep for gap in (*links, *ends)),
        layer=render(sight, pose, members, shapes, links, ends, grid, config),
    )


def _heard_through(
    painted: Sequence[Painted | None], newest: int, poses: tuple[Pose, ...], config: MapConfig
) -> list[int]:
    """The sweeps that filled a gap through which the newest one heard a wall."""
    last = painted[newest]
    return [
        k
        for k, old in enumerate(painted[:newest])
        if old and last and len(old.gaps) and _near(poses[k], poses[newest], config)
        if bool(heard_through(old.gaps, last.paths).any())
    ]


def _near(one: Pose, other: Pose, config: MapConfig) -> bool:
    """Whether the same things may be seen from both stations."""
    return abs(one.x - other.x) < config.around_m and abs(one.y - other.y) < config.around_m


def _walls(shapes: tuple[Shape, ...], members: tuple[Member, ...]) -> list[Member]:
    """The walls that a sweep is drawn with, as they lie now."""
    return [members[shape.wall] for shape in shapes if 0 <= shape.wall < len(members)]


def _spots(shapes: tuple[Shape, ...], sweep: int) -> list[Spot]:
    """What of the shapes may be the end of a wall."""
    return [Spot(shape.foot, shape.bearing, sweep) for shape in shapes if not shape.told]


def _paths(shapes: tuple[Shape, ...], pose: Pose) -> Floats:
    """The ways of sound (p, 4) from the station to the walls that answered."""
    return np.array([(pose.x, pose.y, *shape.foot) for shape in shapes if shape.wall >= 0]).reshape(-1, 4)


def _rows(gaps: Sequence[Gap]) -> Floats:
    """Gaps (g, 4) by their ends."""
    return np.array([(*gap.start, *gap.end) for gap in gaps]).reshape(-1, 4)


def _unheard(gaps: list[Gap], paths: Floats) -> list[Gap]:
    """The gaps through which nothing was heard: in the others there is no wall."""
    return [gap for gap, heard in zip(gaps, heard_through(_rows(gaps), paths).tolist(), strict=True) if not heard]
