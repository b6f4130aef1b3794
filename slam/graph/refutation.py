"""Blocks E and F of `graph`: odometry is taken as it is until the walls refute it, and corrected from then on [III.F].

The problem is solved at every sweep as if odometry erred, and its poses are the rival's (`slam.rivals`). Two accounts
of the same sightings are then held against one another: odometry is right and the sonars err, or errors of the wheels,
with what they cost, leave less over. The difference of what both leave over is twice the logarithm of a ratio of
likelihoods (Neyman and Pearson 1933; Wilks 1938).
"""

from dataclasses import replace

import numpy as np

from slam import dmath
from slam.association import Association
from slam.config import Config
from slam.features import Wall
from slam.geometry import Pose
from slam.graph.config import GraphConfig
from slam.graph.drawing import drawn
from slam.graph.matching import match
from slam.graph.natures import refitted
from slam.graph.problem import Graph
from slam.graph.smoothing import smooth
from slam.graph.solver import prior_error, step_costs
from slam.localisation import Localisation, keep_prediction
from slam.rivals import as_it_is, laid_at, overtaken, seen_by, settled, track_of
from slam.self_calibration import Calibrated, Calibration
from slam.track import Rival, Track


def match_unless_refuted(calibrated: Calibrated, walls: tuple[Wall, ...], track: Track, config: Config) -> Association:
    """Each wall's landmark, which are the rival's as long as there is one; where the walls are, odometry says then."""
    if settled(track, config.graph.refuted):
        return match(calibrated, walls, track, config)
    rival = track.rival or Rival()
    found = match(seen_by(rival, calibrated), walls, track_of(rival), config)
    return laid_at(as_it_is(track, calibrated).predicted, walls, found)


def smooth_unless_refuted(
    calibrated: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
) -> tuple[Localisation, Track, Calibration]:
    """Odometry's pose, with the rival's beside it; where odometry is refuted the rival's, for all sweeps so far.

    Odometry that was interrupted cannot be taken as it is.
    """
    if settled(track, config.graph.refuted):
        return smooth(calibrated, walls, association, track, config)
    rival = track.rival or Rival()
    found, after, learnt = smooth(seen_by(rival, calibrated), walls, association, track_of(rival), config)
    here = as_it_is(track, calibrated).predicted
    first = max(0, len(track.poses) - config.graph.window + 1)
    graph = _with_poses_of(track.graph, after.graph, here)
    graph, gained = _held_against(graph, after.graph, first, config.graph)
    if gained >= config.graph.refuted or not calibrated.joined:
        return overtaken(found, track, after), after, learnt
    graph, chains = drawn(graph, track.chains, first)
    rival = Rival(after.poses, after.chains, after.graph, learnt.distance_scale, learnt.drift)
    kept = replace(keep_prediction(here, association, track.chains, config.localisation), merged=found.merged)
    return kept, Track((*track.poses, here), chains, graph, rival), calibrated.calibration


def _with_poses_of(odometry: Graph, solved: Graph, here: Pose) -> Graph:
    """The solved graph with the poses that odometry has, `here` the newest; nothing of this sweep is drawn yet."""
    landmarks, sightings = len(odometry.nature), len(solved.sweep) - len(odometry.sweep)
    return replace(
        solved,
        poses=np.concatenate([odometry.poses, [[here.x, here.y, here.theta]]]),
        line=np.concatenate([odometry.line, solved.line[landmarks:]]),
        point=np.concatenate([odometry.point, solved.point[landmarks:]]),
        errors=np.zeros(len(solved.errors)),
        drawn=np.concatenate([odometry.drawn, np.full((sightings, 4), np.inf)]),
        drawn_as=np.concatenate([odometry.drawn_as, np.full((sightings, 2), -1)]),
    )


def _held_against(graph: Graph, solved: Graph, first: int, config: GraphConfig) -> tuple[Graph, float]:
    """Odometry's graph, what was seen since sweep `first` where it fits its poses best, and what the solved one gains.

    The landmark that says most counts for no more than the next one: it may be two things taken for one. And the
    wildest step costs nothing: somebody may have shoved the robot once.
    """
    late = np.flatnonzero((solved.seen >= first) & (solved.alive != 0))
    graph, left = refitted(graph, late, config)
    _, best = refitted(solved, late, config)
    gains = np.sort(np.where(solved.counts()[late] >= 2, left - best, 0.0))
    gains[-1:] = np.maximum(gains[-2:-1], 0.0) if len(gains) > 1 else 0.0
    steps = np.sort(step_costs(solved, np.arange(max(first, 1), len(solved.poses)), config))[:-1]
    paid = dmath.total(steps) + prior_error(solved, config) - prior_error(graph, config)
    return graph, dmath.total(gains) - paid
