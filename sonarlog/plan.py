"""The plan of a recording: who drives, which robot it is, when to end.

Must not know: the line, the file, how any of it is done.
"""

from collections.abc import Callable
from dataclasses import dataclass

from sonarlog.log import Surfaces
from sonarlog.moves import Mover
from sonarlog.robot import Robot
from sonarlog.route import Route

SECOND = 1_000_000_000


@dataclass(frozen=True)
class Plan:
    """What to record. `route` None: without moving. `robot` None: the one the robot says it is.

    `mover` makes whoever drives, instead of a route; with `recovers` it sees to stalls and bumps itself. `rate`: how
    much faster than real time a simulator at the port runs; 1 for everything real. `real`: a simulator is refused.
    `surfaces`: the true ones, where the robot's world is a file; those of our own worlds are known by name.
    """

    route: Route | None = None
    robot: Robot | None = None
    mover: Callable[[Robot], Mover] | None = None
    recovers: bool = False
    speed_mm_s: float = 300.0
    limit_ns: int | None = None
    rate: float = 1.0
    real: bool = False
    surfaces: Surfaces | None = None

    @property
    def drives(self) -> bool:
        """Whether the robot is to move."""
        return self.route is not None or self.mover is not None

    @property
    def patience_ns(self) -> int:
        """A second of real time, in robot time: how long an answer may take."""
        return int(SECOND * max(1.0, self.rate))
