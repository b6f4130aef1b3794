"""Whether two runs can be held against one another at all. Must not know: what differs."""

import numpy as np

from sonarlog.errors import SonarlogError
from sonarlog.runs import Run

ALONG_M, ALONG_RAD = 0.25, np.radians(15.0)
"""Two recordings are of one drive if odometry has most of their sweeps nearer together than this."""


class NotComparable(SonarlogError):
    """Two runs that cannot be held against one another."""


def check_comparable(a: Run, b: Run) -> None:
    """Raises NotComparable for recordings of different drives, and for cells of different sizes."""
    if a.identity.recording_digest != b.identity.recording_digest and not _one_drive(a, b):
        raise NotComparable(
            f"{a.path} and {b.path} are runs of different recordings, and not of one drive: "
            "only what one robot saw on one way can be compared"
        )
    if a.grid.cell_m != b.grid.cell_m:
        sizes = f"{100 * a.grid.cell_m:g} cm and {100 * b.grid.cell_m:g} cm"
        raise NotComparable(f"{a.path} and {b.path} have cells of {sizes}: replay both with the same map.cell_m")


def _one_drive(a: Run, b: Run) -> bool:
    """Whether odometry has most sweeps of both at the same places, as it has if one recording is the other's edit."""
    pairs = list(zip(a.sweeps, b.sweeps, strict=False))
    steps = [
        (a.sweeps[0].odometry.step_to(mine.odometry), b.sweeps[0].odometry.step_to(yours.odometry))
        for mine, yours in pairs
    ]
    near = [
        np.hypot(mine.x - yours.x, mine.y - yours.y) <= ALONG_M
        and abs(np.angle(np.exp(1j * (mine.theta - yours.theta)))) <= ALONG_RAD
        for mine, yours in steps
    ]
    return 2 * sum(map(bool, near)) > max(len(a.sweeps), len(b.sweeps))
