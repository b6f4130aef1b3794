"""Block F of the graph: this sweep's sightings join the problem, and all poses that may still move are solved for.

Sweeps older than the window stay where they are, unless a loop closes: then everything since the wall that was met
again moves.
"""

from dataclasses import replace

import numpy as np

from slam import dmath
from slam.association import OPEN, Association
from slam.config import Config
from slam.dmath import DEGREE, Floats
from slam.features import Wall
from slam.geometry import Pose, wrap
from slam.graph.config import GraphConfig
from slam.graph.drawing import along_lines, drawn
from slam.graph.matching import Sights
from slam.graph.merging import may_close, merged
from slam.graph.natures import tell_natures
from slam.graph.odometry import slip
from slam.graph.problem import DISTANCE, DRIFT, RING, Graph, sighting_residuals
from slam.graph.solver import part_from, solve
from slam.localisation import Localisation
from slam.motion import Motion
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
    graph = _with_sweep(track.graph, calibrated, found, config.graph)
    before = graph.seen.copy()
    graph, touched = _with_sightings(graph, sweep, walls, association, calibrated.calibration.ring_bearing)
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


def _with_sweep(graph: Graph, calibrated: Calibrated, pose: Pose, config: GraphConfig) -> Graph:
    motion = calibrated.motion or Motion(0.0, 0.0, 0.0, 0.0, 0.0)
    known = calibrated.calibration
    # What the sweeps by themselves say of the rotation, loosened: their arcs share the quantisation of their bearings.
    information = float(known.normal[0, 0]) + 1.0 / (config.rotation_sigma * config.rotation_sigma)
    prior = np.array([known.rotation_scale, 1.5 / dmath.sqrt(information)])
    errors = graph.errors
    if not len(graph.poses):
        errors = np.array([known.rotation_scale, 0.0, 0.0, 0.0])
    return replace(graph, errors=errors, rotation_prior=prior).with_rows(
        {
            "poses": [[pose.x, pose.y, pose.theta]],
            "motions": [[motion.x, motion.y, motion.before, motion.between, motion.after]],
            "joined": [int(calibrated.motion is not None and calibrated.joined)],
        }
    )


def _with_sightings(
    graph: Graph, sweep: int, walls: tuple[Wall, ...], association: Association, ring_bearing: float
) -> tuple[Graph, Ints]:
    """With the walls as sightings of their landmarks, new ones for those that joined none."""
    sights = Sights.of(walls, ring_bearing)
    linked = {link.wall: link.chain for link in association.links}
    sine, cosine = dmath.sincos(graph.poses[-1, 2] + sights.bearing + float(graph.errors[RING]))
    feet = graph.poses[-1, :2] + sights.distance[:, None] * np.stack([cosine, sine], axis=1)
    new = [k for k in range(len(walls)) if k not in linked]
    count = len(graph.nature)
    alpha = wrap(graph.poses[-1, 2] + sights.bearing[new] + float(graph.errors[RING]))
    of = np.array([linked[k] if k in linked else count + new.index(k) for k in range(len(walls))], dtype=np.int64)
    graph = graph.with_rows(
        {
            "nature": np.full(len(new), OPEN),
            "as_point": sights.parallax[new] > 0.0,
            "seen": np.full(len(new), sweep),
            "alive": [int(k not in association.postponed) for k in new],
            "line": np.stack([alpha, np.zeros(len(new))], axis=1),
            "point": np.column_stack([feet[new], np.zeros(len(new))]),
            "anchor": feet[new],
            "extent": np.stack([sights.left[new], sights.right[new]], axis=1),
            "tried": np.full((len(new), 3), -1),
            "sweep": np.full(len(walls), sweep),
            "landmark": of,
            "bearing": sights.bearing,
            "distance": sights.distance,
            "sigma": sights.sigma,
            "parallax": sights.parallax,
            "left": sights.left,
            "right": sights.right,
            "drawn": np.full((len(walls), 4), np.inf),
            "drawn_as": np.full((len(walls), 2), -1),
        }
    )
    seen = graph.seen.copy()
    seen[of] = sweep
    return replace(graph, seen=seen), np.unique(of)


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
