"""Blocks E and F of `paper`: odometry is taken as it is until the walls refute it, and corrected from then on [III.F].

Errors of sonars are new at every sweep and turn the robot now this way, now that; those of odometry add up, and all
walls pull it the same way. When they have done so for long enough (cumulative sums, Page 1954), or very hard at one
sweep (a push; Lucas 1982), the corrected poses take the place of odometry's for good (`slam.rivals`).

Must not know: how walls are weighed.
"""

from dataclasses import replace

from slam.association import Association
from slam.chaining import agreeing, balance_of, localise_by_weight, recognise_chains
from slam.config import Config
from slam.features import Wall
from slam.localisation import Localisation, keep_prediction
from slam.rivals import as_it_is, overtaken, seen_by, settled, track_of
from slam.self_calibration import Calibrated, Calibration
from slam.track import Rival, Track
from slam.weighing import pulls


def recognise_unless_refuted(
    calibrated: Calibrated, walls: tuple[Wall, ...], track: Track, config: Config
) -> Association:
    """Each wall to the chain that it fits best from odometry's pose; from the rival's if odometry is refuted by that.

    The former tells no pose: odometry is not asked where it would rather be.
    """
    if settled(track, config.weighing.refuted):
        return recognise_chains(calibrated, walls, track, config)
    here, rival = as_it_is(track, calibrated), track.rival or Rival()
    association = recognise_chains(here, walls, track, config)
    _, refuted = _pulled(rival, here, walls, association, track, config)
    if refuted:
        return recognise_chains(seen_by(rival, calibrated), walls, track_of(rival), config)
    return replace(association, pose=None)


def localise_unless_refuted(
    calibrated: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
) -> tuple[Localisation, Track, Calibration]:
    """Odometry's pose, with the rival's beside it; where odometry is refuted the rival's, for all sweeps so far."""
    if settled(track, config.weighing.refuted):
        return localise_by_weight(calibrated, walls, association, track, config)
    rival = track.rival or Rival()
    seen, other = seen_by(rival, calibrated), track_of(rival)
    if association.pose is not None:
        found, after, learnt = localise_by_weight(seen, walls, association, other, config)
        return overtaken(found, track, after), after, learnt
    _, after, learnt = localise_by_weight(seen, walls, recognise_chains(seen, walls, other, config), other, config)
    here = as_it_is(track, calibrated)
    rival, _ = _pulled(rival, here, walls, association, track, config)
    rival = replace(rival, poses=after.poses, chains=after.chains, drift=learnt.drift)
    kept = keep_prediction(here.predicted, association, track.chains, config.localisation)
    mine = agreeing(balance_of(walls, association, track, config), walls, track, kept.pose)
    return kept, replace(mine, rival=rival), calibrated.calibration


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
