"""Block I, decision making: where to go next to see more [III.I; Yamauchi 1997].

Frontier cells are free cells next to unknown ones, their clusters are regions, and the goal is the region of best
gain for the cost of the way to it. The next scan is due at the end of the leg, from where walls are seen again.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.boards import within
from slam.dmath import Floats
from slam.geometry import Pose
from slam.grid import Grid
from slam.intent import Block, Intent
from slam.lookouts import Places, lookouts, nearest
from slam.planning import STRAIGHT, Cell, Ground, Path, Ways, find_path, least
from slam.regions import Ranks, frontier_of, pieces_of, ranks_of

ROUND = 16
"""Waves of the search for ways between two looks at what may still win."""


@dataclass(frozen=True)
class FrontierConfig:
    """Which regions count, how far from walls the robot keeps, what the way costs, and when to scan on the way."""

    min_cells: int = 6
    chink_cells: int = 2  # unknown stretches nowhere wider than twice as many cells are left
    piece_m: float = 1.0  # regions are cut into pieces so large
    robot_radius_m: float = 0.18
    margin_m: float = 0.10
    clear_m: float = 0.25  # a way that keeps so much more off walls, and off the unknown, costs half
    view_m: float = 0.7  # from so far away a region may be looked at
    far_view_m: float = 1.5  # the same, when nothing else is left
    settle_m: float = 0.5  # added to every way: a near goal is not infinitely good
    min_gain_m2: float = 0.08
    most_gain_m2: float = 2.0  # a region that promises more is not better
    looked_share: float = 0.5  # what is left of a region's worth each time that it was looked at and is still there
    stood_m: float = 0.35  # nearer than this to a scan there need not be another
    stay: float = 1.3  # what the goal chosen before is worth more
    leg_m: float = 0.9  # from scan to scan where nobody stood before
    known_leg_m: float = 1.8  # where the walls were seen from near the next place already
    known_m: float = 0.6
    block_m: float = 0.15  # the size of what was in the way
    block_sweeps: int = 12  # so long it is believed to be there


@dataclass(frozen=True)
class Region:
    """A piece of frontier: how many cells, its middle (x, y) m, the m² it would show, and the cell to go to, if any."""

    cells: int
    centre: tuple[float, float]
    gain_m2: float
    target: tuple[int, int] | None


@dataclass(frozen=True)
class Decision:
    """The regions, largest first; the chosen one (None: nothing reachable is unknown) and the path (k, 2) m to it.

    The next scan is due at point `leg` of the path; `length_m` is the way to the goal. `blocks` were in the way.
    """

    frontier_cells: int
    regions: tuple[Region, ...]
    chosen: int | None
    path: Floats
    leg: int = 0
    length_m: float = 0.0
    blocks: tuple[Block, ...] = ()


def next_goal(grid: Grid, poses: tuple[Pose, ...], before: Intent, config: FrontierConfig) -> tuple[Decision, Intent]:
    """Choose the frontier region that shows most for the metres to it, from the last of all poses as known now."""
    known = before.after(poses[-1], len(poses) - 1, config.block_sweeps)
    decision = _decided(grid, poses, known, config)
    if decision.chosen is None and (again := known.forgiving()) != known:  # perhaps it is gone
        known = again
        decision = _decided(grid, poses, known, config)
    if decision.chosen is None:
        return decision, replace(known, goal=None, leg=None)
    goal = decision.regions[decision.chosen].centre
    return decision, replace(known, goal=goal, leg=decision.path[: decision.leg + 1])


def ground_of(ranks: Ranks, blocks: tuple[Block, ...], config: FrontierConfig) -> Ground:
    """Where the robot's centre may be: on free cells that keep its radius away from anything occupied."""
    radius = _radius(config, ranks.cell_m)
    clear = int(config.clear_m / ranks.cell_m + 0.5)
    solid = ranks.occupied | _discs(blocks, ranks, config.block_m)
    keep_off = within(solid, ranks.stride, radius)
    near = within((keep_off & ranks.open) | ranks.unknown, ranks.stride, clear)
    passable = ranks.open & ~keep_off
    return Ground(
        passable,
        ranks.stride,
        ranks.shape,
        ranks.left,
        ranks.bottom,
        ranks.cell_m,
        tight=passable & near,
        solid=solid,
    )


def way_to(grid: Grid, pose: Pose, goal: tuple[float, float], config: FrontierConfig) -> Path | None:
    """The way through what is known to be free, to where the robot has been before."""
    ranks = ranks_of(grid, config.chink_cells, _spare(config, grid.cell_m))
    if ranks is None:
        return None
    ground = ground_of(ranks, (), config)
    return find_path(ground, ground.cell(pose.x, pose.y), ground.cell(*goal))


def _radius(config: FrontierConfig, cell_m: float) -> int:
    return int((config.robot_radius_m + config.margin_m) / cell_m + 0.5)


def _spare(config: FrontierConfig, cell_m: float) -> int:
    return _radius(config, cell_m) + int(config.clear_m / cell_m + 0.5)


def _discs(blocks: tuple[Block, ...], ranks: Ranks, radius_m: float) -> int:
    """What was in the way, as a board."""
    board = 0
    for block in blocks:
        row, column = int(block.y // ranks.cell_m) - ranks.bottom, int(block.x // ranks.cell_m) - ranks.left
        if 0 <= row < ranks.shape[0] and 0 <= column < ranks.shape[1]:
            board |= 1 << (row * ranks.stride + column)
    return within(board, ranks.stride, int(radius_m / ranks.cell_m)) if board else 0


def _decided(grid: Grid, poses: tuple[Pose, ...], known: Intent, config: FrontierConfig) -> Decision:
    blocks = known.blocks
    nothing = Decision(0, (), None, np.zeros((0, 2)), blocks=blocks)
    ranks = ranks_of(grid, config.chink_cells, _spare(config, grid.cell_m))
    if ranks is None:
        return nothing
    frontier = frontier_of(ranks)
    pieces = pieces_of(frontier, ranks, config.min_cells, int(config.piece_m / grid.cell_m + 0.5))
    ground = ground_of(ranks, blocks, config)
    start = ground.cell(poses[-1].x, poses[-1].y)
    centres = np.stack([pieces.columns + ranks.left, pieces.rows + ranks.bottom], axis=1) + 0.5
    centres = centres.astype(np.float64) * grid.cell_m
    stations = np.array([(pose.x, pose.y) for pose in poses] + [(each.x, each.y) for each in known.vain])
    done = Places(stations, config.stood_m)
    targets = lookouts(pieces, ground, start, config.view_m, done)
    chosen, path = _best(_worth(pieces.gains, centres, stations, known, config), targets, ground, start, config)
    if chosen is None:  # what cannot be reached may be seen better from the nearest place that can
        targets = nearest(pieces, ground, start, config.far_view_m, done)
        chosen, path = _best(np.minimum(pieces.gains, config.most_gain_m2), targets, ground, start, config)
    regions = tuple(
        Region(size, (x, y), gain, target)
        for size, (x, y), gain, target in zip(
            pieces.sizes.tolist(), centres.tolist(), pieces.gains.tolist(), targets, strict=True
        )
    )
    if chosen is None or path is None:
        return Decision(frontier.bit_count(), regions, None, nothing.path, blocks=blocks)
    leg = _leg(path.points, poses, config)
    return Decision(frontier.bit_count(), regions, chosen, path.points, leg, path.length_m, blocks)


def _worth(gains: Floats, centres: Floats, stations: Floats, before: Intent, config: FrontierConfig) -> Floats:
    """What each piece is worth before the way to it: what it would show, unless looking there has not helped."""
    near = dmath.hypot(centres[:, :1] - stations[:, 0], centres[:, 1:] - stations[:, 1]) < config.view_m
    worth = np.minimum(gains, config.most_gain_m2)
    looked = np.count_nonzero(near, axis=1)
    for times in range(1, int(looked.max(initial=0)) + 1):
        worth = np.where(looked >= times, worth * config.looked_share, worth)
    worth = np.where(worth < config.min_gain_m2, 0.0, worth)
    if before.goal is not None:
        same = dmath.hypot(centres[:, 0] - before.goal[0], centres[:, 1] - before.goal[1]) < 0.5 * config.piece_m
        worth = np.where(same, worth * config.stay, worth)
    return np.asarray(worth)


def _best(
    worth: Floats, targets: list[Cell | None], ground: Ground, start: Cell, config: FrontierConfig
) -> tuple[int | None, Path | None]:
    """The piece that is worth most for the way to it, and the way; of equals the first."""
    left = [k for k, target in enumerate(targets) if target is not None and worth[k] > 0.0]
    cells = {k: targets[k] or start for k in left}
    ways = Ways(ground, start, list(cells.values()))
    straight = {k: least(start, cell) for k, cell in cells.items()}
    best: tuple[float, int] = (0.0, 0)
    more = True
    while left:
        waiting = []
        for k in left:
            cost = ways.found.get(cells[k])
            # The way to what was not found is no shorter than the straight one, and longer than what was gone so far.
            length_m = (max(straight[k], ways.reached) if cost is None else cost) / STRAIGHT * ground.cell_m
            value = float(worth[k]) / (length_m + config.settle_m)
            if cost is not None:
                best = max(best, (value, -k))
            elif value >= best[0]:
                waiting.append(k)
        left = waiting
        if not more:
            break
        for _ in range(ROUND if left else 0):
            more = ways.go_on()
    return (-best[1], ways.path(cells[-best[1]])) if best[0] > 0.0 else (None, None)


def _leg(path: Floats, poses: tuple[Pose, ...], config: FrontierConfig) -> int:
    """The point of the path where to scan next: where the walls seen so far are seen again."""
    steps = dmath.hypot(path[1:, 0] - path[:-1, 0], path[1:, 1] - path[:-1, 1])
    gone = np.concatenate([np.zeros(1), np.cumsum(steps)])
    x, y = (np.array(values) for values in ([pose.x for pose in poses], [pose.y for pose in poses]))
    known = (dmath.hypot(path[:, :1] - x, path[:, 1:] - y) < config.known_m).any(axis=1)
    may = (gone <= config.leg_m) | (known & (gone <= config.known_leg_m))
    last = int(np.flatnonzero(may)[-1])
    # A stump of a leg at the end is no leg of its own.
    return len(path) - 1 if gone[-1] - gone[last] < 0.3 and gone[-1] < config.known_leg_m else last
