"""Runs of a short synthetic corridor, made by the real pipeline and written by the real writer."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from slam import pipeline
from slam.algorithms import algorithm
from slam.geometry import Pose
from slam.sweep import Sweep
from sonarlog.digest import RunDigest
from sonarlog.log import Surfaces
from sonarlog.runs import Run, RunWriter, identify, read_run
from sonarlog.times import BlockTimes
from tests.synthetic import RING, corridor, scan

STATIONS = 5
TRUE = [Pose(0.8 * k, 0.0, 0.0) for k in range(STATIONS)]
AT_ONCE: Mapping[str, object] = MappingProxyType({"localisation.refuted": 0.0})
"""So few sweeps do not refute odometry: `paper` and `graph` would leave it as it is."""
SURFACES = Surfaces("synthetic", np.array([(w.x0, w.y0, w.x1, w.y1) for w in corridor(length=6.0)]), np.zeros((0, 3)))


def drifting(turn_at_2_deg: float = 3.0) -> list[Sweep]:
    """The corridor with a false turn of the odometry between the second and the third station."""
    walls = corridor(length=6.0)
    odometry: list[Pose] = []
    for k, pose in enumerate(TRUE):
        odometry.append(pose if k == 0 else odometry[-1].compose(TRUE[k - 1].step_to(pose)))
        if k == 2:
            odometry[-1] = replace(odometry[-1], theta=odometry[-1].theta + np.radians(turn_at_2_deg))
    made = [scan(walls, true, raw) for true, raw in zip(TRUE, odometry, strict=True)]
    return [replace(sweep, t_ns=sweep.t_ns + 40_000_000_000 * k) for k, sweep in enumerate(made)]


def made_run(
    path: Path,
    name: str = "paper",
    sweeps: Iterable[Sweep] = (),
    changes: Mapping[str, object] = MappingProxyType({}),
    *,
    recording: str = "one recording",
    truth: bool = True,
    stations: Sequence[Pose] = TRUE,
    times: BlockTimes | None = None,
) -> Run:
    """A run of these sweeps, seen from these stations, with some settings changed."""
    chosen = algorithm(name).configured({**AT_ONCE, **changes})
    identity = identify(recording, chosen)
    result = RunDigest(identity.asked())
    with RunWriter(path, identity) as writer:
        for step, true in zip(pipeline.run(sweeps, RING, chosen), stations, strict=False):
            writer.add(step, result.add(step), result, true if truth else None)
        writer.finish(result, step.state, {}, SURFACES if truth else None, times)
    return read_run(path)
