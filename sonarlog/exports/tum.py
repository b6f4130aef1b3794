"""Trajectories as TUM lines: `t x y z qx qy qz qw`, seconds and metres, as evo reads them.

Must not know: files.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np

from slam import dmath
from sonarlog.exports.files import NotExported
from sonarlog.log import Floats, Ints, Log
from sonarlog.runs import Run
from sonarlog.scores import online_path_of, path_of, raw_path_of
from sonarlog.truth import odometry_at

WhichPath = Literal["final", "online", "odometry", "truth"]
PATHS: tuple[WhichPath, ...] = ("final", "online", "odometry", "truth")


def run_tum(run: Run, which: WhichPath) -> Iterator[str]:
    """A run's path, a line a sweep. Raises NotExported if it is the truth and not known at every sweep."""
    if which == "truth":
        if run.truth is None:
            raise NotExported(f"{run.path} does not know the truth at every sweep")
        return tum_lines(run.truth.t_ns, run.truth.pose)
    poses = {"final": path_of, "online": online_path_of, "odometry": raw_path_of}[which](run)
    return tum_lines(np.array([sweep.t_ns for sweep in run.sweeps], dtype=np.int64), poses)


def log_tum(path: Path, log: Log, which: WhichPath) -> Iterator[str]:
    """A recording's odometry or truth, a line a pose. Raises NotExported for what it does not hold."""
    if which == "odometry":
        if len(log.odometry.t_ns) == 0:
            raise NotExported(f"{path} holds no odometry")
        return tum_lines(log.odometry.t_ns, odometry_at(log.odometry, log.odometry.t_ns))
    if which != "truth":
        raise NotExported(f"{path} is a recording, which has no {which} path: replay it and export the run")
    if log.truth is None:
        raise NotExported(f"{path} holds no /truth")
    return tum_lines(log.truth.t_ns, log.truth.pose)


def tum_lines(t_ns: Ints, poses: Floats) -> Iterator[str]:
    """One line a pose of (n, 3), in the plane."""
    for t, (x, y, theta) in zip(t_ns.tolist(), poses.tolist(), strict=True):
        sine, cosine = dmath.sincos(0.5 * theta)
        seconds, rest = divmod(t, 1_000_000_000)
        yield f"{seconds}.{rest:09d} {x:.6f} {y:.6f} 0 0 0 {sine:.9f} {cosine:.9f}"
