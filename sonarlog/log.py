"""A decoded log: what every kind of recording comes down to before sweeps are cut from it.

Made from `/wire` bytes, from ROS 2 topics, or from imported text; nothing after this file knows which.
"""

import json
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sonarlog.robot import Robot

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Odometry:
    """The robot's own dead reckoning, one row a packet, unwrapped; int64 of shape (n,).

    `x_um`, `y_um`: micrometres; `heading`: 1/2^20 of a turn; `session` grows by one after each reset or gap that
    odometry cannot bridge.
    """

    t_ns: Ints
    x_um: Ints
    y_um: Ints
    heading: Ints
    session: Ints


@dataclass(frozen=True)
class Readings:
    """New sonar readings in order of firing, each at its own moment; int64 of shape (n,)."""

    t_ns: Ints
    sonar: Ints
    range_mm: Ints
    x_um: Ints
    y_um: Ints
    heading: Ints
    session: Ints


@dataclass(frozen=True)
class Truth:
    """Where a simulator knows the robot to have been: t (n,) ns, pose (n, 3) of x m, y m, heading rad."""

    t_ns: Ints
    pose: Floats


@dataclass(frozen=True)
class Surfaces:
    """The true surfaces of the place, in the frame of the robot's first pose.

    segments: (n, 4) metres, x0 y0 x1 y1. poles: (m, 3) metres, x y radius.
    """

    world: str
    segments: Floats
    poles: Floats

    def to_json(self) -> bytes:
        """As kept in recordings and runs."""
        data = {"world": self.world, "segments": self.segments.tolist(), "poles": self.poles.tolist()}
        return json.dumps(data).encode()

    @classmethod
    def from_json(cls, text: bytes) -> "Surfaces":
        """The inverse of `to_json`."""
        data = json.loads(text)
        segments = np.array(data["segments"], dtype=np.float64).reshape(-1, 4)
        return cls(data["world"], segments, np.array(data["poles"], dtype=np.float64).reshape(-1, 3))


@dataclass(frozen=True)
class Event:
    """Something that happened while recording, as in `/rosout`."""

    t_ns: int
    level: str  # "info", "warn", "error"
    text: str


@dataclass(frozen=True)
class Log:
    """One recording, decoded. `counts` says what was used and what was left out, by name."""

    robot: Robot
    odometry: Odometry
    readings: Readings
    truth: Truth | None = None
    surfaces: Surfaces | None = None
    events: tuple[Event, ...] = ()
    decisions: tuple[str, ...] = ()  # of an exploration, as JSON in order of time
    counts: dict[str, int] = field(default_factory=dict)
    missing: tuple[str, ...] = ()  # what a damaged file no longer holds, in sentences
    digest: str = ""  # of what was recorded: see `sonarlog.recording.recording_digest`
