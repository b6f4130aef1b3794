"""Evaluation: paths and maps held against a truth, number by number, each also as a ratio to raw odometry.

docs/evaluation.md says what each number means. Must not know: printing, how runs and truths are read from files.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from slam.association import Chains
from slam.geometry import Bools, Pose
from slam.grid import Grid
from sonarlog.log import Floats, Ints, Surfaces, Truth
from sonarlog.map_metrics import MapQuality, TruePlace, map_qualities, map_quality
from sonarlog.metrics import (
    MappedWall,
    PathErrors,
    best_frame,
    chain_straightness,
    frame_between,
    path_errors,
    placed,
    straightness,
)
from sonarlog.runs import Run
from sonarlog.scores import online_path_of, path_of, raw_path_of
from sonarlog.truth import NoTruth, Reference, odometry_at, poses_at, span_of

SCHEMA = "sonarlog.eval/1"
LONG_M = 5.0
"""Walls as long as this are judged for straightness."""


class OtherTime(NoTruth):
    """A truth of another time than the path."""

    def __init__(self, track: str, when: str, truth: str, known: str) -> None:
        super().__init__(track, when, truth, known)
        self.track, self.when, self.truth, self.known = track, when, truth, known

    def __str__(self) -> str:
        return (
            f"{self.truth} knows no pose at the time of {self.track}: it covers {self.known}, the path {self.when}; "
            "if their clocks differ, say by how much with --truth-offset"
        )


class OtherDrive(NoTruth):
    """A truth of another drive than the path, at the same time by its own clock."""


@dataclass(frozen=True)
class Track:
    """A path to be judged: poses (n, 3) at moments (n,), with what else a run knows.

    `online` is each pose as it was found at its sweep, before later ones moved it; `odometry` the raw one.
    """

    name: str
    t_ns: Ints
    path: Floats
    online: Floats | None = None
    odometry: Floats | None = None
    grid: Grid | None = None
    chains: Chains | None = None
    algorithm: str | None = None
    digest: str | None = None


@dataclass(frozen=True)
class Evaluation:
    """What one path, and the map if there is one, are worth; None where there was nothing to judge.

    `judged` of `poses` poses had a truth. `ratio` and `online_ratio` are to `odometry`, error by error. `map` is
    laid on the truth at the first judged pose, `map_aligned` as path and truth lie best on one another, which needs
    true poses. `walls` are the long true walls if surfaces are known, else the long chains.
    """

    name: str
    algorithm: str | None
    digest: str | None
    poses: int
    judged: int
    path: PathErrors | None
    online: PathErrors | None
    odometry: PathErrors | None
    ratio: dict[str, float | None] | None
    online_ratio: dict[str, float | None] | None
    map: MapQuality | None
    map_aligned: MapQuality | None
    walls: tuple[MappedWall, ...]

    @property
    def straightness_m(self) -> float | None:
        """The largest deviation of a long wall from its best line."""
        return max((wall.deviation_m for wall in self.walls), default=None)

    @property
    def corrected_later(self) -> bool:
        """Whether the final path is another than the one found online."""
        return self.online is not None and self.online != self.path

    def as_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {**asdict(self), "straightness_m": self.straightness_m}


def track_of_run(run: Run) -> Track:
    """A run as it is judged."""
    return Track(
        name=str(run.path),
        t_ns=np.array([sweep.t_ns for sweep in run.sweeps], dtype=np.int64),
        path=path_of(run),
        online=online_path_of(run),
        odometry=raw_path_of(run),
        grid=run.grid,
        chains=run.chains,
        algorithm=f"{run.identity.algorithm} {run.identity.algorithm_version}",
        digest=run.digest,
    )


def track_of_tum(name: str, trajectory: Truth) -> Track:
    """A path of any program's making."""
    return Track(name, trajectory.t_ns, trajectory.pose)


def reference_of_run(run: Run) -> Reference:
    """What the run was told of the truth; it may be nothing."""
    known = [(sweep.t_ns, sweep.truth) for sweep in run.sweeps if sweep.truth is not None]
    if not known:
        return Reference(str(run.path))
    poses = np.array([(pose.x, pose.y, pose.theta) for _, pose in known])
    truth = Truth(np.array([t_ns for t_ns, _ in known], dtype=np.int64), poses)
    return Reference(str(run.path), truth, run.surfaces)


def evaluate(
    track: Track, reference: Reference, true_map: TruePlace | None = None, start: Pose | None = None
) -> Evaluation:
    """Hold a path and its map against the truth.

    `true_map` is taken instead of the reference's surfaces; without true poses it needs to be told where in it the
    path starts. Raises NoTruth, OtherTime, OtherDrive.
    """
    if len(track.t_ns) == 0:
        raise NoTruth(f"{track.name} holds no poses")
    place = true_map or reference.surfaces
    if reference.truth is None:
        if place is None:
            raise NoTruth(f"{track.name} has no truth: give one with --truth FILE.tum, or a map with --truth-map")
        if start is None:
            raise NoTruth(f"{track.name} has no true poses: say with --start X,Y,DEG where in the true map it starts")
        return _map_alone(track, place, start)
    truth, known = poses_at(reference.truth, track.t_ns)
    if not known.any():
        raise OtherTime(track.name, span_of(track.t_ns), reference.name, span_of(reference.truth.t_ns))
    truth = truth[known]
    odometry = track.odometry
    if reference.odometry is not None:
        recorded = odometry_at(reference.odometry, track.t_ns)
        if odometry is None:
            odometry = recorded
        elif not _same_drive(odometry[known], recorded[known]):
            raise OtherDrive(f"{reference.name} is not the recording of {track.name}: their odometry differs")
    path, online, raw = (
        None if poses is None else path_errors(poses[known], truth) for poses in (track.path, track.online, odometry)
    )
    laid, aligned = _maps(track, place, track.path[known], truth)
    return Evaluation(
        name=track.name,
        algorithm=track.algorithm,
        digest=track.digest,
        poses=len(known),
        judged=int(np.count_nonzero(known)),
        path=path,
        online=online,
        odometry=raw,
        ratio=path.ratio(raw) if path and raw else None,
        online_ratio=online.ratio(raw) if online and raw else None,
        map=laid,
        map_aligned=aligned,
        walls=_walls(track, truth, known, reference.surfaces if true_map is None else None),
    )


def _maps(
    track: Track, place: Surfaces | TruePlace | None, path: Floats, truth: Floats
) -> tuple[MapQuality, MapQuality] | tuple[None, None]:
    """The map laid on the truth at the first pose, and after the best alignment of the path."""
    if track.grid is None or place is None:
        return None, None
    frames = [frame_between(Pose(*path[0].tolist()), Pose(*truth[0].tolist())), best_frame(path, truth)]
    laid, aligned = map_qualities(track.grid, place, frames, truth[:, :2])
    return laid, aligned


def _same_drive(odometry: Floats, recorded: Floats) -> bool:
    """Whether both tell of one drive; a calibration may bend it a little, so a tenth of the way is let pass."""
    way = float(np.hypot(*np.diff(recorded[:, :2], axis=0).T).sum())
    return path_errors(odometry, recorded).ate_aligned_m <= max(0.1, 0.1 * way)


def _map_alone(track: Track, place: Surfaces | TruePlace, start: Pose) -> Evaluation:
    """Where only the map is known, its sweeps are taken to be where the path has them."""
    frame = frame_between(Pose(*track.path[0].tolist()), start)
    stations = placed(track.path, frame)[:, :2]
    return Evaluation(
        name=track.name,
        algorithm=track.algorithm,
        digest=track.digest,
        poses=len(track.path),
        judged=0,
        path=None,
        online=None,
        odometry=None,
        ratio=None,
        online_ratio=None,
        map=map_quality(track.grid, place, frame, stations) if track.grid else None,
        map_aligned=None,
        walls=_walls(track, np.zeros((0, 3)), np.zeros(len(track.path), dtype=bool), None),
    )


def _walls(track: Track, truth: Floats, known: Bools, surfaces: Surfaces | None) -> tuple[MappedWall, ...]:
    """Straightness by true walls, of what was seen from poses with a truth; else by chains."""
    if track.chains is None:
        return ()
    if surfaces is None:
        return tuple(chain_straightness(track.chains, LONG_M))
    judged = Chains(tuple(m for m in track.chains.members if known[m.sweep]), track.chains.roots)
    everywhere = np.zeros((len(known), 3))
    everywhere[known] = truth
    return tuple(straightness(judged, track.path, everywhere, surfaces.segments, LONG_M))
