"""The picture of a difference: before, after and what changed, at one scale.

Must not know: how differences are found.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from slam.geometry import ORIGIN, Pose
from sonarlog.diff import Report
from sonarlog.log import Surfaces
from sonarlog.picture import draw_maps
from sonarlog.scores import panel


def draw_difference(report: Report, path: Path | str, *, force: bool = False) -> tuple[int, int]:
    """Write A, B laid on A, and the difference, side by side or one above the other, as a PNG.

    Returns its size in pixels. Raises CannotDraw.
    """
    alignment = report.alignment
    a = panel(report.a.run, f"A  {report.names[0]}")
    b = panel(report.b.run, f"B  {report.names[1]}")
    b = replace(b, lay=alignment.pose, surfaces=_laid(b.surfaces, alignment.pose))
    laid = f", B laid on A: it is {alignment.words}" if alignment.words else ""
    changed = 100 * report.aligned_cells.changed
    difference = replace(
        b, title=f"Difference: {changed:.1f} % of the known cells{laid}", before=a, odometry=np.zeros((0, 2)),
        surfaces=None,
    )  # fmt: skip
    return draw_maps([a, b, difference], path, force=force)


def _laid(surfaces: Surfaces | None, pose: Pose) -> Surfaces | None:
    """True surfaces as B's map has them, laid where B's map is."""
    if surfaces is None or pose == ORIGIN:
        return surfaces
    segments = pose.points(surfaces.segments.reshape(-1, 2)).reshape(-1, 4)
    poles = np.column_stack([pose.points(surfaces.poles[:, :2]), surfaces.poles[:, 2]])
    return Surfaces(surfaces.world, segments, poles)
