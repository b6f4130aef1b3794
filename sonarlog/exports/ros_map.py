"""Maps as ROS map_server reads and writes them: a PGM image and a YAML sheet beside it."""

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slam.geometry import Pose
from slam.grid import Grid
from sonarlog.log import Floats, Surfaces
from sonarlog.map_metrics import surfaces_in_map
from sonarlog.raster import rasterised

FREE, UNKNOWN, OCCUPIED = 254, 205, 0  # as map_server writes and reads them
TRUE_CELLS_M = (0.01, 0.02, 0.05)
MOST_CELLS = 25_000_000
"""A true map has the finest cells of these with which it is no larger."""

Pixels = NDArray[np.uint8]


def write_map(grid: Grid, image: Path, sheet: Path) -> None:
    """The map of a run; the image's top row is the largest y."""
    cells, left, bottom = grid.dense()
    pixels = np.full(cells.shape, UNKNOWN, dtype=np.uint8)
    pixels[grid.free(cells)] = FREE
    pixels[grid.occupied(cells)] = OCCUPIED
    _write(pixels, left * grid.cell_m, bottom * grid.cell_m, grid.cell_m, image, sheet)


def write_true_map(surfaces: Surfaces, stations: Floats, image: Path, sheet: Path) -> None:
    """The true map of a place, in the frame of its surfaces.

    Free is what can be reached from the stations (n, 2) without crossing a surface; the rest is unknown.
    """
    ends = np.concatenate([stations, surfaces.segments.reshape(-1, 2), surfaces.poles[:, :2]])
    area = float(np.prod(np.ptp(ends, axis=0) + 1.0))
    cell_m = next((size for size in TRUE_CELLS_M if area / size**2 <= MOST_CELLS), TRUE_CELLS_M[-1])
    half = 0.5 * cell_m  # round coordinates, as surveyed places have, lie in the middle of their cells
    raster = rasterised(surfaces_in_map(surfaces, Pose(-half, -half, 0.0)), cell_m, stations + half)
    free = raster.reached(stations + half)
    pixels = np.where(raster.walls | raster.poles, OCCUPIED, np.where(free, FREE, UNKNOWN)).astype(np.uint8)
    _write(pixels, raster.left * cell_m - half, raster.bottom * cell_m - half, cell_m, image, sheet)


def _write(pixels: Pixels, left_m: float, bottom_m: float, cell_m: float, image: Path, sheet: Path) -> None:
    height, width = pixels.shape
    image.write_bytes(f"P5\n{width} {height}\n255\n".encode() + pixels[::-1].tobytes())
    sheet.write_text(
        f"image: {_plain(image.name)}\n"
        f"resolution: {cell_m:g}\n"
        f"origin: [{left_m:.3f}, {bottom_m:.3f}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )


def _plain(name: str) -> str:
    """The name as YAML takes it: bare if that is plain text, else quoted."""
    return name if name.replace(".", "").replace("_", "").replace("-", "").isalnum() else json.dumps(name)
