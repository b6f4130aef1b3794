"""The map as ROS 2 messages: the whole now and then, and in between the rectangle that a sweep changed.

Must not know: files, what a sweep is.
"""

from collections.abc import Iterator

import numpy as np

from slam import dmath
from slam.grid import LIMIT, TILE, Cells, Grid
from sonarlog import ros2
from sonarlog.ros2_maps import OccupancyGridUpdate

Box = tuple[int, int, int, int]
"""Left, bottom, width, height in cells."""

# Percent of being occupied for log-odds × 10 of −LIMIT..LIMIT; 0 is unknown.
_PERCENT = np.rint(100.0 / (1.0 + dmath.exp(-np.arange(-LIMIT, LIMIT + 1) / 10.0))).astype(np.int8)
_PERCENT[LIMIT] = -1


class MapMessages:
    """Follows a grid as it grows: the whole as soon as the updates since the last one hold as many cells as it."""

    def __init__(self) -> None:
        self._tiles: dict[tuple[int, int], Cells] = {}
        self._frame: Box = (0, 0, 0, 0)  # of the last whole
        self._since = 0

    def after(self, grid: Grid, header: ros2.Header) -> Iterator[tuple[str, object]]:
        """Topic and message for what is new in the grid, if anything is.

        A grid shares the tiles that it did not touch with the grid before, so a tile is known by being the same object.
        """
        tiles = dict(grid.tiles)
        changed = [place for place, tile in tiles.items() if self._tiles.get(place) is not tile]
        changed += [place for place in self._tiles if place not in tiles]
        self._tiles = tiles
        if not changed:
            return
        box = _around(changed)
        self._since += box[2] * box[3]
        if not _holds(self._frame, box) or self._since >= self._frame[2] * self._frame[3]:
            self._frame, self._since = _widened(self._frame, grid.bounds()), 0
            yield "/map", _whole(grid, self._frame, header)
        else:
            left, bottom, width, height = box
            corner = left - self._frame[0], bottom - self._frame[1]
            yield "/map_updates", OccupancyGridUpdate(header, *corner, width, height, _percent(grid, box))

    def whole(self, grid: Grid, header: ros2.Header) -> ros2.OccupancyGrid:
        """All of the grid and no more."""
        return _whole(grid, grid.bounds(), header)


def _around(places: list[tuple[int, int]]) -> Box:
    columns, rows = [i for i, _ in places], [j for _, j in places]
    width, height = max(columns) + 1 - min(columns), max(rows) + 1 - min(rows)
    return min(columns) * TILE, min(rows) * TILE, width * TILE, height * TILE


def _holds(frame: Box, box: Box) -> bool:
    return all(
        frame[axis] <= box[axis] and box[axis] + box[axis + 2] <= frame[axis] + frame[axis + 2] for axis in (0, 1)
    )


def _widened(before: Box, bounds: Box) -> Box:
    """The bounds, with a quarter of their size to spare on each side on which they outgrew the frame before."""
    if not before[2]:
        return bounds
    low, high = [], []
    for axis in (0, 1):
        begin, end = bounds[axis], bounds[axis] + bounds[axis + 2]
        first, last = before[axis], before[axis] + before[axis + 2]
        spare = TILE * -(-(end - begin) // (4 * TILE))
        low.append(begin - spare if begin < first else first)
        high.append(end + spare if end > last else last)
    return low[0], low[1], high[0] - low[0], high[1] - low[1]


def _percent(grid: Grid, box: Box) -> bytes:
    return _PERCENT[grid.window(*box) + LIMIT].tobytes()


def _whole(grid: Grid, box: Box, header: ros2.Header) -> ros2.OccupancyGrid:
    left, bottom, width, height = box
    corner = ros2.Pose(ros2.Point(left * grid.cell_m, bottom * grid.cell_m))
    info = ros2.MapMetaData(header.stamp, grid.cell_m, width, height, corner)
    return ros2.OccupancyGrid(header, info, _percent(grid, box))
