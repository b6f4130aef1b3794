"""Block E of the graph: which landmark each wall of the sweep is, by Mahalanobis distance [III.E].

In two rounds: first the pairs that leave no doubt, from which the pose follows, then the rest from there. What could be
either of two things is postponed: it joins nothing, and nothing joins it. Where hardly anything is explained the coarse
search of the paper looks for the place first, and then whatever place explains most.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.association import POINT, Association, Link, associate
from slam.config import Config
from slam.dmath import DEGREE, PI, Floats
from slam.features import Wall
from slam.geometry import Bools, Pose, wrap
from slam.graph.config import GraphConfig
from slam.graph.natures import believed_parallax
from slam.graph.near import Near
from slam.graph.placing import Place, Sight, placed
from slam.graph.problem import RING, Graph, looks
from slam.graph.recovery import Reach, places
from slam.localisation import search
from slam.self_calibration import Calibrated
from slam.track import Track

LOST = (0.2, 5.0 * DEGREE)
"""How uncertain the place is where nobody knows how the robot got there: m and rad."""
ANYWHERE = Reach(1.5, 20.0 * DEGREE)
"""So far off a robot may be that drove on while its line was silent."""
MORE, CLEAR = 2, 3
"""So many walls more, or so many where odometry says nothing, must speak for another place: one does by chance."""
GUESSED = Place(np.zeros(3), np.eye(3) * np.array([0.05 * 0.05, 0.05 * 0.05, 4.0 * DEGREE * DEGREE]))
"""How uncertain a place is that one or two walls tell: 5 cm and 2°."""
UNKNOWN = 4.0
"""While fewer steps than that are known, odometry may be far worse than it seems."""


@dataclass(frozen=True)
class Sights:
    """The sweep's walls as the graph takes them: n bearings, distances, σ of the bearings, and extents, in F.

    `parallax` is the χ² by which each is rather a point, as far as that is believed.
    """

    bearing: Floats
    distance: Floats
    sigma: Floats
    left: Floats
    right: Floats
    parallax: Floats

    @classmethod
    def of(cls, walls: tuple[Wall, ...], ring_bearing: float) -> "Sights":
        """Bearings as the sonars had them, before all of them together were turned by `ring_bearing`."""
        rows = np.array([(w.segment.alpha, w.segment.rho, w.sigma, w.left, w.right, w.parallax) for w in walls])
        bearing, distance, sigma, left, right, parallax = rows.reshape(-1, 6).T
        return cls(bearing - ring_bearing, distance, sigma, left, right, believed_parallax(parallax))


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
    place = _predicted(calibrated, graph.slip, config.graph)
    found = _in_two_rounds(graph, sights, place, config.graph)
    if len(found.pairs) < config.graph.explained * len(walls):
        found = _after_search(found, sights, walls, pose, place, track, config)
    if len(found.pairs) < config.graph.explained * len(walls) or not calibrated.joined:
        found = _after_guess(found, sights, place, graph, calibrated.joined, config)
    placed = tuple(wall.segment.moved(pose) for wall in walls)
    links = _links(found, sights, track)
    unlinked = tuple(k for k in range(len(walls)) if k not in found.pairs)
    x, y, theta = found.place.pose.tolist()
    return Association(links, unlinked, placed, found.postponed, Pose(x, y, theta).quantised())


def _predicted(calibrated: Calibrated, slip: float, config: GraphConfig) -> Place:
    """The pose that odometry predicts, and how uncertain it is."""
    motion, pose = calibrated.motion, calibrated.predicted
    if motion is None or not calibrated.joined:
        shift, turn = LOST
    else:
        length = dmath.hypot(motion.x, motion.y)
        turns = (abs(motion.before) + abs(motion.between) + abs(motion.after)) / (2.0 * PI)
        slip_turn, slip_metre = slip * config.slip_turn_deg, slip * config.slip_metre_deg
        heading = slip_turn * slip_turn * turns + slip_metre * slip_metre * length
        turn = DEGREE * dmath.sqrt(heading + config.heading_sigma_deg * config.heading_sigma_deg)
        shift = 0.01 + 0.01 * slip * length
    variance = np.array([shift * shift, shift * shift, turn * turn])
    return Place(np.array([pose.x, pose.y, pose.theta]), np.eye(3) * variance)


def _in_two_rounds(graph: Graph, sights: Sights, place: Place, config: GraphConfig) -> Found:
    near = Near.to(graph, place.pose, config)
    chi, as_point = _distances(near, sights, place, config)
    pairs, postponed = _matched(chi, config.gate, config.margin)
    if not pairs:
        return Found({}, postponed, place)
    better = _placed(pairs, as_point, near, sights, place, config)
    wider = replace(better, covariance=2.0 * better.covariance)
    chi, as_point = _distances(near, sights, wider, config)
    pairs, postponed = _matched(chi, config.gate, 0.5 * config.margin)
    matched = {wall: int(near.landmark[pairs[wall]]) for wall in sorted(pairs)}
    return Found(matched, postponed, _placed(pairs, as_point, near, sights, place, config))


def _placed(
    pairs: dict[int, int], as_point: Bools, near: Near, sights: Sights, prior: Place, config: GraphConfig
) -> Place:
    """The pose that follows if these walls are those of the landmarks near by."""
    tilt = config.match_bearing_deg * DEGREE
    walls = np.array(sorted(pairs), dtype=np.int64)
    sigma = np.sqrt(sights.sigma[walls] * sights.sigma[walls] + tilt * tilt)
    columns = zip(walls.tolist(), (sights.bearing[walls] + near.ring).tolist(), sights.distance[walls].tolist(),
                  sigma.tolist(), strict=True)  # fmt: skip
    seen = [Sight(near.mark(pairs[wall], bool(as_point[wall, pairs[wall]])), b, d, s) for wall, b, d, s in columns]
    return placed(seen, config.match_distance_m, prior, config.kernel)


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
    before = len(found.pairs)
    return other if len(other.pairs) >= (before + MORE if before > 1 else MORE) else found


def _after_guess(found: Found, sights: Sights, place: Place, graph: Graph, joined: bool, config: Config) -> Found:
    """From the place that explains the walls best, if that explains more and there is no other like it."""
    reach = _reach(graph, config) if joined else ANYWHERE
    near = Near.to(graph, place.pose, config.graph)
    poses, costs = places(near, sights.bearing, sights.distance, place.pose, reach)
    best, *others = (_in_two_rounds(graph, sights, replace(GUESSED, pose=pose), config.graph) for pose in poses)
    if others and costs[1] - costs[0] < config.graph.margin and len(best.pairs) < len(others[0].pairs) + MORE:
        return found
    return best if len(best.pairs) >= (len(found.pairs) + MORE if joined else CLEAR) else found


def _reach(graph: Graph, config: Config) -> Reach:
    """How far off odometry may have put the robot: the more it slips, the farther."""
    window = config.localisation
    unsure = 1.0 + UNKNOWN / float(max(1, len(graph.poses) - 1))
    turn = unsure * graph.slip * config.graph.search_deg * DEGREE
    return Reach(1.5 * window.cell_m * float(window.window // 2), turn)


def _distances(near: Near, sights: Sights, place: Place, config: GraphConfig) -> tuple[Floats, Bools]:
    """χ² of each wall (n) as each landmark near by (l), inf where it cannot be; and whether as a point."""
    seen = near.looks(place.pose)
    spread = _spread(seen.by_pose, place.covariance, near.extra)
    match_bearing = config.match_bearing_deg * DEGREE
    bb = spread[:, 0, 0] + (match_bearing * match_bearing + sights.sigma * sights.sigma)[:, None]
    dd = spread[:, 1, 1] + config.match_distance_m * config.match_distance_m
    bd = spread[:, 0, 1]
    b = wrap(sights.bearing[:, None] - seen.bearing)
    d = sights.distance[:, None] - seen.distance
    chi = (b * b * dd - 2.0 * b * d * bd + d * d * bb) / (bb * dd - bd * bd)
    lines = len(near.as_line)
    best = np.full((len(b), len(near.landmark)), np.inf)
    foot = -seen.by_landmark[:lines, 1, 0]  # how the distance hangs on the direction is how far along the foot lies
    best[:, near.as_line] = np.where(_gaps(near.extent, foot, sights) <= config.gap_m, chi[:, :lines], np.inf)
    best += np.maximum(sights.parallax, 0.0)[:, None]
    points = np.full(best.shape, np.inf)
    points[:, near.as_point] = chi[:, lines:] + np.maximum(-sights.parallax, 0.0)[:, None]
    return np.minimum(best, points), points < best


def _spread(by_pose: Floats, covariance: Floats, extra: Floats) -> Floats:
    """J C Jᵀ (c, 2, 2) of each J (c, 2, 3), with C grown by `extra` (c, 3) on its diagonal."""
    half = by_pose * extra[:, None, :]
    for a in range(3):
        half += by_pose[:, :, a, None] * covariance[a]
    total = half[:, :, None, 0] * by_pose[:, None, :, 0]
    for a in (1, 2):
        total += half[:, :, None, a] * by_pose[:, None, :, a]
    return np.asarray(total)


def _gaps(extent: Floats, foot: Floats, sights: Sights) -> Floats:
    """How far each wall (n) lies beyond the ends (l, 2) of each line, in metres; 0 where they overlap.

    `foot` (l,) is where on the line the robot's foot point lies.
    """
    low, high = foot + sights.left[:, None], foot + sights.right[:, None]
    return np.asarray(np.maximum(np.maximum(extent[:, 0] - high, low - extent[:, 1]), 0.0))


def _matched(chi: Floats, gate: float, margin: float) -> tuple[dict[int, int], tuple[int, ...]]:
    """Pairs of row and column without doubt, and the rows in doubt. No column is matched twice."""
    pairs: dict[int, int] = {}
    doubtful: set[int] = set()
    if chi.shape[1] == 0:
        return pairs, ()
    for row, values in enumerate(chi.tolist()):
        value = min(values)
        if value > gate:
            continue
        column = values.index(value)
        second = min(values[:column] + values[column + 1 :], default=np.inf)
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


def _links(found: Found, sights: Sights, track: Track) -> tuple[Link, ...]:
    """The links as the other algorithms give them: to each chain's newest member, with what is left between."""
    graph = track.graph
    walls = np.array(sorted(found.pairs), dtype=np.int64)
    of = np.array([found.pairs[k] for k in walls.tolist()], dtype=np.int64)
    place = np.broadcast_to(found.place.pose, (len(of), 3))
    is_point, ring = graph.as_point[of] != 0, float(graph.errors[RING])
    seen = looks(place, is_point, graph.line[of], graph.point[of], graph.anchor[of], ring)
    d1 = np.abs(sights.distance[walls] - seen.distance)
    a1 = np.abs(wrap(sights.bearing[walls] - seen.bearing))
    along = looks(place, np.zeros(len(of), dtype=bool), graph.line[of], graph.point[of], graph.anchor[of], ring)
    gaps = _gaps(graph.extent[of], -along.by_landmark[:, 1, 0], sights)
    links = []
    for k, (wall, chain) in enumerate(zip(walls.tolist(), of.tolist(), strict=True)):
        newest = int(np.flatnonzero(graph.landmark == chain)[-1])
        nature = int(graph.nature[chain])
        gap = 0.0 if nature == POINT else float(gaps[wall, k])
        links.append(Link(wall, chain, newest, float(d1[k]), float(a1[k]), gap, nature))
    return tuple(links)
