"""A window of the map as block I looks at it: its frontier, where the robot can go, where it can stand, what it sees.

Must not know: what anything is worth, what is chosen.
"""

from dataclasses import dataclass

import numpy as np

from slam.dmath import Floats
from slam.frontier_config import FrontierConfig
from slam.geometry import Bools
from slam.intent import Intent
from slam.planning import Ground
from slam.prospects import Prospects
from slam.regions import Pieces, Ranks, frontier_of, pieces_of
from slam.sweep import Ints
from slam.terrain import fine, ground_of, heard_cells, room_to_stand
from slam.views import lattice, views_of
from slam.window import Window


@dataclass(frozen=True)
class Scene:
    """The window's cells, the pieces of its frontier, the ground, the cells to stand on, and all scans (n, 2) m."""

    ranks: Ranks
    frontier_cells: int
    pieces: Pieces
    ground: Ground
    standing: Bools
    scans: Floats

    def lattice(self, apart_m: float, window: Window) -> tuple[Ints, Ints]:
        """Rows and columns of places to stand in a window, nearly so far apart."""
        rows, columns = lattice(self.ranks, self.standing, apart_m)
        inside = window.holds(columns + self.ranks.left, rows + self.ranks.bottom)
        return rows[inside], columns[inside]

    def prospects(self, rows: Ints, columns: Ints, apart_m: float) -> Prospects:
        """What would be seen from places that keep so far off all scans; those where that is something."""
        pieces = self.pieces
        if not len(pieces.sizes):
            return Prospects.none()
        views = views_of(self.ranks, (rows, columns), (pieces.rows, pieces.columns), self.scans, apart_m)
        dr, dc = views.rows[:, None] - pieces.rows, views.columns[:, None] - pieces.columns
        of = np.argmin(dr * dr + dc * dc, axis=1)
        regions = self.points(pieces.rows[of], pieces.columns[of])
        places = self.points(views.rows, views.columns)
        return Prospects(places, regions, pieces.sizes[of], views.gains, views.square, views.away)

    def points(self, rows: Ints, columns: Ints) -> Floats:
        """The middles (n, 2) of cells, metres."""
        cells = np.stack([columns + self.ranks.left, rows + self.ranks.bottom], axis=1).astype(np.float64)
        return (cells + 0.5) * self.ranks.cell_m


def scene_of(ranks: Ranks, poses: Floats, known: Intent, config: FrontierConfig, *, here: bool) -> Scene:
    """The window as it is known after scans at all poses (n, 3).

    The last of them is `here`, in the window, and the robot goes on from there; else from any of them.
    """
    frontier = frontier_of(ranks)
    pieces = pieces_of(frontier, ranks, config.min_cells, int(config.piece_m / ranks.cell_m + 0.5))
    heard = heard_cells(ranks, poses, known.heard)
    ground = ground_of(ranks, heard, poses, known, config)
    starts, about = _starts(ground, poses), 0
    if here:
        start = ground.cell(float(poses[-1, 0]), float(poses[-1, 1]))
        starts, about = np.array([start[0] * ground.stride + start[1]]), ground.about(start)
    reached = fine(ground.reached(starts, about), ground)
    standing = reached & room_to_stand(ranks, heard, config)
    return Scene(ranks, frontier.bit_count(), pieces, ground, standing, poses[:, :2])


def _starts(ground: Ground, poses: Floats) -> Ints:
    """The places on the ground where the robot has scanned."""
    rows, columns = ground.cells_at(poses)
    return np.asarray((rows * ground.stride + columns)[ground.holds(poses)])
