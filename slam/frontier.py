"""Block I, decision making: where to go next to see more [III.I; Yamauchi 1997].

Frontier cells are free cells next to unknown ones, their clusters are regions, and the goal is the region of best
gain for the cost of the way to it. The next scan is due at the end of the leg, from where walls are seen again.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.frontier_config import FrontierConfig
from slam.geometry import Bools, Pose
from slam.grid import Grid
from slam.intent import Block, Intent
from slam.planning import DIAGONAL, STRAIGHT, Cell, Ground, Path, Ways, find_path, least
from slam.regions import Pieces, Ranks, frontier_of, pieces_of, ranks_of
from slam.sweep import Ints
from slam.terrain import COARSE, fine, ground_of, heard_from, room_to_stand, spare_cells
from slam.views import Views, lattice, views_of

FIRST_M = 1.5
"""Views so near are looked at first; then, as long as any may be better, those twice as far."""

ROUND = 16
"""Waves of the search for ways between two looks at what may still win."""


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


def next_goal(
    grid: Grid, poses: tuple[Pose, ...], before: Intent, config: FrontierConfig, nearest_m: float = 0.0
) -> tuple[Decision, Intent]:
    """Choose the frontier region that shows most for the metres to it, from the last of all poses as known now.

    `nearest_m` is how far the nearest thing is that answered the last scan; 0 where nobody knows.
    """
    known = before.after(poses, config.block_sweeps)
    ranks = ranks_of(grid, config.chink_cells, spare_cells(config, grid.cell_m))
    known = known.hearing(heard_from(ranks, poses[-1], nearest_m, config) if ranks else 0)
    decision = _decided(ranks, poses, known, config)
    again = known.forgiving()
    if decision.chosen is None and again.blocks != known.blocks:  # perhaps it is gone
        known = again
        decision = _decided(ranks, poses, known, config)
    if decision.chosen is None:
        return decision, replace(known, goal=None, leg=None)
    x, y = decision.path[-1].tolist()
    return decision, replace(known, goal=(x, y), leg=decision.path[: decision.leg + 1])


def way_to(
    grid: Grid, poses: tuple[Pose, ...], known: Intent, here: Pose, goal: tuple[float, float], config: FrontierConfig
) -> Path | None:
    """The way from here through what is known to be free, to where the robot has been before."""
    ranks = ranks_of(grid, config.chink_cells, spare_cells(config, grid.cell_m))
    if ranks is None:
        return None
    ground = ground_of(ranks, poses, known, config)
    return find_path(ground, ground.cell(here.x, here.y), ground.cell(*goal))


def _decided(ranks: Ranks | None, poses: tuple[Pose, ...], known: Intent, config: FrontierConfig) -> Decision:
    blocks = known.blocks
    nothing = Decision(0, (), None, np.zeros((0, 2)), blocks=blocks)
    if ranks is None:
        return nothing
    frontier = frontier_of(ranks)
    pieces = pieces_of(frontier, ranks, config.min_cells, int(config.piece_m / ranks.cell_m + 0.5))
    if len(pieces.sizes) == 0:
        return nothing
    ground = ground_of(ranks, poses, known, config)
    start = ground.cell(poses[-1].x, poses[-1].y)
    stations = np.array([(pose.x, pose.y) for pose in poses])
    reached = fine(ground.reached(start), ground)
    standing = reached & room_to_stand(ranks, poses, known, config)
    picky = max(1.0, float(np.count_nonzero(reached)) * ranks.cell_m * ranks.cell_m / config.picky_m2)
    search = _Search(ranks, ground, start, known, (pieces.rows, pieces.columns), stations, picky, config)
    # From nearer to earlier scans, and far off for less, only where nothing else is left.
    for part, last in ((2.0, False), (4.0, False), (2.0, True)):
        views, best, path = search.best(standing, config.apart_m / part, last=last)
        if best is not None:
            break
    regions, of = _regions(pieces, views, ranks)
    if best is None or path is None:
        return Decision(frontier.bit_count(), regions, None, nothing.path, blocks=blocks)
    leg = _leg(path.points, poses, config)
    gain = float(views.gains[best])
    return Decision(frontier.bit_count(), regions, int(of[best]), path.points, leg, path.length_m, gain, blocks)


@dataclass(frozen=True)
class _Search:
    """All that the choice among views rests upon."""

    ranks: Ranks
    ground: Ground
    start: Cell
    known: Intent
    frontier: tuple[Ints, Ints]
    stations: Floats
    picky: float
    config: FrontierConfig

    def best(self, reached: Bools, apart_m: float, *, last: bool) -> tuple[Views, int | None, Path | None]:
        """The views that were looked at, nearest first, the best of them, and the way there.

        As many as may still win: what is farther is worth no more than the most that a view can be.
        """
        rows, columns = lattice(self.ranks, reached, apart_m)
        dr, dc = np.abs(rows // COARSE - self.start[0]), np.abs(columns // COARSE - self.start[1])
        costs = STRAIGHT * np.maximum(dr, dc) + (DIAGONAL - STRAIGHT) * np.minimum(dr, dc)
        lengths = costs * (self.ground.cell_m / STRAIGHT)
        asked = replace(self.config, more_gain_m2=self.config.far_gain_m2) if last else self.config
        within_m, most = FIRST_M, float(lengths.max(initial=0.0))
        ways = Ways(self.ground, self.start, _cells(rows, columns))
        while True:
            mine = lengths <= within_m
            views, away = views_of(self.ranks, (rows[mine], columns[mine]), self.frontier, self.stations, apart_m)
            worth = _worth(views, self.ranks, self.known, self.config)
            worth *= np.minimum(away / (2.0 * apart_m), 1.0)
            if last:
                worth = np.where(away >= 1.5 * self.config.apart_m, worth, 0.0)
            cells = _cells(views.rows, views.columns)
            value, best, path = _best(worth, cells, ways, self.ground, self.start, self.picky, asked)
            unseen = self.config.most_gain_m2 * self.config.stay / (within_m + self.config.settle_m)
            if within_m >= most or value > unseen:
                return views, best, path
            within_m *= 2.0


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
    worth = np.minimum(views.gains, config.most_gain_m2) * (1.0 - config.lost * (2.0 - views.square))
    for each in known.vain:
        near = dmath.hypot(places[:, 0] - each.x, places[:, 1] - each.y) < config.vain_m
        for _ in range(each.times):
            worth = np.where(near, worth * config.vain_share, worth)
    if known.goal is not None:
        same = dmath.hypot(places[:, 0] - known.goal[0], places[:, 1] - known.goal[1]) < config.vain_m
        worth = np.where(same, worth * config.stay, worth)
    return np.asarray(worth)


def _cells(rows: Ints, columns: Ints) -> list[Cell]:
    """Cells of the ground."""
    return list(zip((rows // COARSE).tolist(), (columns // COARSE).tolist(), strict=True))


def _best(
    worth: Floats,
    targets: list[Cell],
    ways: Ways,
    ground: Ground,
    start: Cell,
    picky: float,
    config: FrontierConfig,
) -> tuple[float, int | None, Path | None]:
    """What the best place is worth for the way to it, the place, of equals the first, and the way."""
    left = np.flatnonzero(worth > 0.0).tolist()
    cells = {k: targets[k] for k in left}
    straight = {k: least(start, cell) for k, cell in cells.items()}
    best, found, more = (0.0, 0), False, True
    while left:
        waiting = []
        for k in left:
            cost = ways.found.get(cells[k])
            # The way to what was not found is no shorter than the straight one, and longer than what was gone so far.
            length_m = (max(straight[k], ways.reached) if cost is None else cost) / STRAIGHT * ground.cell_m
            value = float(worth[k]) / (length_m + config.settle_m)
            if worth[k] < min(picky * (config.min_gain_m2 + config.more_gain_m2 * length_m), config.enough_gain_m2):
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
    return (best[0], -best[1], ways.path(cells[-best[1]])) if found else (0.0, None, None)


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
