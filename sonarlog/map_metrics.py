"""How true an occupancy map is: are its walls where walls are, are the walls in it, is its free space free.

Must not know: files, algorithms, pictures, how the map was made.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from slam.geometry import ORIGIN, Bools, Pose
from slam.grid import Grid
from sonarlog.log import Floats, Surfaces
from sonarlog.raster import rasterised

NEAR_M = 0.10
SEEN_M = 3.0
"""A surface nearer than this to a station, with nothing between, ought to be in the map."""
STEP_M = 0.05
"""Surfaces are judged point by point, so far apart."""


@dataclass(frozen=True)
class MapQuality:
    """Shares between 0 and 1; None where there was nothing to judge.

    `occupied_true`: occupied cells within 10 cm of a true surface. `surface_mapped`: length of true surface in sight
    of a station with an occupied cell within 10 cm. `free_true`: free cells that can be reached in truth; cells that
    a surface passes through are not counted.
    """

    occupied_true: float | None
    surface_mapped: float | None
    free_true: float | None


class TruePlace(Protocol):
    """Where surfaces truly are: a map is held against it point by point, in its own frame, metres."""

    def distance(self, points: Floats) -> Floats:
        """Distance of each point (n, 2) from the nearest surface."""

    def in_sight(self, stations: Floats) -> Floats:
        """Points (k, 2), evenly along the surfaces, that some station (n, 2) sees within 3 m."""

    def is_free(self, points: Floats, stations: Floats, cell_m: float) -> Bools:
        """For each point (n, 2) but those in a surface itself: is it free? `cell_m` is the judged map's."""


@dataclass(frozen=True)
class SurveyedPlace:
    """A place known by its surfaces: free is what can be reached from the stations without crossing one."""

    surfaces: Surfaces

    def distance(self, points: Floats) -> Floats:
        """See `TruePlace`."""
        return distance_to_surfaces(points, self.surfaces)

    def in_sight(self, stations: Floats) -> Floats:
        """See `TruePlace`."""
        return _in_sight(_along(self.surfaces), self.surfaces, stations)

    def is_free(self, points: Floats, stations: Floats, cell_m: float) -> Bools:
        """See `TruePlace`."""
        return _reachable(points, self.surfaces, stations, cell_m)


def map_quality(grid: Grid, truth: Surfaces | TruePlace, frame: Pose, stations: Floats) -> MapQuality:
    """Hold a map against the truth.

    `frame` is the map's origin in the frame of the truth, `stations` (n, 2) m are the true places of its sweeps.
    """
    return map_qualities(grid, truth, [frame], stations)[0]


def map_qualities(
    grid: Grid, truth: Surfaces | TruePlace, frames: Sequence[Pose], stations: Floats
) -> list[MapQuality]:
    """The same with the map's origin here, then there; what is in sight is the same of all."""
    place = SurveyedPlace(truth) if isinstance(truth, Surfaces) else truth
    in_sight = place.in_sight(stations)
    cells, left, bottom = grid.dense()
    occupied = _centres(grid.occupied(cells), left, bottom, grid.cell_m)
    free = _centres(grid.free(cells), left, bottom, grid.cell_m)
    return [
        MapQuality(
            occupied_true=_share(place.distance(frame.points(occupied)) <= NEAR_M),
            surface_mapped=_share(_has_neighbour(in_sight, frame.points(occupied))),
            free_true=_share(place.is_free(frame.points(free), stations, grid.cell_m)),
        )
        for frame in frames
    ]


def distance_to_surfaces(points: Floats, surfaces: Surfaces) -> Floats:
    """Distance of each point (n, 2) from the nearest surface, in metres; without surfaces infinite."""
    nearest = np.full(len(points), np.inf)
    for x0, y0, x1, y1 in surfaces.segments.tolist():
        dx, dy = x1 - x0, y1 - y0
        part = np.clip(((points[:, 0] - x0) * dx + (points[:, 1] - y0) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(points[:, 0] - x0 - part * dx, points[:, 1] - y0 - part * dy))
    for x, y, radius in surfaces.poles.tolist():
        nearest = np.minimum(nearest, np.abs(np.hypot(points[:, 0] - x, points[:, 1] - y) - radius))
    return nearest


def surfaces_in_map(surfaces: Surfaces, frame: Pose) -> Surfaces:
    """The true surfaces as they lie in a map whose origin is at `frame` among them."""
    back = frame.step_to(ORIGIN)
    poles = surfaces.poles.copy()
    poles[:, :2] = back.points(poles[:, :2])
    segments = back.points(surfaces.segments.reshape(-1, 2)).reshape(-1, 4)
    return Surfaces(surfaces.world, segments, poles)


def _centres(mask: Bools, left: int, bottom: int, cell_m: float) -> Floats:
    """Centres (n, 2) m of the marked cells."""
    rows, columns = np.nonzero(mask)
    return np.column_stack([columns + left + 0.5, rows + bottom + 0.5]) * cell_m


def _along(surfaces: Surfaces) -> Floats:
    """Points (n, 2) every few centimetres of surface."""
    pieces = [np.zeros((0, 2))]
    for x0, y0, x1, y1 in surfaces.segments.tolist():
        count = max(1, round(float(np.hypot(x1 - x0, y1 - y0)) / STEP_M))
        part = (np.arange(count) + 0.5) / count
        pieces.append(np.column_stack([x0 + part * (x1 - x0), y0 + part * (y1 - y0)]))
    for x, y, radius in surfaces.poles.tolist():
        count = max(4, round(2.0 * np.pi * radius / STEP_M))
        angle = 2.0 * np.pi * np.arange(count) / count
        pieces.append(np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)]))
    return np.concatenate(pieces)


def _in_sight(points: Floats, surfaces: Surfaces, stations: Floats) -> Floats:
    """Those points that some station sees: near enough, and no wall between."""
    seen = np.zeros(len(points), dtype=bool)
    for station in stations:
        near = np.flatnonzero(~seen & (np.hypot(*(points - station).T) <= SEEN_M))
        clear = np.ones(len(near), dtype=bool)
        for wall in _near(surfaces.segments, station):
            clear &= ~_crossed(station, points[near], wall)
        seen[near[clear]] = True
    return points[seen]


def _near(walls: Floats, station: Floats) -> Floats:
    """Those walls (k, 4) that may stand in the way within sight of a station: their box comes as near as that."""
    low = np.minimum(walls[:, :2], walls[:, 2:]) - SEEN_M
    high = np.maximum(walls[:, :2], walls[:, 2:]) + SEEN_M
    return np.asarray(walls[((low <= station) & (station <= high)).all(axis=1)])


def _crossed(station: Floats, points: Floats, wall: Floats) -> Bools:
    """Whether the way from the station to each point (n, 2) goes through the wall (4,) before it arrives."""
    way, along = points - station, wall[2:] - wall[:2]
    to_wall = wall[:2] - station
    across = way[:, 0] * along[1] - way[:, 1] * along[0]
    safe = np.where(across == 0.0, 1.0, across)
    part = (to_wall[0] * along[1] - to_wall[1] * along[0]) / safe
    place = (to_wall[0] * way[:, 1] - to_wall[1] * way[:, 0]) / safe
    return np.asarray((across != 0.0) & (part > 0.0) & (part < 1.0 - 1e-6) & (place >= 0.0) & (place <= 1.0))


def _has_neighbour(points: Floats, others: Floats) -> Bools:
    """Whether one of the others lies within 10 cm of each point."""
    if len(points) == 0 or len(others) == 0:
        return np.zeros(len(points), dtype=bool)
    from scipy.spatial import cKDTree  # takes longer to load than most judgements

    return np.asarray(cKDTree(others).query(points)[0] <= NEAR_M)


def _reachable(points: Floats, surfaces: Surfaces, stations: Floats, cell_m: float) -> Bools:
    """For each point that no surface passes through: can it be reached from the stations without crossing one?"""
    if len(points) == 0:
        return np.zeros(0, dtype=bool)
    raster = rasterised(surfaces, cell_m, np.concatenate([points, stations]))
    at = raster.cells(points)
    return np.asarray(raster.reached(stations)[at][~raster.walls[at]])


def _share(good: Bools) -> float | None:
    return float(np.mean(good)) if len(good) else None
