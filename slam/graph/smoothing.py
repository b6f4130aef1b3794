"""Block F of the graph: this sweep's sightings join the problem, and all poses that may still move are solved for.

Sweeps older than the window stay where they are, unless a loop closes: then everything since the wall that was met
again moves.
"""

from dataclasses import replace

import numpy as np

from slam import dmath
from slam.association import Association, Chains
from slam.config import Config
from slam.dmath import DEGREE, Floats
from slam.features import Wall
from slam.geometry import Pose, wrap
from slam.graph.config import GraphConfig
from slam.graph.drawing import along_lines, drawn
from slam.graph.growing import with_sightings, with_sweep
from slam.graph.merging import may_close, merged
from slam.graph.natures import tell_natures
from slam.graph.odometry import slip
from slam.graph.problem import DISTANCE, DRIFT, RING, Graph, sighting_residuals
from slam.graph.solver import part_from, solve
from slam.localisation import Localisation
from slam.self_calibration import Calibrated, Calibration
from slam.sweep import Ints
from slam.track import Track

TENSE_M = 0.03
"""By so much a wall from before the window may be off before everything since then moves."""


def smooth(
    calibrated: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
) -> tuple[Localisation, Track, Calibration]:
    """The pose of this sweep, the track with all poses as they are known now, and what was learnt of the wheels."""
    found = association.pose or calibrated.predicted
    sweep = len(track.poses)
    graph = with_sweep(track.graph, calibrated, found, config.graph)
    before, linked = graph.seen.copy(), {link.wall: link.chain for link in association.links}
    graph, touched = with_sightings(graph, walls, linked, association.postponed, calibrated.calibration.ring_bearing)
    first = sweep - config.graph.window + 1
    graph = _solved(graph, touched, first, config.graph)
    old = touched[touched < len(before)]
    old = old[before[old] < first]
    if len(old) and may_close(graph) and _tense(graph, old, sweep, config.graph):
        graph = solve(graph, part_from(graph, int(before[old].min())), config.graph)
        graph = replace(graph, closed=sweep)
    graph, pairs = merged(graph, touched, first, config.graph)
    graph = replace(graph, slip=slip(graph, config.graph))
    graph = replace(graph, extent=_extents(graph, np.union1d(touched, np.array([k for k, _ in pairs], dtype=np.int64))))
    changed = np.flatnonzero((graph.poses[:-1] != track.graph.poses).any(axis=1))
    since = min(int(changed[0]), first) if len(changed) else first
    poses = _poses(graph, track.poses, changed)
    graph, chains = drawn(graph, track.chains, since)
    localisation = _localisation(calibrated, association, graph, poses, changed, pairs)
    learnt = replace(
        calibrated.calibration,
        distance_scale=float(graph.errors[DISTANCE]),
        drift=float(graph.errors[DRIFT]),
        ring_bearing=float(graph.errors[RING]),
    )
    return localisation, Track(poses, chains, graph), learnt


def _solved(graph: Graph, touched: Ints, first: int, config: GraphConfig) -> Graph:
    """Solved, with natures told, and solved again if one has changed."""
    graph = tell_natures(graph, touched, config, only_open=True)
    graph = solve(graph, part_from(graph, first), config)
    told = tell_natures(graph, touched, config)
    if bool((told.as_point == graph.as_point).all()):
        return told
    return solve(told, part_from(told, first), config)


def _tense(graph: Graph, old: Ints, sweep: int, config: GraphConfig) -> bool:
    """Whether walls from before the window disagree with where this sweep sees them."""
    rows = graph.rows_of(old)
    off, _, _ = sighting_residuals(graph, rows[graph.sweep[rows] == sweep], config.distance_sigma_m)
    return bool((np.abs(off[:, 1]) * config.distance_sigma_m > TENSE_M).any())


def _extents(graph: Graph, touched: Ints) -> Floats:
    """How far each landmark was seen along its line."""
    extent = graph.extent.copy()
    rows = graph.rows_of(touched)
    along = along_lines(graph, rows)
    extent[touched] = (np.inf, -np.inf)
    np.minimum.at(extent[:, 0], graph.landmark[rows], along + graph.left[rows])
    np.maximum.at(extent[:, 1], graph.landmark[rows], along + graph.right[rows])
    return np.where(extent[:, :1] <= extent[:, 1:], extent, 0.0)


def _poses(graph: Graph, before: tuple[Pose, ...], changed: Ints) -> tuple[Pose, ...]:
    """All poses; one that has not moved is the same object."""
    poses = [*before, None]
    for k in (*changed.tolist(), len(before)):
        poses[k] = Pose(*graph.poses[k].tolist())
    return tuple(pose for pose in poses if pose is not None)


def _localisation(
    calibrated: Calibrated,
    association: Association,
    graph: Graph,
    poses: tuple[Pose, ...],
    changed: Ints,
    pairs: tuple[tuple[int, int], ...],
) -> Localisation:
    """What came of it, in the other algorithms' terms: d1 is the mean distance from the walls to their landmarks."""
    predicted, pose, sweep = calibrated.predicted, poses[-1], len(poses) - 1
    moved = tuple((k, poses[k]) for k in changed.tolist())
    linked = np.array([link.wall for link in association.links], dtype=np.int64)
    rows = np.flatnonzero(graph.sweep == sweep)[linked]
    before, after = _mean_off(graph, rows, (predicted, pose))
    turn = wrap(pose.theta - predicted.theta)
    angles = [link.a1 for link in association.links]
    return Localisation(
        pose=pose,
        turn_deg=turn / DEGREE,
        shift=(pose.x - predicted.x, pose.y - predicted.y),
        mean_turn_deg=dmath.ordered_sum(angles) / len(angles) / DEGREE if angles else 0.0,
        d1_before=before,
        d1_after=after,
        walls_used=len(rows),
        moved=moved,
        merged=pairs,
    )


def _mean_off(graph: Graph, rows: Ints, places: tuple[Pose, ...]) -> list[float]:
    """By how much the distances of these sightings are off, on average, if they were made from each of the places."""
    if not len(rows):
        return [0.0 for _ in places]
    of = graph.landmark[rows]
    sine, cosine = dmath.sincos(graph.line[of, 0])
    off, (ax, ay), (px, py, radius) = graph.line[of, 1], graph.anchor[of].T, graph.point[of].T
    means = []
    for at in places:
        to_line = off - (cosine * (at.x - ax) + sine * (at.y - ay))
        far = np.where(graph.as_point[of] != 0, dmath.hypot(px - at.x, py - at.y) - radius, to_line)
        means.append(dmath.mean(np.abs(graph.distance[rows] - far)))
    return means


def solved_account(
    graph: Graph, after: Track, calibrated: Calibrated, walls: tuple[Wall, ...], config: Config
) -> Graph:
    """All that was seen, at the poses solved for."""
    return after.graph


def drawn_alike(
    graph: Graph, chains: Chains, after: Track, walls: tuple[Wall, ...], first: int
) -> tuple[Graph, Chains]:
    """The graph's sightings as members of its chains."""
    return drawn(graph, chains, first)
