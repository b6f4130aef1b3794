"""How far two paths are apart, sweep by sweep. Must not know: runs, maps."""

from dataclasses import dataclass

import numpy as np

from slam.geometry import ORIGIN, Pose
from sonarlog.log import Floats
from sonarlog.metrics import placed


@dataclass(frozen=True)
class PathChanges:
    """How far the two paths are apart over the sweeps that both have; `sweep` is where they are furthest apart.

    `place` is where A has that sweep, in metres. The `aligned` ones are what is left once B's map is laid on A's.
    """

    largest_m: float
    mean_m: float
    largest_heading_deg: float
    sweep: int
    place: tuple[float, float]
    aligned_largest_m: float
    aligned_mean_m: float
    aligned_heading_deg: float


def path_changes(a: Floats, b: Floats, pose: Pose = ORIGIN) -> PathChanges:
    """Hold paths (n, 3), (m, 3) of x m, y m, θ rad against one another; `pose` lays B's map on A's."""
    count = min(len(a), len(b))
    if count == 0:
        return PathChanges(0.0, 0.0, 0.0, 0, (0.0, 0.0), 0.0, 0.0, 0.0)
    mine, yours = a[:count], b[:count]
    off, turned = apart(mine, yours)
    left, left_turned = (off, turned) if pose == ORIGIN else apart(mine, placed(yours, pose))
    at = int(np.argmax(off))
    return PathChanges(
        largest_m=float(off[at]),
        mean_m=float(off.mean()),
        largest_heading_deg=float(np.degrees(turned.max())),
        sweep=at,
        place=(float(mine[at, 0]), float(mine[at, 1])),
        aligned_largest_m=float(left.max()),
        aligned_mean_m=float(left.mean()),
        aligned_heading_deg=float(np.degrees(left_turned.max())),
    )


def apart(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Distance in metres and turn in radians between the poses (n, 3) of two paths, both without sign."""
    off = np.hypot(a[:, 0] - b[:, 0], a[:, 1] - b[:, 1])
    return off, np.abs(np.angle(np.exp(1j * (a[:, 2] - b[:, 2]))))
