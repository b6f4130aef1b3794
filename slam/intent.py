"""What block I remembers from decision to decision: what it went for, and where there was no getting through.

Whether the robot got through is seen from where it scans next, so that a replay remembers the same.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.geometry import Pose

Point = tuple[float, float]

PATIENCE = 3
"""So often the robot tries again what it could not reach, when there is nothing else to do."""

ARRIVED_M = 0.30
"""A robot that scans so near to where it was sent to has arrived."""

ASTRAY_M = 0.50
"""So far off its path, someone else sent it somewhere."""

BEFORE_M = 0.35
"""So far before its centre stands what stopped it."""


@dataclass(frozen=True)
class Block:
    """Something stood at (x, y) when sweep number `sweep` was made, and `times` by then."""

    x: float
    y: float
    sweep: int
    times: int = 1


@dataclass(frozen=True)
class Intent:
    """The goal that was chosen last, and the way (k, 2) to where the next scan is due.

    `blocks` were in the way before, and the goals at `vain` were not reached for them.
    """

    goal: Point | None = None
    leg: Floats | None = None
    blocks: tuple[Block, ...] = ()
    vain: tuple[Block, ...] = ()

    def after(self, pose: Pose, sweep: int, keep: int) -> "Intent":
        """What is known to be in the way, now that the robot is here; forgotten after `keep` sweeps."""
        blocks, vain = (
            tuple(each for each in known if sweep - each.sweep <= keep or each.times >= PATIENCE)
            for known in (self.blocks, self.vain)
        )
        point = _stopped_by(self.leg, pose)
        if point is not None:
            blocks = _noted(blocks, point, sweep)
            vain = _noted(vain, self.goal or point, sweep)
        return replace(self, blocks=blocks, vain=vain)

    def forgiving(self) -> "Intent":
        """With only what was tried often enough."""
        blocks, vain = (tuple(each for each in known if each.times >= PATIENCE) for known in (self.blocks, self.vain))
        return replace(self, blocks=blocks, vain=vain)


def _noted(known: tuple[Block, ...], point: Point, sweep: int) -> tuple[Block, ...]:
    same = [each for each in known if dmath.hypot(each.x - point[0], each.y - point[1]) < BEFORE_M]
    if not same:
        return (*known, Block(*point, sweep))
    again = replace(same[0], sweep=sweep, times=same[0].times + 1)
    return tuple(again if each is same[0] else each for each in known)


def _stopped_by(leg: Floats | None, pose: Pose) -> Point | None:
    """Where on its way stands what stopped the robot; None if it arrived, or went a way of its own."""
    if leg is None or len(leg) < 2:
        return None
    off = dmath.hypot(leg[:, 0] - pose.x, leg[:, 1] - pose.y)
    if off[-1] < ARRIVED_M or off.min() > ASTRAY_M:
        return None
    at = int(np.argmin(off))
    ahead = np.flatnonzero(off[at:] >= BEFORE_M)
    x, y = leg[at + int(ahead[0]) if len(ahead) else -1].tolist()
    return x, y
