"""A run held against the truth: its path, its map and its walls, and the picture of it.

Must not know: how runs are made, or compared with one another.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from slam.geometry import ORIGIN, Pose
from sonarlog.log import Floats
from sonarlog.map_metrics import MapQuality, map_qualities, surfaces_in_map
from sonarlog.metrics import (
    MappedWall,
    PathErrors,
    best_frame,
    chain_straightness,
    frame_between,
    path_errors,
    placed,
    pose_rows,
    straightness,
)
from sonarlog.picture import Panel, draw_maps
from sonarlog.runs import Run


@dataclass(frozen=True)
class Scores:
    """Errors of a run's path and of raw odometry, and what is known of its map (None without true surfaces).

    `map` is laid on the truth at the first pose, `map_aligned` as path and truth lie best on one another.
    """

    path: PathErrors
    odometry: PathErrors
    map: MapQuality | None
    map_aligned: MapQuality | None


def score(run: Run) -> Scores | None:
    """The run's scores; None where the truth is not known at every sweep."""
    if run.truth is None or not run.sweeps:
        return None
    truth = run.truth.pose
    mine, raw = (path_errors(path, truth) for path in (path_of(run), raw_path_of(run)))
    if run.surfaces is None:
        return Scores(mine, raw, None, None)
    frames = [_frame(run), best_frame(path_of(run), truth)]
    return Scores(mine, raw, *map_qualities(run.grid, run.surfaces, frames, truth[:, :2]))


def wall_straightness(run: Run, min_length_m: float = 5.0) -> list[MappedWall]:
    """How straight the long walls came out [Fig. 12]: the true ones if they are known, else the chains."""
    if run.truth is None or run.surfaces is None:
        return chain_straightness(run.chains, min_length_m)
    return straightness(run.chains, path_of(run), run.truth.pose, run.surfaces.segments, min_length_m)


def path_of(run: Run) -> Floats:
    """The run's poses (n, 3) as they were known at its end: x m, y m, θ rad in the map."""
    return pose_rows(run.poses)


def online_path_of(run: Run) -> Floats:
    """The run's poses (n, 3) as each was found at its own sweep, before later ones moved it."""
    return pose_rows(sweep.pose for sweep in run.sweeps)


def raw_path_of(run: Run) -> Floats:
    """Raw odometry at the sweeps (n, 3), laid on the map at the first one."""
    if not run.sweeps:
        return np.zeros((0, 3))
    start = Pose(*path_of(run)[0].tolist())
    return placed(pose_rows(sweep.odometry for sweep in run.sweeps), frame_between(run.sweeps[0].odometry, start))


def panel(run: Run, title: str = "", *, walls: bool = False) -> Panel:
    """The run's map as a panel of a picture; `walls` draws the pieces of wall, each chain in its colour."""
    scores = score(run)
    error = f": {scores.path.ate_m:.2f} m RMS off the true path" if scores else ""
    return Panel(
        title=(title or run.identity.algorithm) + error,
        grid=run.grid,
        path=path_of(run)[:, :2],
        odometry=raw_path_of(run)[:, :2],
        surfaces=surfaces_in_map(run.surfaces, _frame(run)) if run.surfaces and run.truth else None,
        walls=[(member.chain, member.segment) for member in run.chains.members] if walls else (),
    )


def draw_runs(runs: Sequence[tuple[str, Run]], path: Path | str, *, force: bool = False) -> tuple[int, int]:
    """Write a picture of runs, each with its title, side by side as in Fig. 12. Raises CannotDraw."""
    panels = [panel(run, title) for title, run in runs]
    # A run without correction is its own raw odometry: one line says so.
    panels = [replace(p, odometry=p.odometry[:0]) if np.allclose(p.odometry, p.path, atol=1e-3) else p for p in panels]
    return draw_maps(panels, path, force=force)


def _frame(run: Run) -> Pose:
    """The map's origin in the frame of the truth; without a truth, the map's own."""
    true = run.sweeps[0].truth
    return frame_between(Pose(*path_of(run)[0].tolist()), true) if true else ORIGIN
