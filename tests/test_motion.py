"""What is left of odometry's step once the wheels' errors are out: examples worked by hand."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.geometry import Pose
from slam.motion import Motion, WheelErrors, Wheels
from slam.sweep import TURN

PI = math.pi


def step(motion: Motion, **errors: float) -> tuple[float, float, float]:
    found = motion.corrected(WheelErrors(**errors))
    return found.x, found.y, found.theta


@pytest.mark.parametrize(
    ("motion", "errors", "expected"),
    [
        (Motion(0.8, 0.0, PI, 0.0, PI), {}, (0.8, 0.0, 2 * PI)),
        (Motion(0.8, 0.0, PI, 0.0, PI), {"distance": 0.025}, (0.82, 0.0, 2 * PI)),
        # Two scans to the left: half a turn before the drive, which bends it by 1.8°, and half a turn after it.
        (
            Motion(1.0, 0.0, PI, 0.0, PI),
            {"rotation": 0.01},
            (math.cos(0.01 * PI), math.sin(0.01 * PI), 2 * PI * 1.01),
        ),
        # To the left, then to the right: the turn of the second takes back that of the first, the drive stays bent.
        (Motion(1.0, 0.0, PI, 0.0, -PI), {"rotation": 0.01}, (math.cos(0.01 * PI), math.sin(0.01 * PI), 0.0)),
        # To the right first: bent to the other side.
        (Motion(1.0, 0.0, -PI, 0.0, PI), {"rotation": 0.01}, (math.cos(0.01 * PI), -math.sin(0.01 * PI), 0.0)),
        # A turn between the sweeps counts half before the drive, half after it.
        (
            Motion(1.0, 0.0, 0.0, PI / 2, 0.0),
            {"rotation": 0.02},
            (math.cos(0.005 * PI), math.sin(0.005 * PI), 0.51 * PI),
        ),
        # 0.1 rad a metre: an arc, whose chord is turned by half of its angle.
        (Motion(2.0, 0.0, 0.0, 0.0, 0.0), {"drift": 0.1}, (2 * math.cos(0.1), 2 * math.sin(0.1), 0.2)),
        (Motion(0.0, -1.0, 0.0, 0.0, 0.0), {"drift": 0.2}, (math.sin(0.1), -math.cos(0.1), 0.2)),
    ],
)  # fmt: skip
def test_by_hand(motion: Motion, errors: dict[str, float], expected: tuple[float, float, float]) -> None:
    assert step(motion, **errors) == pytest.approx(expected, abs=1e-12)


def test_turns_are_counted_and_not_wrapped() -> None:
    """A robot that turned left by 360° in each scan has turned, whatever its heading says."""
    half = TURN // 2
    former = Wheels(Pose(0.0, 0.0, 0.0), -half, 0, half)
    latter = Wheels(Pose(0.8, 0.0, 0.0), half, TURN, TURN + half)
    motion = former.motion_to(latter)
    assert (motion.x, motion.y) == pytest.approx((0.8, 0.0))
    assert (motion.before, motion.between, motion.after) == pytest.approx((PI, 0.0, PI))
    assert step(motion, rotation=-0.01)[2] == pytest.approx(2 * PI * 0.99)


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(-7, 7), st.floats(-1, 1), st.floats(-7, 7))
def test_no_error_changes_nothing(x: float, y: float, before: float, between: float, after: float) -> None:
    assert step(Motion(x, y, before, between, after)) == pytest.approx((x, y, before + between + after), abs=1e-12)
