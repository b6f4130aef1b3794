"""A true map in the form of ROS map_server: its occupied cells are the true surfaces, its free cells are truly free.

Must not know: runs, metrics, printing.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from PIL import Image, UnidentifiedImageError
from scipy import ndimage
from scipy.spatial import cKDTree

from slam.geometry import ORIGIN, Bools, Pose
from sonarlog.errors import SonarlogError
from sonarlog.log import Floats, Ints

SEEN_M = 3.0
GRAZING_CELLS = 6.0
"""A ray that grazes a wall runs in its cells for a while before it arrives; at 5° so long."""
SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0))
LARGEST_PIXELS = 100_000_000


class BadTrueMap(SonarlogError):
    """A sheet or an image that map_server would not load."""


@dataclass(frozen=True)
class TrueMap:
    """Cells (h, w), row = y upwards, of `cell_m`; `origin` is the lower left corner in the truth's frame.

    A cell that is neither occupied nor free is unknown.
    """

    cell_m: float
    origin: Pose
    occupied: Bools
    free: Bools

    def distance(self, points: Floats) -> Floats:
        """Distance of each point (n, 2) from the middle of the nearest occupied cell, in metres."""
        if len(points) == 0 or len(self._surface) == 0:
            return np.full(len(points), np.inf)
        return np.asarray(self._tree.query(points)[0], dtype=np.float64)

    def in_sight(self, stations: Floats) -> Floats:
        """The middles (n, 2) of occupied cells within 3 m of a station (k, 2), nothing occupied between."""
        seen = np.zeros(len(self._surface), dtype=bool)
        for station in stations:
            near = np.flatnonzero(~seen & (np.hypot(*(self._surface - station).T) <= SEEN_M))
            seen[near[self._clear(station, near)]] = True
        return self._surface[seen]

    def is_free(self, points: Floats, stations: Floats, cell_m: float) -> Bools:
        """For each point (n, 2) that can be judged: is it free in truth?

        Not judged is what lies outside the image and in a surface's own cells; unknown, and the inside of what is
        solid, is not free. Stations and the judged map's cells do not matter.
        """
        row, column, inside = self._cell(points)
        row, column = row[inside], column[inside]
        judged = ~self._skin[row, column]
        return np.asarray(self.free[row, column][judged])

    def _clear(self, station: Floats, chosen: Ints) -> Bools:
        """Whether the way to each of the surface's cells meets nothing, and meets the wall on the side that is seen."""
        goals = self._surface[chosen]
        way = goals - station
        steps = int(2.0 * SEEN_M / self.cell_m) + 1
        part = (np.arange(steps) + 0.5) / steps
        row, column, inside = self._cell((station + part[:, None, None] * way).reshape(-1, 2))
        shut = np.zeros(len(row), dtype=bool)
        shut[inside] = self.occupied[row[inside], column[inside]]
        blocked = shut.reshape(steps, len(goals))
        opened_again = (blocked[:-1] & ~blocked[1:]).any(axis=0)
        inside_m = blocked.mean(axis=0) * np.hypot(way[:, 0], way[:, 1])
        facing = (self._open_side[chosen] & (way @ self._normals.T < 0.0)).any(axis=1)
        return np.asarray(facing & ~opened_again & (inside_m <= GRAZING_CELLS * self.cell_m))

    def _cell(self, points: Floats) -> tuple[Any, Any, Bools]:
        """Row and column under each point (n, 2), and whether it is inside the image."""
        at = np.floor(self.origin.step_to(ORIGIN).points(points) / self.cell_m).astype(np.int64)
        height, width = self.occupied.shape
        inside = (at[:, 0] >= 0) & (at[:, 0] < width) & (at[:, 1] >= 0) & (at[:, 1] < height)
        return at[:, 1], at[:, 0], inside

    @cached_property
    def _skin(self) -> Bools:
        """Occupied cells with one beside them that is not: where the surface itself runs."""
        inner = ndimage.binary_erosion(self.occupied, structure=np.ones((3, 3), dtype=bool), border_value=1)
        return np.asarray(self.occupied & ~inner)

    @cached_property
    def _open_side(self) -> Bools:
        """For each cell of the surface, on which of its four sides (n, 4) nothing is."""
        row, column = np.nonzero(self._skin)
        padded = np.pad(self.occupied, 1, constant_values=True)
        return np.column_stack([~padded[row + 1 + dy, column + 1 + dx] for dy, dx in SIDES])

    @cached_property
    def _normals(self) -> Floats:
        """The four sides' directions (4, 2) in the truth's frame."""
        return Pose(0.0, 0.0, self.origin.theta).points(np.array([(dx, dy) for dy, dx in SIDES], dtype=np.float64))

    @cached_property
    def _surface(self) -> Floats:
        row, column = np.nonzero(self._skin)
        return self.origin.points(np.column_stack([column + 0.5, row + 0.5]) * self.cell_m)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._surface)


def read_true_map(sheet: Path) -> TrueMap:
    """The map that a YAML sheet of map_server describes, with its image. Raises BadTrueMap."""
    data = _sheet(sheet)
    cell_m, origin = _number(sheet, data, "resolution"), _origin(sheet, data)
    if cell_m <= 0:
        raise BadTrueMap(f"{sheet}: resolution: {cell_m:g} is no size of a cell in metres")
    dark = 1.0 - _pixels(sheet, data) / 255.0
    if _number(sheet, data, "negate", 0.0):
        dark = 1.0 - dark
    occupied = dark > _number(sheet, data, "occupied_thresh", 0.65)
    free = dark < _number(sheet, data, "free_thresh", 0.196)
    if not occupied.any():
        raise BadTrueMap(f"{sheet}: no cell of its image is occupied, so there is no surface to hold a map against")
    return TrueMap(cell_m, origin, np.asarray(occupied), np.asarray(free & ~occupied))


def _sheet(path: Path) -> dict[str, Any]:
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise BadTrueMap(f"cannot read {path}: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError):
        raise BadTrueMap(f"{path} is no YAML: name the sheet that goes with the map's image") from None
    if not isinstance(data, dict) or not isinstance(data.get("image"), str):
        raise BadTrueMap(f"{path} names no image: a sheet of map_server has lines `image: FILE` and `resolution: M`")
    return data


def _number(path: Path, data: dict[str, Any], key: str, default: float | None = None) -> float:
    value = data.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise BadTrueMap(f"{path}: {key}: a number is needed, not {value!r}")
    return float(value)


def _origin(path: Path, data: dict[str, Any]) -> Pose:
    value = data.get("origin", [0.0, 0.0, 0.0])
    if not isinstance(value, list) or len(value) != 3 or not all(isinstance(v, int | float) for v in value):
        raise BadTrueMap(f"{path}: origin: [x, y, yaw] is needed, not {value!r}")
    return Pose(float(value[0]), float(value[1]), float(value[2]))


def _pixels(path: Path, data: dict[str, Any]) -> Floats:
    """Grey levels (h, w), the lowest row first."""
    image = path.parent / data["image"]
    try:
        with Image.open(image) as opened:
            if opened.width * opened.height > LARGEST_PIXELS:
                raise BadTrueMap(f"{image} has {opened.width} × {opened.height} pixels: that is no map of a robot's")
            return np.asarray(opened.convert("L"), dtype=np.float64)[::-1]
    except UnidentifiedImageError:
        raise BadTrueMap(f"{image}, which {path} names, is no image") from None
    except (OSError, Image.DecompressionBombError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise BadTrueMap(f"cannot read the image {image}, which {path} names: {why}") from None
