"""How the robot got from one sweep to the next by odometry, and what is left once the wheels' errors are out.

A robot that scans turns in place, drives, and turns again: an error of its turns bends the drive between them, for the
drive begins half a turn after the reading that the sweep's frame is tied to.
"""

from dataclasses import dataclass

from slam import dmath
from slam.dmath import PI
from slam.geometry import Pose
from slam.sweep import TURN


@dataclass(frozen=True)
class WheelErrors:
    """True turn = (1 + `rotation`) × odometry's, distances likewise; `drift` rad of heading a metre on top of that."""

    rotation: float = 0.0
    distance: float = 0.0
    drift: float = 0.0


@dataclass(frozen=True)
class Wheels:
    """Raw odometry at a sweep: the pose of its frame F, and its first, reference and last reading's headings.

    The headings are in 1/TURN of a turn and not wrapped.
    """

    pose: Pose
    first: int
    reference: int
    last: int

    def motion_to(self, other: "Wheels") -> "Motion":
        """How the robot got from here to the next sweep of the same session."""
        step = self.pose.step_to(other.pose)
        turns = (self.last - self.reference, other.first - self.last, other.reference - other.first)
        before, between, after = (turn * (2.0 * PI / TURN) for turn in turns)
        return Motion(step.x, step.y, before, between, after)


@dataclass(frozen=True)
class Motion:
    """Raw odometry from one sweep's frame to the next one's: `x`, `y` m in the former, turns in rad, not wrapped.

    `before`: from the former's reference reading to its last one; `between` the two sweeps; `after`: from the
    latter's first reading to its reference reading.
    """

    x: float
    y: float
    before: float
    between: float
    after: float

    def corrected(self, errors: WheelErrors) -> Pose:
        """The step in the former frame, with these errors taken out [III.B]; the heading is not wrapped."""
        length = dmath.hypot(self.x, self.y)
        bend = errors.rotation * (self.before + 0.5 * self.between) + 0.5 * errors.drift * length
        turn = (1.0 + errors.rotation) * (self.before + self.between + self.after) + errors.drift * length
        sine, cosine = dmath.sincos(bend)
        x, y = cosine * self.x - sine * self.y, sine * self.x + cosine * self.y
        return Pose((1.0 + errors.distance) * x, (1.0 + errors.distance) * y, turn)
