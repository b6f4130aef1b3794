"""How near a path and a map come to the truth: the numbers that algorithms are judged by.

Poses are (n, 3) arrays of x m, y m, θ rad, one row a sweep. Must not know: files, algorithms, pictures.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from slam.association import POINT, Chains, Member
from slam.geometry import ORIGIN, Pose
from sonarlog.errors import SonarlogError
from sonarlog.log import Floats

PARALLEL_RAD = np.radians(15.0)
"""A wall of a sweep shows a true wall if it lies along it within this, and within `BESIDE_M`, from the true pose."""
BESIDE_M = 0.30
ONE_LINE_M = 0.05
TURNS_FROM_M = 0.5
"""A path that goes no further from its middle than this shows no heading by its positions."""


class NotComparable(SonarlogError):
    """A path and a truth that do not belong together."""


@dataclass(frozen=True)
class PathErrors:
    """Errors of one path against the truth, both laid on one another at the first pose; nothing is scaled.

    `ate_m` is the RMSE of position over the sweeps, `ate_aligned_m` the same after the best rigid alignment. The others
    are relative pose errors, RMSE of what a piece of path of at least 1 m (5 m) adds; None for paths without one.
    """

    ate_m: float
    ate_aligned_m: float
    heading_rmse_deg: float
    end_m: float
    over_1m_m: float | None = None
    over_1m_deg: float | None = None
    over_5m_m: float | None = None
    over_5m_deg: float | None = None

    def ratio(self, other: "PathErrors") -> dict[str, float | None]:
        """Each error as a part of the other path's (raw odometry's, say); None where one of them has none."""
        pairs = {name: (value, getattr(other, name)) for name, value in vars(self).items()}
        return {name: mine / yours if mine is not None and yours else None for name, (mine, yours) in pairs.items()}


def pose_rows(poses: Iterable[Pose]) -> Floats:
    """Poses as rows (n, 3)."""
    return np.array([(p.x, p.y, p.theta) for p in poses], dtype=np.float64).reshape(-1, 3)


def frame_between(pose: Pose, truth: Pose) -> Pose:
    """The origin of the map as it lies in the truth's frame, given one pose in both."""
    return truth.compose(pose.step_to(ORIGIN))


def placed(poses: Floats, frame: Pose) -> Floats:
    """Poses (n, 3) of the frame, in the frame that it is given in."""
    points = frame.points(poses[:, :2])
    return np.column_stack([points, _wrapped(poses[:, 2] + frame.theta)])


def path_errors(poses: Floats, truth: Floats) -> PathErrors:
    """Errors of a path (n, 3) against the true poses (n, 3) at the same moments, each in its own frame.

    Raises NotComparable if there are not as many of both, or none.
    """
    if len(poses) != len(truth) or len(poses) == 0:
        raise NotComparable(f"{len(poses)} poses cannot be held against {len(truth)} true ones")
    mine = placed(poses, frame_between(Pose(*poses[0].tolist()), Pose(*truth[0].tolist())))
    off = mine[:, :2] - truth[:, :2]
    turned = _wrapped(mine[:, 2] - truth[:, 2])
    best = rigid_alignment(mine[:, :2], truth[:, :2])
    left = best.points(mine[:, :2]) - truth[:, :2]
    over_1m, over_5m = (relative_errors(poses, truth, length) or (None, None) for length in (1.0, 5.0))
    return PathErrors(
        ate_m=_rms(np.hypot(off[:, 0], off[:, 1])),
        ate_aligned_m=_rms(np.hypot(left[:, 0], left[:, 1])),
        heading_rmse_deg=float(np.degrees(_rms(turned))),
        end_m=float(np.hypot(*off[-1])),
        over_1m_m=over_1m[0],
        over_1m_deg=over_1m[1],
        over_5m_m=over_5m[0],
        over_5m_deg=over_5m[1],
    )


def relative_errors(poses: Floats, truth: Floats, length_m: float) -> tuple[float, float] | None:
    """RMSE in metres and degrees of the motion over pieces of path; None if the path is not so long.

    A piece goes from each pose to the first one at least `length_m` of true path further on; its error is the motion
    that leads from the true motion to the path's [Sturm et al. 2012], so that it hangs on no alignment.
    """
    steps = np.hypot(*np.diff(truth[:, :2], axis=0).T)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    end = np.searchsorted(way, way + length_m - 1e-9)
    start = np.flatnonzero(end < len(way))
    if len(start) == 0:
        return None
    mine, true = (_motions(path[start], path[end[start]]) for path in (poses, truth))
    off = mine - true  # turned into the true end's frame it is as long
    return _rms(np.hypot(off[:, 0], off[:, 1])), float(np.degrees(_rms(_wrapped(off[:, 2]))))


def _motions(start: Floats, end: Floats) -> Floats:
    """The motions (n, 3) from poses to poses, each in its first pose's frame."""
    sine, cosine = np.sin(start[:, 2]), np.cos(start[:, 2])
    dx, dy = (end - start)[:, :2].T
    return np.column_stack([cosine * dx + sine * dy, cosine * dy - sine * dx, end[:, 2] - start[:, 2]])


def rigid_alignment(points: Floats, onto: Floats) -> Pose:
    """The turn and shift that bring points (n, 2) nearest to others (n, 2), in the least-squares sense.

    Closed form in the plane: the angle of the summed products of the centred points [Umeyama 1991, without scale].
    """
    centre, goal = points.mean(axis=0), onto.mean(axis=0)
    a, b = points - centre, onto - goal
    cross, dot = float(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])), float(np.sum(a * b))
    theta = float(np.arctan2(cross, dot)) if cross or dot else 0.0
    turned = Pose(0.0, 0.0, theta).points(centre[None, :])[0]
    return Pose(float(goal[0] - turned[0]), float(goal[1] - turned[1]), theta)


def best_frame(poses: Floats, truth: Floats) -> Pose:
    """The origin of the map as it lies in the truth's frame after the alignment that `ate_aligned_m` is given for.

    Poses and truth (n, 3) are of the same moments. A path too short to show its heading is laid on the truth at its
    first pose.
    """
    away = truth[:, :2] - truth[:, :2].mean(axis=0)
    if np.hypot(away[:, 0], away[:, 1]).max() < TURNS_FROM_M:
        return frame_between(Pose(*poses[0].tolist()), Pose(*truth[0].tolist()))
    return rigid_alignment(poses[:, :2], truth[:, :2])


@dataclass(frozen=True)
class MappedWall:
    """How a true wall came out: pieces seen, their extent, and how bent they lie.

    `wall` is the number of its first surface; `deviation_m` the largest distance of an end of a piece from the best
    line through all of them.
    """

    wall: int
    pieces: int
    length_m: float
    deviation_m: float


def straightness(
    chains: Chains, poses: Floats, truth: Floats, walls: Floats, min_length_m: float = 5.0
) -> list[MappedWall]:
    """How straight each true wall of at least that length was mapped [Fig. 12], in the order of the walls (k, 4).

    Surfaces in one line, such as a wall and the doors in it, are one wall. A piece of a chain is told by the true pose
    of its sweep which wall it shows, so that a map bent by a metre is not taken for the wall opposite, nor the back of
    a recess for the wall it is in. What turned out to be a point is no piece of a wall. `poses` and `truth` (n, 3) are
    the sweeps', the latter in the frame of `walls`.
    """
    line_of = _lines(walls, min_length_m)
    seen: dict[int, list[Floats]] = {line: [] for line in line_of.values()}
    for member in _pieces(chains.members):
        mapped = np.array([member.segment.start, member.segment.end])
        pose, true = Pose(*poses[member.sweep].tolist()), Pose(*truth[member.sweep].tolist())
        ends = frame_between(pose, true).points(mapped)
        wall = _shown(ends, walls)
        if wall in line_of:
            seen[line_of[wall]].append(mapped)
    return [_mapped_wall(wall, pieces) for wall, pieces in seen.items() if len(pieces) > 1]


def _lines(walls: Floats, min_length_m: float) -> dict[int, int]:
    """For each wall of a line that is long enough, the first wall of that line."""
    groups: dict[int, list[int]] = {}
    for k, wall in enumerate(walls):
        firsts = list(groups)
        off = np.maximum(*(_beside(end, walls[firsts]) for end in wall.reshape(2, 2)))
        first = next((firsts[g] for g in np.flatnonzero(off <= ONE_LINE_M)), k)
        groups.setdefault(first, []).append(k)
    return {
        wall: first
        for first, members in groups.items()
        for wall in members
        if _mapped_wall(first, [walls[k].reshape(2, 2) for k in members]).length_m >= min_length_m
    }


def _beside(point: Floats, walls: Floats) -> Floats:
    """Distance of a point (2,) from the infinite line of each wall (k, 4)."""
    x0, y0, x1, y1 = walls.T
    across = (point[1] - y0) * (x1 - x0) - (point[0] - x0) * (y1 - y0)
    return np.asarray(np.abs(across) / np.hypot(x1 - x0, y1 - y0))


def chain_straightness(chains: Chains, min_length_m: float = 3.0) -> list[MappedWall]:
    """The same for each chain that is at least so long, where no truth is known; `wall` is the chain's number."""
    rows = []
    for chain in range(len(chains.roots)):
        pieces = [np.array([m.segment.start, m.segment.end]) for m in _pieces(chains.of(chain))]
        if len(pieces) > 1 and (mapped := _mapped_wall(chain, pieces)).length_m >= min_length_m:
            rows.append(mapped)
    return rows


def _pieces(members: Iterable[Member]) -> list[Member]:
    return [member for member in members if member.nature != POINT]


def _mapped_wall(wall: int, pieces: list[Floats]) -> MappedWall:
    """Total least squares: the line through the middle along the direction of largest spread."""
    points = np.concatenate(pieces)
    centred = points - points.mean(axis=0)
    xx, yy, xy = (float(np.sum(centred[:, i] * centred[:, j])) for i, j in ((0, 0), (1, 1), (0, 1)))
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    along = centred @ np.array([np.cos(angle), np.sin(angle)])
    across = centred @ np.array([-np.sin(angle), np.cos(angle)])
    return MappedWall(wall, len(pieces), float(np.ptp(along)), float(np.abs(across).max()))


def _shown(ends: Floats, walls: Floats) -> int | None:
    """The wall along which a piece (2, 2) lies, the nearest of several; None: it shows no wall."""
    way, middle, along = walls[:, 2:] - walls[:, :2], ends.mean(axis=0) - walls[:, :2], ends[1] - ends[0]
    length = np.hypot(way[:, 0], way[:, 1])
    place = (middle[:, 0] * way[:, 0] + middle[:, 1] * way[:, 1]) / length
    turned = np.arctan2(np.abs(along[0] * way[:, 1] - along[1] * way[:, 0]), np.abs(way @ along))
    off = np.maximum(*(_beside(end, walls) for end in ends))
    fits = (off <= BESIDE_M) & (place >= -BESIDE_M) & (place <= length + BESIDE_M) & (turned <= PARALLEL_RAD)
    return int(np.where(fits, off, np.inf).argmin()) if fits.any() else None


def _wrapped(angle: Floats) -> Floats:
    return np.asarray(np.arctan2(np.sin(angle), np.cos(angle)))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values * values)))
