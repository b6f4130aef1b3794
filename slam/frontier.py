"""Block I, decision making: where to go next to see more [III.I; Yamauchi 1997].

Frontier cells are free cells next to unknown ones, their clusters are regions, and the goal is the place that shows
most for the way to it. The next scan is due at the end of the leg, from where walls are seen again.
What a scan may have changed is looked at anew after each; what was seen to be left farther off is remembered.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.choice import Afar, Bar, Choice, Lookout, Region, afar, near_by, shown
from slam.dmath import Floats
from slam.frontier_config import FrontierConfig
from slam.geometry import Bools, Pose
from slam.grid import Grid
from slam.intent import Block, Intent
from slam.planning import Path, Ways, find_path
from slam.prospects import Prospects
from slam.regions import Ranks, ranks_of
from slam.scene import Scene, scene_of
from slam.sweep import Ints
from slam.terrain import ground_of, heard_cells, heard_from, spare_cells
from slam.window import Window, changed_about, in_sight_of

KEPT = 3
"""Places to see a region from that are remembered."""


@dataclass(frozen=True)
class Decision:
    """The regions about the robot, largest first, and the chosen one (None: nothing reachable is unknown).

    One farther off comes last. The path (k, 2) m leads to a place `length_m` away that would show `gain_m2`, or, if
    that is far off, to the scan next to it; the next scan is due at its point `leg`. `blocks` were in the way, and
    `left` is how many places were left behind for later.
    """

    frontier_cells: int
    regions: tuple[Region, ...]
    chosen: int | None
    path: Floats
    leg: int = 0
    length_m: float = 0.0
    gain_m2: float = 0.0
    blocks: tuple[Block, ...] = ()
    left: int = 0


def next_goal(
    grid: Grid, poses: tuple[Pose, ...], before: Intent, config: FrontierConfig, nearest_m: float = 0.0
) -> tuple[Decision, Intent]:
    """Choose the place that shows most for the metres to it, from the last of all poses as known now.

    `nearest_m` is how far the nearest thing is that answered the last scan; 0 where nobody knows.
    """
    known, here = before.after(poses, config.block_sweeps), poses[-1]
    window = changed_about(here.x, here.y, grid.cell_m)
    ranks = _ranks(grid, window, config)
    if ranks is None:
        return Decision(0, (), None, np.zeros((0, 2)), blocks=known.blocks), known.hearing(0)
    table = _table(poses)
    known = known.hearing(heard_from(ranks, here, nearest_m, config))
    known = _remembering(grid, table, known, window, config)
    scene = scene_of(ranks, table, known, config, here=True)
    known = replace(known, roads=known.roads.joined(table[:, :2], scene.ground))
    chosen, looked = _chosen(scene, table, known, config)
    again = known.forgiving()
    if chosen is None and (again.blocks, again.vain) != (known.blocks, known.vain):  # perhaps it is gone
        known = again
        scene = scene_of(ranks, table, known, config, here=True)
        chosen, looked = _chosen(scene, table, known, config)
    decision = _decision(scene, chosen, looked, table, known, config)
    if chosen is None:
        return decision, replace(known, goal=None, leg=None)
    return decision, replace(known, goal=chosen.goal, leg=decision.path[: decision.leg + 1])


def way_to(
    grid: Grid, poses: tuple[Pose, ...], known: Intent, here: Pose, goal: tuple[float, float], config: FrontierConfig
) -> Path | None:
    """The way from here through what is known to be free, to where the robot has been before."""
    ranks = _ranks(grid, None, config)
    if ranks is None:
        return None
    table = _table(poses)
    ground = ground_of(ranks, heard_cells(ranks, table, known.heard), table, known, config)
    return find_path(ground, ground.cell(here.x, here.y), ground.cell(*goal))


def _ranks(grid: Grid, window: Window | None, config: FrontierConfig) -> Ranks | None:
    sight = window and in_sight_of(window, grid.cell_m)
    return ranks_of(grid, config.chink_cells, spare_cells(config, grid.cell_m), sight)


def _table(poses: tuple[Pose, ...]) -> Floats:
    return np.array([value for pose in poses for value in (pose.x, pose.y, pose.theta)]).reshape(-1, 3)


def _remembering(grid: Grid, poses: Floats, known: Intent, window: Window, config: FrontierConfig) -> Intent:
    """With what was left behind where the window has moved on, and without what is in it now."""
    left = known.left.only(~_within(window, known.left.now(poses), grid.cell_m))
    before = known.window
    if before is not None and before != window:
        behind = before.without(window)
        ranks = _ranks(grid, behind, config)
        if ranks is not None:
            scene = scene_of(ranks, poses, known, config, here=False)
            rows, columns = scene.lattice(config.apart_m / 2.0, behind)
            outside = ~window.holds(columns + ranks.left, rows + ranks.bottom)
            found = scene.prospects(rows[outside], columns[outside], config.apart_m / 4.0)
            left = left.and_(found.only(_best_of_each(found, shown(found, config), config.min_gain_m2)), poses)
    return replace(known, left=left, window=window)


def _best_of_each(found: Prospects, worth: Floats, least: float) -> Ints:
    """The best places for each region, if they are worth so much: the way to one of them may turn out to be closed."""
    order = np.lexsort((-worth, found.regions[:, 1], found.regions[:, 0]))
    regions = found.regions[order]
    same = np.zeros(len(order), dtype=np.bool_)
    same[KEPT:] = (regions[KEPT:] == regions[:-KEPT]).all(axis=1)
    return np.sort(order[~same & (worth[order] >= least)])


def _within(window: Window, prospects: Prospects, cell_m: float) -> Bools:
    cells = np.floor(prospects.places / cell_m).astype(np.int64)
    return window.holds(cells[:, 0], cells[:, 1])


def _chosen(scene: Scene, poses: Floats, known: Intent, config: FrontierConfig) -> tuple[Choice | None, Prospects]:
    """The best place of all; far off for less only where nothing else is left. With what was looked at near by."""
    assert known.window is not None
    left, scans = known.left.now(poses), poses[:, :2]
    near = _within(in_sight_of(known.window, scene.ranks.cell_m), left, scene.ranks.cell_m)
    start = scene.ground.cell(float(poses[-1, 0]), float(poses[-1, 1]))
    ways = Ways(scene.ground, start)
    blocks = np.array([(block.x, block.y) for block in known.blocks]).reshape(-1, 2)
    roads = known.roads.without(scans, blocks, config.block_m + config.robot_radius_m)
    lookout = Lookout(scene, known.window, start, config, left.only(near))
    far = Afar(left.only(~near), known.left.scans[~near], scans, roads)
    for last in (False, True):
        bar = Bar(config, known, len(poses), last=last)
        best = near_by(lookout, ways, bar)
        best = afar(far, ways, scene.ground, bar, best.value if best else 0.0) or best
        if best is not None:
            break
    return best, lookout.prospects


def _decision(
    scene: Scene, chosen: Choice | None, looked: Prospects, poses: Floats, known: Intent, config: FrontierConfig
) -> Decision:
    pieces = scene.pieces
    centres = scene.points(pieces.rows, pieces.columns)
    names = [(x, y) for x, y in centres.tolist()]
    gains = dict.fromkeys(names, 0.0)
    for (x, y), gain in zip(looked.regions.tolist(), looked.gains.tolist(), strict=True):
        gains[x, y] = max(gain, gains.get((x, y), 0.0))
    regions = tuple(Region(size, name, gains[name]) for size, name in zip(pieces.sizes.tolist(), names, strict=True))
    blocks, left = known.blocks, len(known.left.scans)
    if chosen is None:
        return Decision(scene.frontier_cells, regions, None, np.zeros((0, 2)), blocks=blocks, left=left)
    region = chosen.region
    if region.centre not in names:
        names, regions = [*names, region.centre], (*regions, region)
    path = chosen.path
    leg = _leg(path.points, poses, config)
    which = names.index(region.centre)
    return Decision(scene.frontier_cells, regions, which, path.points, leg, path.length_m, region.gain_m2, blocks, left)


def _leg(path: Floats, scans: Floats, config: FrontierConfig) -> int:
    """The point of the path where to scan next: where the walls seen so far are seen again."""
    steps = dmath.hypot(path[1:, 0] - path[:-1, 0], path[1:, 1] - path[:-1, 1])
    gone = np.concatenate([np.zeros(1), np.cumsum(steps)])
    near = path[gone <= config.known_leg_m]
    known = np.zeros(len(path), dtype=np.bool_)
    known[: len(near)] = (dmath.hypot(near[:, :1] - scans[:, 0], near[:, 1:] - scans[:, 1]) < config.known_m).any(
        axis=1
    )
    may = (gone <= config.leg_m) | (known & (gone <= config.known_leg_m))
    last = int(np.flatnonzero(may)[-1])
    # A stump of a leg at the end is no leg of its own.
    return len(path) - 1 if gone[-1] - gone[last] < 0.3 and gone[-1] < config.known_leg_m else last
