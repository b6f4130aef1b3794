"""Maps as ROS map_server reads and writes them: a PGM image and a YAML sheet beside it."""

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slam.grid import Grid
from sonarlog.log import Floats, Surfaces
from sonarlog.raster import rasterised

FREE, UNKNOWN, OCCUPIED = 254, 205, 0  # as map_server writes and reads them
TRUE_CELL_M = 0.025
"""Half of our maps' cells: a true surface is then known to a centimetre."""

Pixels = NDArray[np.uint8]


def write_map(grid: Grid, image: Path, sheet: Path) -> None:
    """The map of a run; the image's top row is the largest y."""
    cells, left, bottom = grid.dense()
    pixels = np.full(cells.shape, UNKNOWN, dtype=np.uint8)
    pixels[grid.free(cells)] = FREE
    pixels[grid.occupied(cells)] = OCCUPIED
    _write(pixels, left, bottom, grid.cell_m, image, sheet)


def write_true_map(surfaces: Surfaces, stations: Floats, image: Path, sheet: Path) -> None:
    """The true map of a place, in the frame of its surfaces.

    Free is what can be reached from the stations (n, 2) without crossing a surface; the rest is unknown.
    """
    raster = rasterised(surfaces, TRUE_CELL_M, stations)
    free = raster.reached(stations)
    pixels = np.where(raster.walls | raster.poles, OCCUPIED, np.where(free, FREE, UNKNOWN)).astype(np.uint8)
    _write(pixels, raster.left, raster.bottom, TRUE_CELL_M, image, sheet)


def _write(pixels: Pixels, left: int, bottom: int, cell_m: float, image: Path, sheet: Path) -> None:
    height, width = pixels.shape
    image.write_bytes(f"P5\n{width} {height}\n255\n".encode() + pixels[::-1].tobytes())
    sheet.write_text(
        f"image: {_plain(image.name)}\n"
        f"resolution: {cell_m:g}\n"
        f"origin: [{left * cell_m:.3f}, {bottom * cell_m:.3f}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )


def _plain(name: str) -> str:
    """The name as YAML takes it: bare if that is plain text, else quoted."""
    return name if name.replace(".", "").replace("_", "").replace("-", "").isalnum() else json.dumps(name)
