"""Odometry as it is, and a rival beside it that corrects it: what both have of a sweep, and how the one overtakes.

What corrects bad odometry makes good odometry worse: the first sightings of a wall are off by some tenths of a degree,
and so is the robot that is turned after them. So every sweep is localised twice, by odometry alone and by the rival
(two models of one filter, after Magill 1965), until the walls refute odometry; from then on all poses are the rival's.

Must not know: how walls are weighed, what refutes odometry.
"""

from dataclasses import replace

from slam.association import Association
from slam.features import Wall
from slam.geometry import ORIGIN, Pose
from slam.localisation import Localisation
from slam.motion import WheelErrors
from slam.self_calibration import Calibrated
from slam.track import Rival, Track


def settled(track: Track, refuted: float) -> bool:
    """Whether odometry was refuted before, or is to be corrected from the start (`refuted` 0)."""
    return track.rival is None and (bool(track.poses) or not refuted)


def track_of(rival: Rival) -> Track:
    """The sweeps so far as the rival has them."""
    return Track(rival.poses, rival.chains, rival.graph)


def as_it_is(track: Track, calibrated: Calibrated) -> Calibrated:
    """The sweep from where odometry has the robot, without what was learnt of the wheels."""
    return replace(calibrated, predicted=_went_on(track.poses, calibrated, WheelErrors()))


def seen_by(rival: Rival, calibrated: Calibrated) -> Calibrated:
    """The sweep from where the rival has the robot, with what it has learnt of the wheels."""
    known = replace(calibrated.calibration, distance_scale=rival.distance_scale, drift=rival.drift)
    return replace(calibrated, predicted=_went_on(rival.poses, calibrated, known.wheels), calibration=known)


def laid_at(pose: Pose, walls: tuple[Wall, ...], association: Association) -> Association:
    """The rival's association, its walls where they are if the robot is at that pose."""
    return replace(association, predicted=tuple(wall.segment.moved(pose) for wall in walls))


def overtaken(found: Localisation, before: Track, after: Track) -> Localisation:
    """What the rival found, with all poses that are others from now on."""
    both = enumerate(zip(before.poses, after.poses, strict=False))
    return replace(found, moved=tuple((k, now) for k, (was, now) in both if now != was))


def _went_on(poses: tuple[Pose, ...], calibrated: Calibrated, errors: WheelErrors) -> Pose:
    if not poses:
        return ORIGIN
    motion = calibrated.motion
    return poses[-1] if motion is None else poses[-1].compose(motion.corrected(errors)).quantised()
