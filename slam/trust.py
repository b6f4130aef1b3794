"""Block F of `paper`: odometry is taken as it is until the walls refute it, and is corrected from then on [III.F].

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
from slam.localisation import Localisation, keep_prediction
from slam.self_calibration import Calibrated, Calibration
from slam.track import Rival, Track
from slam.weighing import WeighingConfig, pulls


def localise_unless_refuted(
    calibrated: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
) -> tuple[Localisation, Track, Calibration]:
    """Odometry's pose, with the rival's beside it; the latter from where odometry is refuted, for all sweeps so far."""
    if track.rival is None and (track.poses or not config.weighing.refuted):
        return localise_by_weight(calibrated, walls, association, track, config)
    balance = balance_of(walls, association, track, config)
    pull = pulls(balance, calibrated.predicted, config.localisation)
    rival = _pulled(track.rival or Rival(), pull, config.weighing)
    corrected, other, drift = _by_rival(rival, calibrated, walls, config)
    if not _refuted(rival, pull, config.weighing):
        found = keep_prediction(calibrated.predicted, association, track.chains, config.localisation)
        rival = replace(rival, poses=other.poses, chains=other.chains, drift=drift)
        return found, replace(agreeing(balance, walls, track, found.pose), rival=rival), calibrated.calibration
    both = enumerate(zip(track.poses, other.poses, strict=False))
    moved = tuple((k, now) for k, (was, now) in both if now != was)
    return replace(corrected, moved=moved), other, replace(calibrated.calibration, drift=drift)


def _pulled(rival: Rival, pull: tuple[float, float], weights: WeighingConfig) -> Rival:
    """The rival with one more sweep's pulls; what is no more than the allowance takes from the sums."""
    turn, shift = pull
    return replace(
        rival,
        left=max(rival.left + turn - weights.turn_allowance, 0.0),
        right=max(rival.right - turn - weights.turn_allowance, 0.0),
        aside=max(rival.aside + shift - weights.shift_allowance, 0.0),
    )


def _refuted(rival: Rival, pull: tuple[float, float], weights: WeighingConfig) -> bool:
    turn, shift = pull
    return max(abs(turn), shift) >= weights.push or max(rival.left, rival.right) + rival.aside >= weights.refuted


def _by_rival(
    rival: Rival, calibrated: Calibrated, walls: tuple[Wall, ...], config: Config
) -> tuple[Localisation, Track, float]:
    """Blocks E and F from where the rival has the robot; the drift that it has learnt then."""
    known = replace(calibrated.calibration, drift=rival.drift)
    predicted, motion = calibrated.predicted, calibrated.motion
    if rival.poses:
        predicted = rival.poses[-1]
        if motion is not None:
            predicted = predicted.compose(motion.corrected(known.wheels)).quantised()
    seen, track = replace(calibrated, predicted=predicted, calibration=known), Track(rival.poses, rival.chains)
    found, after, learnt = localise_by_weight(seen, walls, recognise_chains(seen, walls, track, config), track, config)
    return found, after, learnt.drift
