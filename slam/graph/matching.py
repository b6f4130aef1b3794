"""Block E of the graph: which landmark each wall of the sweep is, by Mahalanobis distance [III.E].

In two rounds: first the pairs that leave no doubt, from which the pose follows, then the rest from there. What could be
either of two things is postponed: it joins nothing, and nothing joins it. Where hardly anything is explained the coarse
search of the paper looks for the place first.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, WALL, Association, Link, associate
from slam.config import Config
from slam.dmath import DEGREE, PI, Floats
from slam.features import Wall
from slam.geometry import Bools, Pose, wrap
from slam.graph.config import GraphConfig
from slam.graph.problem import RING, Graph, looks
from slam.graph.solver import weights
from slam.linear import inverse_3
from slam.localisation import search
from slam.self_calibration import Calibrated
from slam.sweep import Ints
from slam.track import Track

REACH_M = 7.0
"""No sonar sees a landmark from farther away."""
LOST = (0.2, 5.0 * DEGREE)
"""How uncertain the place is where nobody knows how the robot got there: m and rad."""
OLD_SWEEPS = 40
"""A pose does not grow more uncertain than over so many sweeps: that is what closing loops is for."""


@dataclass(frozen=True)
class Sights:
    """The sweep's walls as the graph takes them: n bearings, distances, σ of the bearings, and extents, in F."""

    bearing: Floats
    distance: Floats
    sigma: Floats
    left: Floats
    right: Floats

    @classmethod
    def of(cls, walls: tuple[Wall, ...], ring_bearing: float) -> "Sights":
        """Bearings as the sonars had them, before all of them together were turned by `ring_bearing`."""
        rows = np.array([(w.segment.alpha, w.segment.rho, w.sigma, w.left, w.right) for w in walls]).reshape(-1, 5)
        return cls(rows[:, 0] - ring_bearing, rows[:, 1], rows[:, 2], rows[:, 3], rows[:, 4])


@dataclass(frozen=True)
class Place:
    """Where the robot is thought to be: pose (3,) and its covariance (3, 3)."""

    pose: Floats
    covariance: Floats


@dataclass(frozen=True)
class Found:
    """Walls matched to landmarks, walls that could be either of two, and the place that follows."""

    pairs: dict[int, int]
    postponed: tuple[int, ...]
    place: Place


def match(calibrated: Calibrated, walls: tuple[Wall, ...], track: Track, config: Config) -> Association:
    """Each wall's landmark as a link to that chain; walls without one begin a chain, unless they are postponed."""
    graph, pose = track.graph, calibrated.predicted
    sights = Sights.of(walls, calibrated.calibration.ring_bearing)
    place = _predicted(calibrated, config.graph)
    found = _in_two_rounds(graph, sights, place, config.graph)
    if len(found.pairs) < config.graph.explained * len(walls):
        found = _after_search(found, sights, walls, pose, place, track, config)
    placed = tuple(wall.segment.moved(pose) for wall in walls)
    links = _links(found, sights, track)
    unlinked = tuple(k for k in range(len(walls)) if k not in found.pairs)
    x, y, theta = found.place.pose.tolist()
    return Association(links, unlinked, placed, found.postponed, Pose(x, y, theta).quantised())


def _predicted(calibrated: Calibrated, config: GraphConfig) -> Place:
    """The pose that odometry predicts, and how uncertain it is."""
    motion, pose = calibrated.motion, calibrated.predicted
    if motion is None or not calibrated.joined:
        shift, turn = LOST
    else:
        length = dmath.hypot(motion.x, motion.y)
        turns = (abs(motion.before) + abs(motion.between) + abs(motion.after)) / (2.0 * PI)
        slip_turn, slip_metre = config.slip_turn_deg, config.slip_metre_deg
        heading = slip_turn * slip_turn * turns + slip_metre * slip_metre * length
        turn = DEGREE * dmath.sqrt(heading + config.heading_sigma_deg * config.heading_sigma_deg)
        shift = 0.01 + 0.01 * length
    variance = np.array([shift * shift, shift * shift, turn * turn])
    return Place(np.array([pose.x, pose.y, pose.theta]), np.eye(3) * variance)


def _in_two_rounds(graph: Graph, sights: Sights, place: Place, config: GraphConfig) -> Found:
    near = _near(graph, place.pose)
    chi, as_point = _distances(graph, near, sights, place, config)
    pairs, postponed = _matched(chi, config.gate, config.margin)
    if not pairs:
        return Found({}, postponed, place)
    better = _placed(graph, sights, _taken(pairs, near, as_point), place, config)
    wider = replace(better, covariance=2.0 * better.covariance)
    chi, as_point = _distances(graph, near, sights, wider, config)
    pairs, postponed = _matched(chi, config.gate, 0.5 * config.margin)
    taken = _taken(pairs, near, as_point)
    matched = dict(zip(taken.wall.tolist(), taken.landmark.tolist(), strict=True))
    return Found(matched, postponed, _placed(graph, sights, taken, place, config))


@dataclass(frozen=True)
class _Taken:
    """Pairs (p,) of a wall and a landmark, and whether the landmark is taken for a point in it."""

    wall: Ints
    landmark: Ints
    as_point: Bools


def _taken(pairs: dict[int, int], near: Ints, as_point: Bools) -> _Taken:
    wall = np.array(sorted(pairs), dtype=np.int64)
    column = np.array([pairs[k] for k in sorted(pairs)], dtype=np.int64)
    return _Taken(wall, near[column], as_point[wall, column])


def _after_search(
    found: Found, sights: Sights, walls: tuple[Wall, ...], predicted: Pose, place: Place, track: Track, config: Config
) -> Found:
    """From where the paper's coarse search puts the robot, if that explains more.

    A robot that was turned by hand and a corridor that bends look the same; only small turns are looked for. Walls may
    be as far off as the search can shift the robot: one carried off by d1 itself is farther off with odometry's error.
    """
    reach = config.localisation.window // 2 * config.localisation.cell_m
    thresholds = config.association
    wide = replace(thresholds, d1_m=max(thresholds.d1_m, reach), a1_deg=min(thresholds.a1_deg, config.graph.search_deg))
    coarse = associate(walls, track.chains, track.poses, predicted, wide)
    pose = search(predicted, coarse, track.chains, config.localisation).pose
    there = replace(place, pose=np.array([pose.x, pose.y, pose.theta]))
    other = _in_two_rounds(track.graph, sights, there, config.graph)
    return other if len(other.pairs) > len(found.pairs) else found


def _near(graph: Graph, pose: Floats) -> Ints:
    """The landmarks that may be seen from here."""
    sine, cosine = dmath.sincos(graph.line[:, 0])
    dx, dy = pose[0] - graph.anchor[:, 0], pose[1] - graph.anchor[:, 1]
    along, across = cosine * dy - sine * dx, (cosine * dx + sine * dy) - graph.line[:, 1]
    beside = np.maximum(np.maximum(graph.extent[:, 0] - along, along - graph.extent[:, 1]), 0.0)
    return np.flatnonzero((graph.alive != 0) & (dmath.hypot(beside, across) <= REACH_M))


def _distances(graph: Graph, near: Ints, sights: Sights, place: Place, config: GraphConfig) -> tuple[Floats, Bools]:
    """χ² of each wall (n) as each landmark near by (l), inf where it cannot be; and whether as a point."""
    best = np.full((len(sights.bearing), len(near)), np.inf)
    as_point = np.zeros(best.shape, dtype=bool)
    sweep = len(graph.poses)
    away = np.minimum(sweep - graph.seen[near], OLD_SWEEPS).astype(np.float64)
    extra = [away * (s * s) for s in (config.away_m, config.away_m, config.away_deg * DEGREE)]
    for kind in (WALL, POINT):
        seen = looks(
            np.repeat(place.pose[None, :], len(near), axis=0),
            np.full(len(near), kind == POINT),
            graph.line[near], graph.point[near], graph.anchor[near], float(graph.errors[RING]),
        )  # fmt: skip
        spread = [[_form(seen.by_pose, place.covariance, extra, u, v) for v in (0, 1)] for u in (0, 1)]
        match_bearing = config.match_bearing_deg * DEGREE
        bb = spread[0][0][None, :] + (match_bearing * match_bearing + sights.sigma * sights.sigma)[:, None]
        dd = spread[1][1][None, :] + config.match_distance_m * config.match_distance_m
        bd = spread[0][1][None, :]
        b = wrap(sights.bearing[:, None] - seen.bearing[None, :])
        d = sights.distance[:, None] - seen.distance[None, :]
        chi = (b * b * dd - 2.0 * b * d * bd + d * d * bb) / (bb * dd - bd * bd)
        may = (graph.nature[near] == kind) | (graph.nature[near] == OPEN)
        may = np.repeat(may[None, :], len(b), axis=0)
        if kind == WALL:
            may &= _gaps(graph, near, sights, place.pose) <= config.gap_m
        better = may & (chi < best)
        best, as_point = np.where(better, chi, best), np.where(better, kind == POINT, as_point)
    return best, as_point


def _form(by_pose: Floats, covariance: Floats, extra: list[Floats], u: int, v: int) -> Floats:
    """J C Jᵀ of rows u and v of each landmark's J, with C grown by `extra` on its diagonal."""
    total = np.zeros(len(by_pose))
    for a in range(3):
        for b in range(3):
            grown = covariance[a, b] + (extra[a] if a == b else 0.0)
            total = total + by_pose[:, u, a] * grown * by_pose[:, v, b]
    return total


def _gaps(graph: Graph, near: Ints, sights: Sights, pose: Floats) -> Floats:
    """How far each wall (n) lies beyond the ends of each line (l), in metres; 0 where they overlap."""
    sine, cosine = dmath.sincos(graph.line[near, 0])
    foot = cosine * (pose[1] - graph.anchor[near, 1]) - sine * (pose[0] - graph.anchor[near, 0])
    low, high = foot[None, :] + sights.left[:, None], foot[None, :] + sights.right[:, None]
    begin, end = graph.extent[near, 0][None, :], graph.extent[near, 1][None, :]
    return np.asarray(np.maximum(np.maximum(begin - high, low - end), 0.0))


def _matched(chi: Floats, gate: float, margin: float) -> tuple[dict[int, int], tuple[int, ...]]:
    """Pairs of row and column without doubt, and the rows in doubt. No column is matched twice."""
    pairs: dict[int, int] = {}
    doubtful: set[int] = set()
    if chi.shape[1] == 0:
        return pairs, ()
    best = np.argmin(chi, axis=1).tolist()
    for row, column in enumerate(best):
        value = float(chi[row, column])
        others = np.delete(chi[row], column)
        second = float(others.min()) if len(others) else np.inf
        if value > gate:
            continue
        if second < 2.0 * gate and second - value < margin:
            doubtful.add(row)
        else:
            pairs[row] = column
    for column in sorted(set(pairs.values())):
        rivals = sorted((row for row in pairs if pairs[row] == column), key=lambda row: (float(chi[row, column]), row))
        close = len(rivals) > 1 and float(chi[rivals[1], column] - chi[rivals[0], column]) < margin
        for row in rivals if close else rivals[1:]:
            del pairs[row]
            doubtful.add(row)
    return pairs, tuple(sorted(doubtful))


def _placed(graph: Graph, sights: Sights, taken: _Taken, prior: Place, config: GraphConfig) -> Place:
    """The pose at which these walls are those landmarks, held against the prior; the landmarks stay where they are."""
    walls, of = taken.wall, taken.landmark
    if not len(walls):
        return prior
    tilt = config.match_bearing_deg * DEGREE
    sigma = np.stack(
        [
            np.sqrt(sights.sigma[walls] * sights.sigma[walls] + tilt * tilt),
            np.full(len(walls), config.match_distance_m),
        ],
        axis=1,
    )
    information = inverse_3(prior.covariance)
    pose, whole = prior.pose, information
    for _ in range(3):
        seen = looks(
            np.repeat(pose[None, :], len(of), axis=0),
            taken.as_point,
            graph.line[of], graph.point[of], graph.anchor[of], float(graph.errors[RING]),
        )  # fmt: skip
        off = np.stack([wrap(sights.bearing[walls] - seen.bearing), sights.distance[walls] - seen.distance], axis=1)
        off = off / sigma
        weight = weights(off, config.kernel)
        by_pose = seen.by_pose / sigma[:, :, None]
        from_prior = prior.pose - pose
        from_prior[2] = wrap(float(from_prior[2]))
        whole = information
        right = np.cumsum(information * from_prior[None, :], axis=1)[:, -1]
        rows, pulled = by_pose.reshape(-1, 3), (weight * off).reshape(-1, 1)
        squares = weight.reshape(-1, 1, 1) * rows[:, :, None] * rows[:, None, :]
        whole = whole + np.cumsum(squares, axis=0)[-1]
        right = right + np.cumsum(pulled * rows, axis=0)[-1]
        pose = pose + np.cumsum(inverse_3(whole) * right[None, :], axis=1)[:, -1]
    return Place(pose, inverse_3(whole))


def _links(found: Found, sights: Sights, track: Track) -> tuple[Link, ...]:
    """The links as the other algorithms give them: to each chain's newest member, with what is left between."""
    graph, members = track.graph, track.chains.members
    walls = np.array(sorted(found.pairs), dtype=np.int64)
    of = np.array([found.pairs[k] for k in walls.tolist()], dtype=np.int64)
    place = np.repeat(found.place.pose[None, :], len(of), axis=0)
    is_point = graph.as_point[of] != 0
    seen = looks(place, is_point, graph.line[of], graph.point[of], graph.anchor[of], float(graph.errors[RING]))
    d1 = np.abs(sights.distance[walls] - seen.distance)
    a1 = np.abs(wrap(sights.bearing[walls] - seen.bearing))
    gaps = _gaps(graph, of, sights, found.place.pose)
    links = []
    for k, (wall, chain) in enumerate(zip(walls.tolist(), of.tolist(), strict=True)):
        newest = next(m for m in range(len(members) - 1, -1, -1) if members[m].chain == chain)
        nature = int(graph.nature[chain])
        gap = 0.0 if nature == POINT else float(gaps[wall, k])
        links.append(Link(wall, chain, newest, float(d1[k]), float(a1[k]), gap, nature))
    return tuple(links)
