"""Walls seen again and again: blocks B to F of the paper, sweep after sweep, without the map.

Must not know: what is wrong with the robot.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from slam.algorithms import algorithm
from slam.association import POINT, WALL, Chains, associate
from slam.features import extract_features
from slam.geometry import ORIGIN, Pose, Segment
from slam.localisation import search
from slam.reliability import analyse_reliability
from slam.self_calibration import Calibration, self_calibrate
from slam.sweep import SonarRing, Sweep

OFTEN = 4  # sightings


@dataclass(frozen=True)
class Seen:
    """A sweep, where it was, and its walls in its own frame, each with the number of its chain."""

    sweep: Sweep
    pose: Pose
    walls: tuple[tuple[int, Segment], ...]
    chains: Chains  # so far


def walk(sweeps: Sequence[Sweep], ring: SonarRing) -> Iterator[Seen]:
    """The sweeps of one session, each located by the algorithm `paper`."""
    config = algorithm("paper").config
    known, chains = Calibration.unknown(len(ring.mountings)), Chains()
    poses: tuple[Pose, ...] = ()
    last: tuple[Pose, Pose] | None = None  # odometry's, and in the map
    for sweep in sweeps:
        calibrated = self_calibrate(sweep, ring, None, known, config.self_calibration)
        predicted = _predicted(last, calibrated.odometry, calibrated.calibration.rotation_scale)
        features = extract_features(analyse_reliability(calibrated, config.reliability), config.features)
        association = associate(features.walls, chains, poses, predicted, config.association)
        pose = search(predicted, association, chains, config.localisation).pose
        placed = tuple(wall.segment.moved(pose) for wall in features.walls)
        chains = chains.joined(association.chained(placed), len(poses))
        joined = [member.chain for member in chains.members[len(chains.members) - len(placed) :]]
        poses, last, known = (*poses, pose), (calibrated.odometry, pose), calibrated.calibration
        segments = [wall.segment for wall in features.walls]
        yield Seen(sweep, pose, tuple(zip(joined, segments, strict=True)), chains)


def _predicted(last: tuple[Pose, Pose] | None, odometry: Pose, rotation_scale: float) -> Pose:
    if last is None:
        return ORIGIN
    step = last[0].step_to(odometry)
    return last[1].compose(Pose(step.x, step.y, step.theta * (1.0 + rotation_scale)))


def sure_walls(chains: Chains) -> set[int]:
    """The chains that parallax has told to be walls: corners and poles answer like one, but stay as the robot moves.

    What was seen often and never from aside may be either, and says the same either way.
    """
    natures: dict[int, list[int]] = {}
    for member in chains.members:
        natures.setdefault(member.chain, []).append(member.nature)
    return {chain for chain, seen in natures.items() if WALL in seen or (POINT not in seen and len(seen) >= OFTEN)}
