"""Blocks E and F of `paper`: odometry is taken as it is until the walls refute it, and corrected from then on [III.F].

What corrects bad odometry makes good odometry worse: the first sightings of a wall are off by some tenths of a degree,
and so is the robot that is turned after them. So every sweep is localised twice, by odometry alone and by weight (two
models of one filter, after Magill 1965). Errors of sonars are new at every sweep and turn the robot now this way, now
that; those of odometry add up, and all walls pull it the same way. When they have done so for long enough (cumulative
sums, Page 1954), or very hard at one sweep (a push; Lucas 1982), the corrected poses, which have been there from the
start, take the place of odometry's for good, with the next sweep.

Must not know: how walls are weighed.
"""

from dataclasses import replace

from slam.association import Association
from slam.chaining import agreeing, balance_of, localise_by_weight, recognise_chains
from slam.config import Config
from slam.features import Wall
from slam.localisation import Localisation, keep_prediction
from slam.self_calibration import Calibrated, Calibration
from slam.track import Rival, Track
from slam.weighing import WeighingConfig, pulls


def recognise_unless_refuted(
    calibrated: Calibrated, walls: tuple[Wall, ...], track: Track, config: Config
) -> Association:
    """Each wall to the chain that it fits best from odometry's pose; from the rival's where odometry is refuted."""
    if track.rival is not None and track.rival.refuted:
        return recognise_chains(_seen_by(track.rival, calibrated), walls, _track_of(track.rival), config)
    return recognise_chains(calibrated, walls, track, config)


def localise_unless_refuted(
    calibrated: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
) -> tuple[Localisation, Track, Calibration]:
    """Odometry's pose, with the rival's beside it; where odometry is refuted the rival's, for all sweeps so far."""
    if track.rival is None and (track.poses or not config.weighing.refuted):
        return localise_by_weight(calibrated, walls, association, track, config)
    rival = track.rival or Rival()
    seen, other = _seen_by(rival, calibrated), _track_of(rival)
    if rival.refuted:
        found, after, learnt = localise_by_weight(seen, walls, association, other, config)
        both = enumerate(zip(track.poses, after.poses, strict=False))
        return replace(found, moved=tuple((k, now) for k, (was, now) in both if now != was)), after, learnt
    _, after, learnt = localise_by_weight(seen, walls, recognise_chains(seen, walls, other, config), other, config)
    balance = balance_of(walls, association, track, config)
    rival = _pulled(rival, pulls(balance, calibrated.predicted, config.localisation), config.weighing)
    rival = replace(rival, poses=after.poses, chains=after.chains, drift=learnt.drift)
    kept = keep_prediction(calibrated.predicted, association, track.chains, config.localisation)
    return kept, replace(agreeing(balance, walls, track, kept.pose), rival=rival), calibrated.calibration


def _track_of(rival: Rival) -> Track:
    return Track(rival.poses, rival.chains)


def _seen_by(rival: Rival, calibrated: Calibrated) -> Calibrated:
    """The sweep from where the rival has the robot, with the drift that it has learnt."""
    known = replace(calibrated.calibration, drift=rival.drift)
    predicted, motion = calibrated.predicted, calibrated.motion
    if rival.poses:
        predicted = rival.poses[-1]
        if motion is not None:
            predicted = predicted.compose(motion.corrected(known.wheels)).quantised()
    return replace(calibrated, predicted=predicted, calibration=known)


def _pulled(rival: Rival, pull: tuple[float, float], weights: WeighingConfig) -> Rival:
    """The rival with one more sweep's pulls; what is no more than the allowance takes from the sums."""
    turn, shift = pull
    left = max(rival.left + turn - weights.turn_allowance, 0.0)
    right = max(rival.right - turn - weights.turn_allowance, 0.0)
    aside = max(rival.aside + shift - weights.shift_allowance, 0.0)
    refuted = max(abs(turn), shift) >= weights.push or max(left, right) + aside >= weights.refuted
    return replace(rival, left=left, right=right, aside=aside, refuted=refuted)
