"""Block I, decision making: where to go next to see more [III.I; Yamauchi 1997].

Frontier cells are free cells next to unknown ones, their clusters are regions, and the goal is the region of best
gain for the cost of the way to it. The next scan is due at the end of the leg, from where walls are seen again.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.boards import board, stride_of, within
from slam.dmath import Floats
from slam.geometry import Bools, Pose
from slam.grid import Grid
from slam.intent import Block, Intent
from slam.planning import STRAIGHT, Cell, Ground, Path, Ways, find_path, least
from slam.regions import Pieces, Ranks, frontier_of, pieces_of, ranks_of
from slam.sweep import Ints
from slam.views import Views, views_of

COARSE = 2
"""Cells of the map a side of one cell of the ground; the map's tiles hold a whole number of them."""

TRAIL_M = 0.20
"""Half the width of the way that the robot surely has where it has driven."""

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
    clear_m: float = 0.35  # a way that keeps so much more off walls, and off the unknown, costs half
    settle_m: float = 0.7  # added to every way: a near goal is not infinitely good
    min_gain_m2: float = 0.25  # for less no robot moves …
    more_gain_m2: float = 0.06  # … nor for so much less a metre of way …
    enough_gain_m2: float = 0.9  # … but it does for this
    picky_m2: float = 20.0  # of a place larger than this, less than as small a share is nothing
    apart_m: float = 0.65  # nearer than this to a scan there is no other; where none is left half and a quarter of it
    most_gain_m2: float = 2.0  # a view that promises more is not better
    vain_m: float = 0.5  # so near to where the robot could not get to …
    vain_share: float = 0.4  # … a view is worth so much less, each time
    stay: float = 1.3  # what the goal chosen before is worth more
    leg_m: float = 0.9  # from scan to scan where nobody stood before
    known_leg_m: float = 1.8  # where the walls were seen from near the next place already
    known_m: float = 0.6
    block_m: float = 0.15  # the size of what was in the way
    block_sweeps: int = 12  # so long it is believed to be there


@dataclass(frozen=True)
class Region:
    """A piece of frontier: its cells, its middle (x, y) m, and the m² that the best view near it would show."""

    cells: int
    centre: tuple[float, float]
    gain_m2: float


@dataclass(frozen=True)
class Decision:
    """The regions, largest first; the chosen one (None: nothing reachable is unknown) and the path (k, 2) m to it.

    The path leads to a view of the region, `length_m` away, that would show `gain_m2`; the next scan is due at its
    point `leg`. `blocks` were in the way.
    """

    frontier_cells: int
    regions: tuple[Region, ...]
    chosen: int | None
    path: Floats
    leg: int = 0
    length_m: float = 0.0
    gain_m2: float = 0.0
    blocks: tuple[Block, ...] = ()


def next_goal(grid: Grid, poses: tuple[Pose, ...], before: Intent, config: FrontierConfig) -> tuple[Decision, Intent]:
    """Choose the frontier region that shows most for the metres to it, from the last of all poses as known now."""
    known = before.after(poses, config.block_sweeps)
    decision = _decided(grid, poses, known, config)
    again = known.forgiving()
    if decision.chosen is None and (again.blocks, again.vain) != (known.blocks, known.vain):  # perhaps it is gone
        known = again
        decision = _decided(grid, poses, known, config)
    if decision.chosen is None:
        return decision, replace(known, goal=None, leg=None)
    x, y = decision.path[-1].tolist()
    return decision, replace(known, goal=(x, y), leg=decision.path[: decision.leg + 1])


def ground_of(ranks: Ranks, poses: tuple[Pose, ...], known: Intent, config: FrontierConfig) -> Ground:
    """Where the robot's centre may be: on free cells that keep its radius away from anything occupied.

    And where it has been, whatever the map says now; but not where something was in its way since.
    """
    radius = _radius(config, ranks.cell_m)
    clear = int(config.clear_m / ranks.cell_m + 0.5)
    blocks = np.array([(block.x, block.y) for block in known.blocks]).reshape(-1, 2)
    trail = _discs(known.driven(poses), ranks, TRAIL_M) & ~_discs(blocks, ranks, config.block_m + config.robot_radius_m)
    solid = (ranks.occupied | _discs(blocks, ranks, config.block_m)) & ~trail
    keep_off = within(solid, ranks.stride, radius)
    near = within((keep_off & ranks.open) | ranks.unknown, ranks.stride, clear) & ranks.everywhere
    passable = ranks.array((ranks.open & ~keep_off) | trail)
    rows, columns = ranks.shape[0] // COARSE, ranks.stride // COARSE
    stride = stride_of(columns, 1)

    def coarse(cells: Bools) -> Bools:
        return np.asarray(cells.reshape(rows, COARSE, columns, COARSE).any(axis=(1, 3)))

    may = ~coarse(~passable)
    return Ground(
        board(may, stride),
        stride,
        (rows, columns),
        ranks.left // COARSE,
        ranks.bottom // COARSE,
        ranks.cell_m * COARSE,
        tight=board(may & coarse(ranks.array(near)), stride),
        solid=board(coarse(ranks.array(solid)), stride),
    )


def way_to(
    grid: Grid, poses: tuple[Pose, ...], known: Intent, here: Pose, goal: tuple[float, float], config: FrontierConfig
) -> Path | None:
    """The way from here through what is known to be free, to where the robot has been before."""
    ranks = ranks_of(grid, config.chink_cells, _spare(config, grid.cell_m))
    if ranks is None:
        return None
    ground = ground_of(ranks, poses, known, config)
    return find_path(ground, ground.cell(here.x, here.y), ground.cell(*goal))


def _radius(config: FrontierConfig, cell_m: float) -> int:
    return int((config.robot_radius_m + config.margin_m) / cell_m + 0.5)


def _spare(config: FrontierConfig, cell_m: float) -> int:
    return _radius(config, cell_m) + int(config.clear_m / cell_m + 0.5)


def _discs(points: Floats, ranks: Ranks, radius_m: float) -> int:
    """Discs about points (n, 2), as a board."""
    rows = np.floor(points[:, 1] / ranks.cell_m).astype(np.int64) - ranks.bottom
    columns = np.floor(points[:, 0] / ranks.cell_m).astype(np.int64) - ranks.left
    inside = (rows >= 0) & (rows < ranks.shape[0]) & (columns >= 0) & (columns < ranks.shape[1])
    cells = np.zeros((ranks.shape[0], ranks.stride), dtype=np.bool_)
    cells[rows[inside], columns[inside]] = True
    return within(ranks.board(cells), ranks.stride, int(radius_m / ranks.cell_m + 0.5)) & ranks.everywhere


def _decided(grid: Grid, poses: tuple[Pose, ...], known: Intent, config: FrontierConfig) -> Decision:
    blocks = known.blocks
    nothing = Decision(0, (), None, np.zeros((0, 2)), blocks=blocks)
    ranks = ranks_of(grid, config.chink_cells, _spare(config, grid.cell_m))
    if ranks is None:
        return nothing
    frontier = frontier_of(ranks)
    pieces = pieces_of(frontier, ranks, config.min_cells, int(config.piece_m / grid.cell_m + 0.5))
    if len(pieces.sizes) == 0:
        return nothing
    ground = ground_of(ranks, poses, known, config)
    start = ground.cell(poses[-1].x, poses[-1].y)
    stations = np.array([(pose.x, pose.y) for pose in poses])
    reached = _fine(ground.reached(start), ground)
    picky = max(1.0, float(np.count_nonzero(reached)) * grid.cell_m * grid.cell_m / config.picky_m2)
    for part in (1, 2, 4):
        views = views_of(ranks, reached, (pieces.rows, pieces.columns), stations, config.apart_m / part)
        cells = list(zip((views.rows // COARSE).tolist(), (views.columns // COARSE).tolist(), strict=True))
        best, path = _best(_worth(views, ranks, known, config), cells, ground, start, picky, config)
        if best is not None:
            break
    regions, of = _regions(pieces, views, ranks)
    if best is None or path is None:
        return Decision(frontier.bit_count(), regions, None, nothing.path, blocks=blocks)
    leg = _leg(path.points, poses, config)
    gain = float(views.gains[best])
    return Decision(frontier.bit_count(), regions, int(of[best]), path.points, leg, path.length_m, gain, blocks)


def _fine(reached: Bools, ground: Ground) -> Bools:
    """Cells of the map (h, w) of cells of the ground."""
    cells = reached.reshape(-1, ground.stride)[:, : ground.shape[1]]
    return np.repeat(np.repeat(cells, COARSE, axis=0), COARSE, axis=1)


def _regions(pieces: Pieces, views: Views, ranks: Ranks) -> tuple[tuple[Region, ...], Ints]:
    """The regions, and for each view the region that is nearest to it."""
    dr, dc = views.rows[:, None] - pieces.rows, views.columns[:, None] - pieces.columns
    of = np.argmin(dr * dr + dc * dc, axis=1)
    gains = np.zeros(len(pieces.sizes))
    np.maximum.at(gains, of, views.gains)
    centres = _points(pieces.rows, pieces.columns, ranks)
    seen = zip(pieces.sizes.tolist(), centres.tolist(), gains.tolist(), strict=True)
    return tuple(Region(size, (x, y), gain) for size, (x, y), gain in seen), of


def _points(rows: Ints, columns: Ints, ranks: Ranks) -> Floats:
    """The middles (n, 2) of cells, metres."""
    cells = np.stack([columns + ranks.left, rows + ranks.bottom], axis=1).astype(np.float64)
    return (cells + 0.5) * ranks.cell_m


def _worth(views: Views, ranks: Ranks, known: Intent, config: FrontierConfig) -> Floats:
    """What each view is worth before the way to it: what it would show, less where the way was in vain before."""
    places = _points(views.rows, views.columns, ranks)
    worth = np.minimum(views.gains, config.most_gain_m2)
    for each in known.vain:
        near = dmath.hypot(places[:, 0] - each.x, places[:, 1] - each.y) < config.vain_m
        for _ in range(each.times):
            worth = np.where(near, worth * config.vain_share, worth)
    if known.goal is not None:
        same = dmath.hypot(places[:, 0] - known.goal[0], places[:, 1] - known.goal[1]) < config.vain_m
        worth = np.where(same, worth * config.stay, worth)
    return np.asarray(worth)


def _best(
    worth: Floats, targets: list[Cell], ground: Ground, start: Cell, picky: float, config: FrontierConfig
) -> tuple[int | None, Path | None]:
    """The place that is worth most for the way to it, and the way; of equals the first."""
    left = np.flatnonzero(worth > 0.0).tolist()
    cells = {k: targets[k] for k in left}
    ways = Ways(ground, start, list(cells.values()))
    straight = {k: least(start, cell) for k, cell in cells.items()}
    best, found, more = (0.0, 0), False, True
    while left:
        waiting = []
        for k in left:
            cost = ways.found.get(cells[k])
            # The way to what was not found is no shorter than the straight one, and longer than what was gone so far.
            length_m = (max(straight[k], ways.reached) if cost is None else cost) / STRAIGHT * ground.cell_m
            value = float(worth[k]) / (length_m + config.settle_m)
            if worth[k] < picky * min(config.min_gain_m2 + config.more_gain_m2 * length_m, config.enough_gain_m2):
                continue
            if cost is None and value >= best[0]:
                waiting.append(k)
            elif cost is not None and value >= best[0]:
                best, found = max(best, (value, -k)), True
        left = waiting
        if not more:
            break
        for _ in range(ROUND if left else 0):
            more = ways.go_on()
    return (-best[1], ways.path(cells[-best[1]])) if found else (None, None)


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
