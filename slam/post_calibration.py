"""Block G, post-localisation calibration: all that the sweep saw, from the corrected pose [III.G]."""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.features import Features
from slam.geometry import Pose, Segment, segment
from slam.reliability import Rcd, Reliability
from slam.self_calibration import Calibrated


@dataclass(frozen=True)
class Posed:
    """The sweep in the map frame, metres.

    `walls` in the order of the features; `rcds` every RCD as the segment it would be; `corners` (x, y) points;
    `origins` (n, 2) where each beam starts, `echoes` (n, 2) where it ends on its axis.
    """

    pose: Pose
    walls: tuple[Segment, ...]
    rcds: tuple[Segment, ...]
    corners: tuple[tuple[float, float], ...]
    origins: Floats
    echoes: Floats


def post_calibrate(calibrated: Calibrated, reliability: Reliability, features: Features, pose: Pose) -> Posed:
    """Everything that the sweep saw, recomputed from the pose found."""
    beams = calibrated.beams
    sine, cosine = dmath.sincos(beams.axis)
    reach = beams.origin + np.stack([beams.distance * cosine, beams.distance * sine], axis=1)
    corners = np.array([corner.point for corner in features.corners]).reshape(-1, 2)
    return Posed(
        pose=pose,
        walls=tuple(wall.segment.moved(pose) for wall in features.walls),
        rcds=tuple(_as_segment(rcd).moved(pose) for rcd in reliability.rcds),
        corners=tuple((x, y) for x, y in pose.points(corners).tolist()),
        origins=pose.points(beams.origin),
        echoes=pose.points(reach),
    )


def _as_segment(rcd: Rcd) -> Segment:
    return segment(rcd.bearing, rcd.distance, rcd.left, rcd.right)
