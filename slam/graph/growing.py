"""The graph grows: a sweep more, and what it saw."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slam import dmath
from slam.association import OPEN
from slam.features import Wall
from slam.geometry import Pose, wrap
from slam.graph.config import GraphConfig
from slam.graph.matching import Sights
from slam.graph.problem import RING, Graph
from slam.motion import Motion
from slam.self_calibration import Calibrated
from slam.sweep import Ints


def with_sweep(graph: Graph, calibrated: Calibrated, pose: Pose, config: GraphConfig) -> Graph:
    """With one sweep more, made at that pose."""
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


def with_sightings(
    graph: Graph, walls: tuple[Wall, ...], linked: Mapping[int, int], postponed: tuple[int, ...], ring_bearing: float
) -> tuple[Graph, Ints]:
    """With the last sweep's walls as sightings of the landmarks that they are `linked` to, wall by wall.

    The others are new ones, in their order; nothing may join those that are `postponed`. Then all that were seen.
    """
    sights, sweep = Sights.of(walls, ring_bearing), len(graph.poses) - 1
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
            "alive": [int(k not in postponed) for k in new],
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
