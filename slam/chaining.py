"""Blocks E and F of the paper, sweep after sweep: walls join chains by distance, the pose follows, chains grow."""

from collections.abc import Callable

from slam import dmath
from slam.association import Association, Chains, associate
from slam.config import Config
from slam.features import Wall
from slam.geometry import Pose, wrap
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
) -> Callable[[Calibrated, tuple[Wall, ...], Association, Track, Config], tuple[Localisation, Track, Calibration]]:
    """Localisation that finds one pose after the other by `search`; what was found before stays as it was."""

    def localise(
        calibrated: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
    ) -> tuple[Localisation, Track, Calibration]:
        found = search(calibrated.predicted, association, track.chains, config.localisation)
        placed = tuple(wall.segment.moved(found.pose) for wall in walls)
        chains = track.chains.joined(association.chained(placed), len(track.poses))
        return found, Track((*track.poses, found.pose), chains), calibrated.calibration

    return localise


def recognise_chains(calibrated: Calibrated, walls: tuple[Wall, ...], track: Track, config: Config) -> Association:
    """Each wall to the chain that it fits best, as a wall or as a point [III.E]."""
    landmarks = Landmarks(track.chains, track.poses, config.landmarks)
    return recognise(walls, landmarks, calibrated.predicted, config.association, config.recognition)


def localise_by_weight(
    calibrated: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
) -> tuple[Localisation, Track, Calibration]:
    """One pose after the other, by weight; what the robot had to be turned by tells the drift of its wheels."""
    balance = balance_of(walls, association, track, config)
    found = weigh(balance, calibrated.predicted, config.localisation)
    learnt, motion = calibrated.calibration, calibrated.motion
    if motion is not None and association.links:
        turn = wrap(found.pose.theta - calibrated.predicted.theta)
        metres = dmath.hypot(motion.x, motion.y)
        learnt = with_drift(learnt, turn, metres, len(track.poses), config.weighing)
    return found, agreeing(balance, walls, track, found.pose), learnt


def balance_of(walls: tuple[Wall, ...], association: Association, track: Track, config: Config) -> Balance:
    """The links of a sweep's walls with all that is to be weighed."""
    landmarks = Landmarks(track.chains, track.poses, config.landmarks)
    return Balance(association, tuple(wall.sigma for wall in walls), landmarks, config.weighing)


def agreeing(balance: Balance, walls: tuple[Wall, ...], track: Track, pose: Pose) -> Track:
    """The track with this sweep at its pose; the walls that agree with their chains there join them."""
    placed = tuple(wall.segment.moved(pose) for wall in walls)
    agreed = without_strangers(balance, placed, pose)
    chains = track.chains.joined(agreed.chained(placed), len(track.poses), balance.sigmas)
    return Track((*track.poses, pose), chains)
