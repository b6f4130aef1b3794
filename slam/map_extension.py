"""Block H, map extension: the sweep's features and readings as evidence on the occupancy grid [III.H].

A wall marks its segment and frees the fan in front of it, as far as no known wall stands in the way. Between two
neighbouring members of a chain the wall goes on, and so it does to the corner it ends in, unless what was seen there
speaks against it. Readings of class (ii) sharpen their RCD; those of class (iii) count where several agree, and alone
they are nothing; readings without an echo free nothing, for most specular walls give none, but where a wall would have
answered they say that there is none. Sweeps whose pose has moved since, or whose walls are known better now, are drawn
anew.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from slam.association import OPEN, POINT, WALL, Chains, Member
from slam.cones import render_cones
from slam.dmath import DEGREE, Floats
from slam.evidence import NOTHING, Evidence, Layer, patch_between
from slam.features import Features
from slam.geometry import Bools, Pose, wrap
from slam.grid import Grid, Patch
from slam.links import Gaps, Spots, chain_gaps, curtains, end_gaps, ended_by
from slam.pieces import Pieces, places_of
from slam.reach import Witnesses, refuted, trimmed
from slam.reliability import Reliability
from slam.rendering import MapConfig, render
from slam.seams import seams
from slam.self_calibration import Calibrated
from slam.shapes import cut, in_line, shapes_of
from slam.sight import Sight, sight_of
from slam.sweep import Ints

STEP_M = 2.0
"""Between sweeps farther apart nobody knows which way the robot went."""


@dataclass(frozen=True)
class Painted:
    """A sweep on the map: what it saw, and what it was drawn as.

    `walls` (w,) are the pieces drawn as walls, in full or less (`shares`, (w,)), as `strokes` (w, 4); `paths` (w, 4)
    are the ways of sound to these. `spots` (s, 4) may be the ends of walls: x, y and the direction (cos, sin) that each
    was heard in, `spot_of` (s,) the pieces that they are (−1: none). `gaps` (g, 4) were filled; `layer`: the evidence.
    """

    sight: Sight
    walls: Ints
    shares: Floats
    strokes: Floats
    paths: Floats
    spots: Floats
    spot_of: Ints
    gaps: Floats
    layer: Layer


@dataclass(frozen=True)
class Map:
    """The occupancy grid, and what it takes to draw parts of it again.

    `poses` and `members` are those that it was last held against, `places` (n, 3) and `pieces` the same as arrays: what
    is the same object still has not changed. `stood` (n, 3) and `drawn` (m, 5: ends, and which share of the wall) are
    those that each sweep was drawn with.
    """

    grid: Grid
    evidence: Evidence = field(default_factory=Evidence)
    painted: tuple[Painted, ...] = ()
    poses: tuple[Pose, ...] = ()
    members: tuple[Member, ...] = ()
    places: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    pieces: Pieces = field(default_factory=Pieces.none)
    stood: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    drawn: Floats = field(default_factory=lambda: np.zeros((0, 5)))


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
    sweeps and, of one sweep, in the order of its features. A sweep is drawn anew if its pose or one of its walls
    lies over `repaint_m` (`repaint_deg`, along a wall `repaint_along_m`) from where it was drawn, or if a wall turned
    out to be none, or something else a wall.
    """
    newest = len(poses) - 1
    drawing = _Drawing(before, poses, chains.members, config)
    drawing.renew(drawing.outdated())
    drawing.add(sight_of(calibrated, reliability, features, config.faint_reach_m, every_beam=config.plain_cone), newest)
    return drawing.map(), patch_between(before.grid, drawing.grid, list(drawing.touched))


class _Drawing:
    """A map on which sweeps are drawn: all poses and walls as known now, and what is painted so far."""

    def __init__(self, before: Map, poses: tuple[Pose, ...], members: tuple[Member, ...], config: MapConfig) -> None:
        self.grid, self.touched = before.grid, dict[tuple[int, int], None]()
        self._evidence, self._config = before.evidence, config
        self._poses, self._members = poses, members
        self._places = places_of(before.places, before.poses, poses)
        self._pieces = before.pieces.renewed(before.members, members)
        self._painted: list[Painted] = list(before.painted)
        self._stood, self._drawn = before.stood.copy(), np.full((len(members), 5), np.inf)
        self._drawn[: len(before.drawn)] = before.drawn[: len(members)]
        self._known = min(len(before.drawn), len(members))
        self._shown = np.ones(len(before.painted), dtype=bool)

    def map(self) -> Map:
        """The map as it is now."""
        return Map(self.grid, self._evidence, tuple(self._painted), self._poses, self._members,
                   self._places, self._pieces, self._stood, self._drawn)  # fmt: skip

    def outdated(self) -> list[int]:
        """The sweeps that were drawn with what is no longer true, in order."""
        config = self._config
        off = self._places[: len(self._stood)] - self._stood
        moved = np.sqrt(off[:, 0] * off[:, 0] + off[:, 1] * off[:, 1]) > config.repaint_m
        moved |= np.abs(wrap(off[:, 2])) > config.repaint_deg * DEGREE
        moved[self._pieces.sweep[: self._known][self._redrawn()]] = True
        return [int(k) for k in np.flatnonzero(moved)]

    def _redrawn(self) -> Bools:
        """Which of the pieces that there were lie visibly elsewhere now, or turned out to be what they were not."""
        pieces, config = self._pieces.at(slice(self._known)), self._config
        off = pieces.ends - self._drawn[: self._known, :4]
        x, y = np.maximum(np.abs(off[:, 0]), np.abs(off[:, 2])), np.maximum(np.abs(off[:, 1]), np.abs(off[:, 3]))
        far = [(pieces.normal[:, 0] * off[:, k] + pieces.normal[:, 1] * off[:, k + 1]) for k in (0, 2)]
        moved = (np.abs(far[0]) > config.repaint_m) | (np.abs(far[1]) > config.repaint_m)
        moved |= np.maximum(x, y) > config.repaint_along_m
        drawn = self._drawn[: self._known, 4]
        moved |= (pieces.nature == POINT) & (drawn != 0.0)
        return np.asarray(moved | ((pieces.nature == WALL) & (drawn != 1.0)))

    def add(self, sight: Sight, number: int) -> None:
        """Draw a new sweep, the last one."""
        none, rows = np.zeros(0, dtype=np.int64), np.zeros((0, 4))
        self._painted.append(Painted(sight, none, np.zeros(0), rows, rows, rows, none, rows, NOTHING))
        self._shown = np.append(self._shown, False)
        self._stood = np.concatenate([self._stood, self._places[number : number + 1]])
        self.renew([number])

    def renew(self, sweeps: Sequence[int]) -> None:
        """Take these sweeps off the map and draw them, one after the other, then what each shows to be drawn wrong.

        These are as true as they were and speak against one another: each is drawn with all others on the map.
        """
        self._redraw(sweeps)
        for k in sweeps:
            for stirred in self._stirred(k):
                self._redraw([stirred])

    def _redraw(self, sweeps: Sequence[int]) -> None:
        self._take_off(sweeps)
        for k in sweeps:
            self._draw(k)

    def _take_off(self, sweeps: Sequence[int]) -> None:
        self._change([self._painted[k].layer for k in sweeps if len(self._painted[k].layer.delta)], [])
        self._shown[sweeps] = False

    def _draw(self, k: int) -> None:
        drawn = self._paint(k)
        self._painted[k] = drawn
        self._shown[k] = True
        self._stood[k] = self._places[k]
        own = self._pieces.of_sweep(k)
        self._drawn[own, :4], self._drawn[own, 4] = self._pieces.ends[own], 0.0
        self._drawn[drawn.walls, 4] = drawn.shares
        self._change([], [drawn.layer])

    def _stirred(self, newest: int) -> list[int]:
        """The sweeps drawn before that would be drawn otherwise if what the newest one saw had been known."""
        near, new, config = self._near(newest), self._painted[newest], self._config
        near = near[near != newest]
        seen = [self._painted[k] for k in near.tolist()]
        if not seen:
            return []
        gaps, gap_of = _stacked([each.gaps for each in seen])
        strokes, stroke_of = _stacked([each.strokes for each in seen])
        paths, _ = _stacked([each.paths for each in seen])
        pieces = self._pieces.at(np.concatenate([each.walls for each in seen]))
        doubtful = (pieces.nature == OPEN) & in_line(paths[:, 2:], pieces.normal, new.strokes, config.shapes)
        crossed = np.abs(cut(paths[:, 2:], strokes, new.strokes) - strokes).max(axis=1, initial=0.0) > config.cell_m
        against = self._witnesses(np.array([newest]), [new], self._driven(np.arange(max(newest - 1, 0), newest)))
        against = replace(against, strokes=strokes)  # also those hide a wall from the newest
        seen_from = self._places[near[gap_of], :2]
        ended = refuted(gaps, against) | ended_by(gaps, seen_from, against.spots, config.ends)
        shorter = np.abs(trimmed(paths[:, 2:], strokes, against, config.ends) - strokes).max(axis=1, initial=0.0)
        which = np.concatenate([gap_of[ended], stroke_of[doubtful | crossed | (shorter > config.repaint_along_m)]])
        return [int(k) for k in near[np.unique(which)]]

    def _change(self, gone: list[Layer], new: list[Layer]) -> None:
        if gone or new:
            self._evidence, places = self._evidence.changed(gone, new)
            self.grid = self._evidence.shown(self.grid, places)
            self.touched |= dict.fromkeys(places)

    def _near(self, k: int) -> Ints:
        """The sweeps on the map that may have seen the same things as sweep `k`."""
        off = np.abs(self._places[: len(self._shown), :2] - self._places[k, :2])
        return np.flatnonzero((off < self._config.around_m).all(axis=1) & self._shown)

    def _paint(self, k: int) -> Painted:
        """Sweep number `k`, drawn as everything is known now, among those that are painted already."""
        config, pose, bare = self._config, self._poses[k], self._painted[k]
        sight = bare.sight
        if not sight.heard:
            return bare  # a sweep without any echo says nothing, not even where the robot stood
        if config.plain_cone:
            return replace(bare, layer=render_cones(sight, pose, config.cell_m))
        own = self._pieces.at(self._pieces.of_sweep(k))
        near = self._near(k)
        others = [self._painted[j] for j in near.tolist()]
        around = np.concatenate([np.zeros((0, 4)), *(old.strokes for old in others)])
        with_own = np.sort(np.append(near, k))
        rows = self._pieces.of_sweeps(with_own)
        told = self._pieces.normal[rows[self._pieces.nature[rows] == WALL]]
        shapes = shapes_of(sight, pose, own, around, told, config.shapes)
        wall = shapes.wall >= 0
        first = self._pieces.of_sweep(k).start
        stations = np.repeat(np.array([[pose.x, pose.y]]), len(wall), axis=0)
        drawn = replace(
            bare,
            walls=first + shapes.wall[wall],
            shares=np.where(shapes.short[wall], 0.5, 1.0),
            strokes=shapes.ends[wall],
            paths=np.concatenate([stations, shapes.foot], axis=1)[wall],
            spots=np.concatenate([shapes.foot, shapes.towards], axis=1),
            spot_of=np.where(wall, first + shapes.wall, -1),
        )
        against = self._witnesses(with_own, [*others, drawn], self._driven(with_own))
        drawn = replace(drawn, strokes=trimmed(shapes.foot[wall], drawn.strokes, against, config.ends))
        shapes.ends[wall] = drawn.strokes
        mine, older = self._as_drawn([drawn]), self._as_drawn([self._painted[j] for j in near[near < k].tolist()])
        links = chain_gaps(mine, older, config.link_gap_m, config.link)
        gaps = links.joined(self._ends(k, drawn, near)) if config.end else links
        gaps = gaps.at(~refuted(gaps.ends, against))
        sides = curtains(mine, older, self._places[older.sweep, :2], (pose.x, pose.y), config.link_gap_m)
        layer = render(pose, shapes, gaps, sides, self.grid, config)
        return replace(drawn, gaps=gaps.ends, layer=layer)

    def _as_drawn(self, painted: list[Painted], least: float = 0.0) -> Pieces:
        """The walls of some sweeps, as far as they are drawn; not those of which a lesser share is."""
        kept = [each.shares >= least for each in painted]
        rows = [each.walls[which] for each, which in zip(painted, kept, strict=True)]
        ends = [each.strokes[which] for each, which in zip(painted, kept, strict=True)]
        walls = self._pieces.at(np.concatenate([np.zeros(0, dtype=np.int64), *rows]))
        return replace(walls, ends=np.concatenate([np.zeros((0, 4)), *ends]))

    def _witnesses(self, sweeps: Ints, painted: list[Painted], driven: Floats) -> Witnesses:
        """What these sweeps did not hear, and what may speak against a wall of what was painted or driven."""
        return Witnesses(
            stations=self._places[sweeps],
            profiles=np.stack([self._painted[j].sight.unheard for j in sweeps.tolist()]),
            strokes=np.concatenate([each.strokes for each in painted]),
            spots=np.concatenate([each.spots[each.spot_of < 0] for each in painted]),
            ways=np.concatenate([driven, *(each.paths for each in painted)]),
        )

    def _driven(self, near: Ints) -> Floats:
        """The ways (d, 4) that the robot went between sweeps, one after the other: through no wall."""
        first = near[near + 1 < len(self._places)]
        ways = np.concatenate([self._places[first, :2], self._places[first + 1, :2]], axis=1)
        dx, dy = ways[:, 2] - ways[:, 0], ways[:, 3] - ways[:, 1]
        return np.asarray(ways[dx * dx + dy * dy <= STEP_M * STEP_M])

    def _ends(self, k: int, drawn: Painted, near: Ints) -> Gaps:
        """The gaps between walls and the corners that they end in, and between what may be one wall."""
        config, pieces = self._config, self._pieces
        seen = [*((j, self._painted[j]) for j in near.tolist()), (k, drawn)]
        rows = np.concatenate([each.spots for _, each in seen])
        numbers = np.repeat(np.array([j for j, _ in seen]), [len(each.spots) for _, each in seen])
        spots = Spots(rows[:, :2], rows[:, 2:], numbers)
        of = np.concatenate([each.spot_of for _, each in seen])
        off = spots.point - self._places[numbers, :2]
        near_by = off[:, 0] * off[:, 0] + off[:, 1] * off[:, 1] <= config.seams.reach_m * config.seams.reach_m
        joined = seams(spots.at(near_by), of[near_by] >= 0, k, config.seams, config.seam)
        walls = self._as_drawn([each for _, each in seen], least=1.0)
        may = np.append(pieces.nature, OPEN)[of] != WALL
        return end_gaps(walls, spots.at(may), k, config.ends, config.end).joined(joined)


def _stacked(parts: list[Floats]) -> tuple[Floats, Ints]:
    """Rows of all parts, and which part each is of."""
    return np.concatenate(parts), np.repeat(np.arange(len(parts)), [len(part) for part in parts])
