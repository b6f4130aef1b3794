"""A run as plain files for other tools: a ROS map, a TUM trajectory, the walls as CSV."""

import csv
from contextlib import suppress
from pathlib import Path

import numpy as np

from slam import dmath
from slam.grid import Grid
from sonarlog.errors import SonarlogError
from sonarlog.runs import Run

FREE, UNKNOWN, OCCUPIED = 254, 205, 0  # as map_server writes and reads them

NAMES = ("map.pgm", "map.yaml", "trajectory.tum", "walls.csv")


class CannotExport(SonarlogError):
    """The folder cannot be made, or holds an export already."""


def export(run: Run, folder: Path, *, force: bool = False) -> list[Path]:
    """Write map.pgm, map.yaml, trajectory.tum and walls.csv; return their paths. Raises CannotExport."""
    check_free(folder, force=force)
    paths = [folder / name for name in NAMES]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_map(run.grid, paths[0], paths[1])
        write_trajectory(run, paths[2])
        write_walls(run, paths[3])
    except OSError as error:
        for path in paths:
            with suppress(OSError):
                path.unlink()
        raise CannotExport(f"cannot write to {folder}: {error.strerror or error}") from None
    return paths


def check_free(folder: Path, *, force: bool) -> None:
    """Raise CannotExport if an export there would overwrite something and `force` is not given."""
    taken = [folder / name for name in NAMES if (folder / name).exists()]
    if taken and not force:
        raise CannotExport(f"{taken[0]} exists and is not overwritten: choose another folder, or give --force")


def write_map(grid: Grid, image: Path, sheet: Path) -> None:
    """The map as map_server takes it; the image's top row is the largest y."""
    cells, left, bottom = grid.dense()
    pixels = np.full(cells.shape, UNKNOWN, dtype=np.uint8)
    pixels[grid.free(cells)] = FREE
    pixels[grid.occupied(cells)] = OCCUPIED
    height, width = cells.shape
    image.write_bytes(f"P5\n{width} {height}\n255\n".encode() + pixels[::-1].tobytes())
    sheet.write_text(
        f"image: {image.name}\n"
        f"resolution: {grid.cell_m:g}\n"
        f"origin: [{left * grid.cell_m:.3f}, {bottom * grid.cell_m:.3f}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )


def write_trajectory(run: Run, path: Path) -> None:
    """One line a sweep: t x y z qx qy qz qw, seconds and metres, as evo reads it."""
    lines = []
    for sweep in run.sweeps:
        sine, cosine = dmath.sincos(0.5 * sweep.pose.theta)
        seconds, rest = divmod(sweep.t_ns, 1_000_000_000)
        pose = f"{sweep.pose.x:.6f} {sweep.pose.y:.6f} 0 0 0 {sine:.9f} {cosine:.9f}"
        lines.append(f"{seconds}.{rest:09d} {pose}\n")
    path.write_text("".join(lines), encoding="utf-8")


def write_walls(run: Run, path: Path) -> None:
    """One line a wall, metres and degrees in the map frame; a chain's root is its first wall."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow(["chain", "sweep", "root", "x0", "y0", "x1", "y1", "alpha_deg", "rho"])
        for number, member in enumerate(run.chains.members):
            wall, root = member.segment, int(number == run.chains.roots[member.chain])
            numbers = (*wall.start, *wall.end, wall.alpha / dmath.DEGREE, wall.rho)
            rows.writerow([member.chain, member.sweep, root, *(f"{value:.4f}" for value in numbers)])
