"""Where the robot's centre may be: where the map is free, where it has driven, and what lies close about a scan.

The nearest point of any surface is the foot of a perpendicular, a corner or an edge, and all of these answer: so in a
circle about a scan that reaches as far as the nearest thing known, there is nothing, drawn or not.
Must not know: regions, views, what is chosen.
"""

from functools import cache

import numpy as np

from slam.boards import board, stride_of, within
from slam.dmath import Floats
from slam.frontier_config import FrontierConfig
from slam.geometry import Bools, Pose
from slam.intent import Intent
from slam.planning import Ground
from slam.regions import Ranks
from slam.sweep import Ints

COARSE = 2
"""Cells of the map a side of one cell of the ground; the map's tiles hold a whole number of them."""

TRAIL_M = 0.20
"""Half the width of the way that the robot surely has where it has driven."""


def spare_cells(config: FrontierConfig, cell_m: float) -> int:
    """By so many cells masks grow here."""
    return _radius(config, cell_m) + int(config.clear_m / cell_m + 0.5)


def heard_from(ranks: Ranks, here: Pose, nearest_m: float, config: FrontierConfig) -> int:
    """The circle about a scan that nothing stands in: its radius in cells of the map.

    `nearest_m` is how far the nearest thing is that answered, whether the map shows it yet or not.
    """
    most = int(min(config.heard_m, nearest_m) / ranks.cell_m)
    row, column = (int(value // ranks.cell_m) for value in (here.y, here.x))
    bottom, left = row - ranks.bottom - most, column - ranks.left - most
    low, far = max(bottom, 0), max(left, 0)
    near = ranks.array(ranks.occupied)[low : max(low, bottom + 2 * most + 1), far : max(far, left + 2 * most + 1)]
    rows, columns = np.nonzero(near)
    dr, dc = rows + (low - bottom - most), columns + (far - left - most)
    nearest = int((dr * dr + dc * dc).min(initial=(most + 1) * (most + 1)))
    return max(k for k in range(most + 1) if k == 0 or k * k < nearest)


def room_to_stand(ranks: Ranks, heard: int, config: FrontierConfig) -> Bools:
    """Cells (h, w) whose surroundings were seen or heard: what is unknown beside a free cell may well be a wall."""
    unknown = ranks.unknown & ~heard
    near = within(unknown, ranks.stride, int(config.unseen_m / ranks.cell_m + 0.5))
    return ranks.array(~near & ranks.everywhere)


def ground_of(ranks: Ranks, heard: int, poses: Floats, known: Intent, config: FrontierConfig) -> Ground:
    """On cells that are free, or close about a scan, and keep the robot's radius away from anything occupied.

    And where it has been, scanning at `poses` (n, 3), whatever the map says now; but not where something was in its
    way since. `heard`: the board of `heard_cells`.
    """
    clear = int(config.clear_m / ranks.cell_m + 0.5)
    blocks = np.array([(block.x, block.y) for block in known.blocks]).reshape(-1, 2)
    trail = _discs(known.driven(poses), ranks, TRAIL_M) & ~_discs(blocks, ranks, config.block_m + config.robot_radius_m)
    solid = (ranks.occupied | _discs(blocks, ranks, config.block_m)) & ~trail
    keep_off = within(solid, ranks.stride, _radius(config, ranks.cell_m))
    walls = (keep_off & ranks.open) | (ranks.unknown & ~heard)
    near, close = (within(walls, ranks.stride, cells) & ranks.everywhere for cells in (clear, clear // 2))
    passable = ranks.array(((ranks.open | heard) & ~keep_off) | trail)
    rows, columns = ranks.shape[0] // COARSE, ranks.stride // COARSE
    stride = stride_of(columns, 1)
    may = ~_coarse(~passable)
    return Ground(
        board(may, stride),
        stride,
        (rows, columns),
        ranks.left // COARSE,
        ranks.bottom // COARSE,
        ranks.cell_m * COARSE,
        tight=board(may & _coarse(ranks.array(near)), stride),
        close=board(may & _coarse(ranks.array(close)), stride),
        solid=board(_coarse(ranks.array(solid)), stride),
    )


def _coarse(cells: Bools) -> Bools:
    """Cells of the ground any of whose cells of the map are set."""
    rows = cells[::COARSE] | cells[1::COARSE]
    return np.asarray(rows[:, ::COARSE] | rows[:, 1::COARSE])


def fine(reached: Bools, ground: Ground) -> Bools:
    """Cells of the map (h, w) of cells of the ground."""
    cells = reached.reshape(-1, ground.stride)[:, : ground.shape[1]]
    return np.repeat(np.repeat(cells, COARSE, axis=0), COARSE, axis=1)


def _radius(config: FrontierConfig, cell_m: float) -> int:
    return int((config.robot_radius_m + config.margin_m) / cell_m + 0.5)


def _places(points: Floats, cell_m: float, bottom: int, left: int) -> tuple[Ints, Ints]:
    rows = np.floor(points[:, 1] / cell_m).astype(np.int64) - bottom
    return rows, np.floor(points[:, 0] / cell_m).astype(np.int64) - left


def _discs(points: Floats, ranks: Ranks, radius_m: float) -> int:
    """Discs about points (n, 2), as a board."""
    rows, columns = _places(points, ranks.cell_m, ranks.bottom, ranks.left)
    inside = (rows >= 0) & (rows < ranks.shape[0]) & (columns >= 0) & (columns < ranks.shape[1])
    cells = np.zeros((ranks.shape[0], ranks.stride), dtype=np.bool_)
    cells[rows[inside], columns[inside]] = True
    return within(ranks.board(cells), ranks.stride, int(radius_m / ranks.cell_m + 0.5)) & ranks.everywhere


def heard_cells(ranks: Ranks, poses: Floats, heard: Ints) -> int:
    """The circles about the last scans that are free of anything that answers, cell of the ground by cell."""
    height, width = ranks.shape[0] // COARSE, ranks.stride // COARSE
    rows, columns = _places(poses[len(poses) - len(heard) :, :2], ranks.cell_m * COARSE, *_corner(ranks))
    most = int(heard.max(initial=0)) // COARSE
    near = (rows >= -most) & (rows < height + most) & (columns >= -most) & (columns < width + most)
    rows, columns, radii = rows[near], columns[near], heard[near] // COARSE
    cells = np.zeros((height, width), dtype=np.bool_)
    for radius in range(1, most + 1):
        mine = np.flatnonzero(radii == radius)
        if len(mine):
            dr, dc = _disc(radius)
            r, c = rows[mine, None] + dr, columns[mine, None] + dc
            inside = (r >= 0) & (r < height) & (c >= 0) & (c < ranks.shape[1] // COARSE)
            cells[r[inside], c[inside]] = True
    return ranks.board(np.repeat(np.repeat(cells, COARSE, axis=0), COARSE, axis=1))


def _corner(ranks: Ranks) -> tuple[int, int]:
    """The ground's first row and column."""
    return ranks.bottom // COARSE, ranks.left // COARSE


@cache
def _disc(radius: int) -> tuple[Ints, Ints]:
    side = np.arange(-radius, radius + 1)
    rows, columns = np.repeat(side, len(side)), np.tile(side, len(side))
    inside = rows * rows + columns * columns < radius * radius
    return rows[inside], columns[inside]
