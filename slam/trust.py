"""Blocks E and F of who corrects odometry, but takes it as it is until the walls refute it [III.F].

What corrects bad odometry makes good odometry worse: the first sightings of a wall are off by some tenths of a degree,
and so is the robot that is turned after them. So every sweep is localised twice, by odometry alone and by a rival that
corrects it (two models of one filter, after Magill 1965), until the rival explains what is seen so much better that its
poses, which have been there from the start, take the place of odometry's for good.

Must not know: how the rival does it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from slam.association import Association, Chains
from slam.config import Config
from slam.features import Wall
from slam.geometry import ORIGIN, Pose
from slam.graph.accounts import held_against, with_poses_of
from slam.graph.problem import Graph
from slam.localisation import Localisation, keep_prediction
from slam.motion import WheelErrors
from slam.self_calibration import Calibrated, Calibration
from slam.track import Rival, Track

Associate = Callable[[Calibrated, tuple[Wall, ...], Track, Config], Association]
Localise = Callable[[Calibrated, tuple[Wall, ...], Association, Track, Config], tuple[Localisation, Track, Calibration]]


@dataclass(frozen=True)
class Corrector:
    """Who corrects odometry, and how it tells of it.

    `account`: all sweeps and sightings as a graph at its own poses, from that of the sweep before and what it has made
    of this one. `laid`: the graph at odometry's poses, and the chains there, grown by this sweep as its own have grown;
    what was seen last before that sweep number has not changed.
    """

    associate: Associate
    localise: Localise
    account: Callable[[Graph, Track, Calibrated, tuple[Wall, ...], Config], Graph]
    laid: Callable[[Graph, Chains, Track, tuple[Wall, ...], int], tuple[Graph, Chains]]


@dataclass(frozen=True)
class Trusting:
    """Blocks E and F of a corrector that takes odometry as it is until `localisation.refuted`."""

    corrector: Corrector

    def associate(self, calibrated: Calibrated, walls: tuple[Wall, ...], track: Track, config: Config) -> Association:
        """The rival's, as long as there is one; where the walls are, odometry says then."""
        if _settled(track, config):
            return self.corrector.associate(calibrated, walls, track, config)
        rival, here = track.rival or Rival(), _as_it_is(track, calibrated)
        found = self.corrector.associate(_seen_by(rival, calibrated), walls, _track_of(rival), config)
        return _from(here, walls, found)

    def localise(
        self, calibrated: Calibrated, walls: tuple[Wall, ...], association: Association, track: Track, config: Config
    ) -> tuple[Localisation, Track, Calibration]:
        """Odometry's pose; where odometry is refuted, or was interrupted, the rival's, for all sweeps so far."""
        corrector = self.corrector
        if _settled(track, config):
            return corrector.localise(calibrated, walls, association, track, config)
        rival, here = track.rival or Rival(), _as_it_is(track, calibrated)
        seen = _seen_by(rival, calibrated)
        rivals = _from(seen.predicted, walls, association)
        found, after, learnt = corrector.localise(seen, walls, rivals, _track_of(rival), config)
        account = corrector.account(rival.graph, after, replace(seen, calibration=learnt), walls, config)
        first = max(0, len(track.poses) - config.graph.window + 1)
        graph, gained = held_against(with_poses_of(track.graph, account, here), account, first, config.graph)
        scan, enough = calibrated.kind == "scan", config.localisation
        if gained >= (enough.refuted if scan else enough.refuted_driving) or not calibrated.joined:
            return _overtaken(found, track, after), after, learnt
        graph, chains = corrector.laid(graph, track.chains, after, walls, first)
        rival = Rival(after.poses, after.chains, account, learnt.distance_scale, learnt.drift)
        kept = replace(keep_prediction(here, association, chains, config.localisation), merged=found.merged)
        return kept, Track((*track.poses, here), chains, graph, rival), calibrated.calibration


def _settled(track: Track, config: Config) -> bool:
    """Whether odometry was refuted before, or was never to be taken as it is."""
    return track.rival is None and (bool(track.poses) or not config.localisation.refuted)


def _track_of(rival: Rival) -> Track:
    return Track(rival.poses, rival.chains, rival.graph)


def _as_it_is(track: Track, calibrated: Calibrated) -> Pose:
    """Where odometry has the robot, without what was learnt of the wheels."""
    return _went_on(track.poses, calibrated, WheelErrors())


def _seen_by(rival: Rival, calibrated: Calibrated) -> Calibrated:
    """The sweep from where the rival has the robot, with what it has learnt of the wheels."""
    known = replace(calibrated.calibration, distance_scale=rival.distance_scale, drift=rival.drift)
    return replace(calibrated, predicted=_went_on(rival.poses, calibrated, known.wheels), calibration=known)


def _from(pose: Pose, walls: tuple[Wall, ...], association: Association) -> Association:
    """The association, its walls where they are if the robot is at that pose."""
    return replace(association, predicted=tuple(wall.segment.moved(pose) for wall in walls))


def _went_on(poses: tuple[Pose, ...], calibrated: Calibrated, errors: WheelErrors) -> Pose:
    if not poses:
        return ORIGIN
    motion = calibrated.motion
    return poses[-1] if motion is None else poses[-1].compose(motion.corrected(errors)).quantised()


def _overtaken(found: Localisation, before: Track, after: Track) -> Localisation:
    """What the rival found, with all poses that are others from now on."""
    both = enumerate(zip(before.poses, after.poses, strict=False))
    return replace(found, moved=tuple((k, now) for k, (was, now) in both if now != was))
