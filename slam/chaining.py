"""Blocks E and F of the paper, sweep after sweep: walls join chains by distance, the pose follows, chains grow."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from slam import dmath
from slam.association import Association, Chains, associate
from slam.config import Config
from slam.features import Wall
from slam.geometry import Pose, wrap
from slam.graph.growing import with_sightings, with_sweep
from slam.graph.problem import Graph
from slam.landmarks import Landmarks
from slam.localisation import Localisation, LocalisationConfig
from slam.recognition import recognise
from slam.self_calibration import Calibrated, Calibration
from slam.track import Track
from slam.weighing import Balance, weigh, with_drift, without_strangers

Search = Callable[[Pose, Association, Chains, LocalisationConfig], Localisation]


def associate_chains(calibrated: Calibrated, walls: tuple[Wall, ...], track: Track, config: Config) -> Association:
    """Each wall to the chain with the nearest member [III.E]."""
    return associate(walls, track.chains, track.poses, calibrated.predicted, config.association)


def localise_by(
    search: Search,
    calibrated: Calibrated,
    walls: tuple[Wall, ...],
    association: Association,
    track: Track,
    config: Config,
) -> tuple[Localisation, Track, Calibration]:
    """One pose after the other by `search`; what was found before stays as it was."""
    found = search(calibrated.predicted, association, track.chains, config.localisation)
    placed = tuple(wall.segment.moved(found.pose) for wall in walls)
    chains = track.chains.joined(association.chained(placed), len(track.poses))
    return found, Track((*track.poses, found.pose), chains), calibrated.calibration


def recognise_chains(calibrated: Calibrated, walls: tuple[Wall, ...], track: Track, config: Config) -> Association:
    """Each wall to the chain that it fits best, as a wall or as a point [III.E]."""
    landmarks = Landmarks(track.chains, track.poses, config.landmarks)
    return recognise(walls, landmarks, calibrated.predicted, config.association, config.recognition)


def localise_by_weight(
    calibrated: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
) -> tuple[Localisation, Track, Calibration]:
    """One pose after the other, by weight; what the robot had to be turned by tells the drift of its wheels."""
    landmarks = Landmarks(track.chains, track.poses, config.landmarks)
    balance = Balance(association, tuple(wall.sigma for wall in walls), landmarks, config.weighing)
    found = weigh(balance, calibrated.predicted, config.localisation)
    learnt, motion = calibrated.calibration, calibrated.motion
    if motion is not None and association.links:
        turn = wrap(found.pose.theta - calibrated.predicted.theta)
        metres = dmath.hypot(motion.x, motion.y)
        learnt = with_drift(learnt, turn, metres, len(track.poses), config.weighing)
    placed = tuple(wall.segment.moved(found.pose) for wall in walls)
    agreed = without_strangers(balance, placed, found.pose)
    chains = track.chains.joined(agreed.chained(placed), len(track.poses), balance.sigmas)
    return found, Track((*track.poses, found.pose), chains), learnt


def account_of(graph: Graph, after: Track, calibrated: Calibrated, walls: tuple[Wall, ...], config: Config) -> Graph:
    """All walls as sightings of what their chains stand for, from the poses found one after the other.

    `graph` is that of the sweep before; the newest members of the chains are this sweep's walls.
    """
    known, members = calibrated.calibration, after.chains.members[len(graph.sweep) :]
    linked = {wall: member.chain for wall, member in enumerate(members) if member.chain < len(graph.nature)}
    grown = with_sweep(graph, calibrated, after.poses[-1], config.graph)
    grown, _ = with_sightings(grown, walls, linked, (), known.ring_bearing)
    return replace(grown, errors=np.array([known.rotation_scale, known.distance_scale, known.drift, 0.0]))


def laid_alike(graph: Graph, chains: Chains, after: Track, walls: tuple[Wall, ...], first: int) -> tuple[Graph, Chains]:
    """The chains with this sweep's walls from the graph's last pose, each in the chain it has joined `after`."""
    here, known = Pose(*graph.poses[-1].tolist()), len(chains.roots)
    members = after.chains.members[len(chains.members) :]
    joining = [
        (member.chain if member.chain < known else None, member.nature, wall.segment.moved(here))
        for wall, member in zip(walls, members, strict=True)
    ]
    return graph, chains.joined(joining, len(graph.poses) - 1, tuple(wall.sigma for wall in walls))
