"""A run as plain files in a folder: map, trajectory, walls.

Must not know: command lines, printing.
"""

from pathlib import Path

from sonarlog.exports.files import check_free, write_lines, writing
from sonarlog.exports.ros_map import write_map
from sonarlog.exports.tables import wall_lines
from sonarlog.exports.tum import run_tum
from sonarlog.runs import Run

NAMES = ("map.pgm", "map.yaml", "trajectory.tum", "walls.csv")


def check_folder_free(folder: Path, *, force: bool) -> None:
    """Raise CannotExport if an export there would overwrite something and `force` is not given."""
    check_free([folder / name for name in NAMES], force=force)


def export_folder(run: Run, folder: Path, *, force: bool = False) -> list[Path]:
    """Write map.pgm, map.yaml, trajectory.tum and walls.csv; return their paths. Raises CannotExport."""
    check_folder_free(folder, force=force)
    image, sheet, trajectory, walls = paths = [folder / name for name in NAMES]
    with writing(paths):
        folder.mkdir(parents=True, exist_ok=True)
        write_map(run.grid, image, sheet)
        write_lines(run_tum(run, "final"), trajectory)
        write_lines(wall_lines(run), walls)
    return paths
