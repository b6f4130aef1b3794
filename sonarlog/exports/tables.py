"""Runs and recordings as tables and JSON for any program.

Must not know: files.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np

from slam import dmath
from sonarlog.log import Floats, Log
from sonarlog.runs import Run
from sonarlog.scores import online_path_of, path_of, raw_path_of

POSES = ("pose", "online", "odometry", "truth")


def pose_lines(run: Run) -> Iterator[str]:
    """CSV, a line a sweep: each of its poses in metres and degrees; the truth in its own frame, empty if unknown."""
    yield ",".join(["sweep", "t_s", *(f"{name}_{column}" for name in POSES for column in ("x_m", "y_m", "theta_deg"))])
    for row in _sweeps(run):
        cells = [cell for name in POSES for cell in _pose_cells(row[name])]
        yield ",".join([str(row["sweep"]), f"{row['t_ns'] / 1e9:.9f}", *cells])


def _pose_cells(pose: list[float] | None) -> list[str]:
    if pose is None:
        return ["", "", ""]
    return [f"{pose[0]:.6f}", f"{pose[1]:.6f}", f"{pose[2] / dmath.DEGREE:.6f}"]


def wall_lines(run: Run) -> Iterator[str]:
    """CSV, a line a wall, metres and degrees in the map frame; a chain's root is its first wall."""
    yield "chain,sweep,root,x0,y0,x1,y1,alpha_deg,rho"
    for number, member in enumerate(run.chains.members):
        wall, root = member.segment, int(number == run.chains.roots[member.chain])
        numbers = (*wall.start, *wall.end, wall.alpha / dmath.DEGREE, wall.rho)
        yield ",".join([str(member.chain), str(member.sweep), str(root), *(f"{value:.4f}" for value in numbers)])


def run_json(run: Run) -> Iterator[str]:
    """A run as one JSON document: what it is, its poses and its walls; metres and radians."""
    walls = [{"chain": member.chain, "sweep": member.sweep, **asdict(member.segment)} for member in run.chains.members]
    data = {
        "schema": "sonarlog.run/1",
        "identity": asdict(run.identity),
        "digest": run.digest,
        "counts": run.counts,
        "sweeps": _sweeps(run),
        "walls": walls,
    }
    yield json.dumps(data, indent=1, allow_nan=False)


def log_json(log: Log) -> Iterator[str]:
    """A recording as one JSON document: robot, and by column odometry and readings in their integers, and the truth."""
    data: dict[str, Any] = {
        "schema": "sonarlog.recording/1",
        "robot": log.robot.as_dict(),
        "counts": log.counts,
        "odometry": {name: column.tolist() for name, column in vars(log.odometry).items()},
        "readings": {name: column.tolist() for name, column in vars(log.readings).items()},
        "truth": log.truth and {"t_ns": log.truth.t_ns.tolist(), "pose": log.truth.pose.tolist()},
        "surfaces": log.surfaces and json.loads(log.surfaces.to_json()),
    }
    yield json.dumps(data, allow_nan=False)


def _sweeps(run: Run) -> list[dict[str, Any]]:
    paths: dict[str, Floats] = {"pose": path_of(run), "online": online_path_of(run), "odometry": raw_path_of(run)}
    rows = []
    for k, sweep in enumerate(run.sweeps):
        poses = {name: np.round(path[k], 9).tolist() for name, path in paths.items()}
        truth = sweep.truth and [sweep.truth.x, sweep.truth.y, sweep.truth.theta]
        rows.append({"sweep": sweep.index, "t_ns": sweep.t_ns, **poses, "truth": truth})
    return rows
