"""Blocks E and F of `paper`: odometry is taken as it is until the walls refute it, and corrected from then on [III.F].

What corrects bad odometry makes good odometry worse: the first sightings of a wall are off by some tenths of a degree,
and so is the robot that is turned after them. So every sweep is localised twice, by odometry alone and by weight (two
models of one filter, after Magill 1965). Errors of sonars are new at every sweep and turn the robot now this way, now
that; those of odometry add up, and all walls pull it the same way. When they have done so for long enough (cumulative
sums, Page 1954), or very hard at one sweep (a push; Lucas 1982), the corrected poses, which have been there from the
start, take the place of odometry's for good.

Must not know: how walls are weighed.
"""

from dataclasses import replace

from slam.association import Association
from slam.chaining import agreeing, balance_of, localise_by_weight, recognise_chains
from slam.config import Config
from slam.features import Wall
from slam.geometry import ORIGIN, Pose
from slam.localisation import Localisation, keep_prediction
from slam.motion import WheelErrors
from slam.self_calibration import Calibrated, Calibration
from slam.track import Rival, Track
from slam.weighing import pulls


def recognise_unless_refuted(
    calibrated: Calibrated, walls: tuple[Wall, ...], track: Track, config: Config
) -> Association:
    """Each wall to the chain that it fits best from odometry's pose; from the rival's if odometry is refuted by that.

    The former tells no pose: odometry is not asked where it would rather be.
    """
    if _settled(track, config):
        return recognise_chains(calibrated, walls, track, config)
    here, rival = _as_it_is(track, calibrated), track.rival or Rival()
    association = recognise_chains(here, walls, track, config)
    _, refuted = _pulled(rival, here, walls, association, track, config)
    if refuted:
        return recognise_chains(_seen_by(rival, calibrated), walls, _track_of(rival), config)
    return replace(association, pose=None)


def localise_unless_refuted(
    calibrated: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
) -> tuple[Localisation, Track, Calibration]:
    """Odometry's pose, with the rival's beside it; where odometry is refuted the rival's, for all sweeps so far."""
    if _settled(track, config):
        return localise_by_weight(calibrated, walls, association, track, config)
    rival = track.rival or Rival()
    seen, other = _seen_by(rival, calibrated), _track_of(rival)
    if association.pose is not None:
        found, after, learnt = localise_by_weight(seen, walls, association, other, config)
        both = enumerate(zip(track.poses, after.poses, strict=False))
        return replace(found, moved=tuple((k, now) for k, (was, now) in both if now != was)), after, learnt
    _, after, learnt = localise_by_weight(seen, walls, recognise_chains(seen, walls, other, config), other, config)
    here = _as_it_is(track, calibrated)
    rival, _ = _pulled(rival, here, walls, association, track, config)
    rival = replace(rival, poses=after.poses, chains=after.chains, drift=learnt.drift)
    kept = keep_prediction(here.predicted, association, track.chains, config.localisation)
    mine = agreeing(balance_of(walls, association, track, config), walls, track, kept.pose)
    return kept, replace(mine, rival=rival), calibrated.calibration


def _settled(track: Track, config: Config) -> bool:
    """Whether odometry was refuted before, or was never to be taken as it is."""
    return track.rival is None and (bool(track.poses) or not config.weighing.refuted)


def _track_of(rival: Rival) -> Track:
    return Track(rival.poses, rival.chains)


def _as_it_is(track: Track, calibrated: Calibrated) -> Calibrated:
    """The sweep from where odometry has the robot, without what was learnt of the wheels."""
    return replace(calibrated, predicted=_went_on(track.poses, calibrated, WheelErrors()))


def _seen_by(rival: Rival, calibrated: Calibrated) -> Calibrated:
    """The sweep from where the rival has the robot, with the drift that it has learnt."""
    known = replace(calibrated.calibration, drift=rival.drift)
    return replace(calibrated, predicted=_went_on(rival.poses, calibrated, known.wheels), calibration=known)


def _went_on(poses: tuple[Pose, ...], calibrated: Calibrated, errors: WheelErrors) -> Pose:
    if not poses:
        return ORIGIN
    return (
        poses[-1] if calibrated.motion is None else poses[-1].compose(calibrated.motion.corrected(errors)).quantised()
    )


def _pulled(
    rival: Rival, here: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
) -> tuple[Rival, bool]:
    """The rival with one more sweep's pulls, and whether odometry is refuted.

    What is no more than the allowance takes from the sums.
    """
    weights = config.weighing
    turn, shift, part = pulls(balance_of(walls, association, track, config), here.predicted, config.localisation)
    left = max(rival.left + turn - weights.turn_allowance, 0.0)
    right = max(rival.right - turn - weights.turn_allowance, 0.0)
    aside = max(rival.aside + shift - weights.shift_allowance, 0.0)
    refuted = part >= weights.push or max(left, right) + aside >= weights.refuted
    return replace(rival, left=left, right=right, aside=aside), refuted
