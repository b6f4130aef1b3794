"""Two accounts of the same sightings: odometry is right and sonars err, or wheels err, and somebody corrects them.

The difference of what both leave over is twice the logarithm of a ratio of likelihoods (Neyman and Pearson 1933; Wilks
1938).
"""

from dataclasses import replace

import numpy as np

from slam import dmath
from slam.geometry import Pose
from slam.graph.config import GraphConfig
from slam.graph.natures import refitted
from slam.graph.problem import Graph
from slam.graph.solver import prior_error, step_costs


def with_poses_of(odometry: Graph, solved: Graph, here: Pose) -> Graph:
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


def held_against(graph: Graph, solved: Graph, first: int, config: GraphConfig) -> tuple[Graph, float]:
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
