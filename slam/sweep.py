"""What the pipeline takes: one 360° scan (or one stretch of driving) as integers, and where the sonars sit.

Must not know: where the readings came from, packets, files, clocks.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slam.errors import SlamError

TURN = 1 << 20
"""Heading units a full turn: 256 for each of the robot's own 4096."""

Ints = NDArray[np.int64]
SweepKind = Literal["scan", "driving"]


@dataclass(frozen=True)
class Mounting:
    """One sonar on the robot: metres and radians in the robot's frame (x forward, y left, +ccw)."""

    x: float
    y: float
    heading: float


@dataclass(frozen=True)
class SonarRing:
    """All sonars of a robot; a reading's `sonar` indexes `mountings`."""

    mountings: tuple[Mounting, ...]
    half_beam: float  # rad
    max_range_mm: int  # this much or more is no echo


@dataclass(frozen=True)
class Sweep:
    """Readings of one sweep in order of firing, each with the robot's raw odometry at its own moment.

    All arrays are int64 of shape (n,). `x_um`, `y_um` in micrometres and `heading` in 1/TURN of a turn are the
    odometry frame's, unwrapped; `reference` is the index of the reading whose pose is the sweep's frame F.
    Odometry of two sessions is not connected (a reset, a gap).
    """

    kind: SweepKind
    session: int
    reference: int
    t_ns: Ints
    sonar: Ints
    range_mm: Ints
    x_um: Ints
    y_um: Ints
    heading: Ints

    def __post_init__(self) -> None:
        arrays = (self.t_ns, self.sonar, self.range_mm, self.x_um, self.y_um, self.heading)
        if any(array.shape != self.t_ns.shape or array.dtype != np.int64 for array in arrays):
            raise SlamError("a sweep's arrays must be int64 of one length")
        if not 0 <= self.reference < len(self.t_ns):
            raise SlamError(f"reading {self.reference} cannot be the reference of a sweep of {len(self.t_ns)}")

    def __len__(self) -> int:
        return len(self.t_ns)
