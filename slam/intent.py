"""What block I remembers from decision to decision: what it went for, and where there was no getting through.

Whether the robot got through is seen from where it scans next, so that a replay remembers the same.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.geometry import ORIGIN, Pose
from slam.prospects import Left
from slam.roads import Roads
from slam.sweep import Ints
from slam.window import Window

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

    `blocks` were in the way before, and the goals at `vain` were not reached for them. `trail` (n, 3) is where the
    robot has driven: number of the sweep before, and the point in that sweep's frame F. `past` were blocks, `heard`
    (n,) are the circles about the last sweeps. `left` is what was left behind outside of the last `window`.
    """

    goal: Point | None = None
    leg: Floats | None = None
    blocks: tuple[Block, ...] = ()
    vain: tuple[Block, ...] = ()
    trail: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    past: tuple[Block, ...] = ()
    heard: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    left: Left = field(default_factory=Left)
    roads: Roads = field(default_factory=Roads)
    window: Window | None = None

    def after(self, poses: tuple[Pose, ...], keep: int) -> "Intent":
        """What is known to be in the way, with the robot at the last of `poses`; forgotten after `keep` sweeps."""
        pose, sweep = poses[-1], len(poses) - 1
        blocks, vain = (
            tuple(each for each in known if sweep - each.sweep <= keep or each.times >= PATIENCE)
            for known in (self.blocks, self.vain)
        )
        past = (*self.past, *(each for each in self.blocks if each not in blocks))
        point = _stopped_by(self.leg, pose)
        if point is not None:
            # A step that is hardly one tells that there is no getting there, not what stands where.
            if _length(self.leg) >= BEFORE_M:
                blocks, past = _noted(blocks, past, point, sweep)
            vain, _ = _noted(vain, (), self.goal or point, sweep)
        return replace(self, blocks=blocks, vain=vain, past=past, trail=self._extended(poses))

    def _extended(self, poses: tuple[Pose, ...]) -> Floats:
        """The trail, with what was driven of the last leg."""
        if self.leg is None or len(poses) < 2:
            return self.trail
        off = dmath.hypot(self.leg[:, 0] - poses[-1].x, self.leg[:, 1] - poses[-1].y)
        if off.min() > ASTRAY_M:
            return self.trail
        driven = poses[-2].step_to(ORIGIN).points(self.leg[: int(np.argmin(off)) + 1 : 2])
        sweep = np.full((len(driven), 1), float(len(poses) - 2))
        return np.concatenate([self.trail, np.concatenate([sweep, driven], axis=1)])

    def driven(self, poses: Floats) -> Floats:
        """The trail's points (n, 2) in the map, by the poses (k, 3) as known now."""
        scan, x, y = self.trail[:, 0].astype(np.int64), self.trail[:, 1], self.trail[:, 2]
        sine, cosine = (turned[scan] for turned in dmath.sincos(poses[:, 2]))
        return np.stack([poses[scan, 0] + (cosine * x - sine * y), poses[scan, 1] + (sine * x + cosine * y)], axis=1)

    def forgiving(self) -> "Intent":
        """Believing only in what was met often enough, but remembering the blocks."""
        kept, vain = (tuple(each for each in known if each.times >= PATIENCE) for known in (self.blocks, self.vain))
        past = (*self.past, *(each for each in self.blocks if each not in kept))
        return replace(self, blocks=kept, vain=vain, past=past)

    def hearing(self, cells: int) -> "Intent":
        """With the circle about the last sweep."""
        return replace(self, heard=np.append(self.heard, np.int64(cells)))


def _noted(
    known: tuple[Block, ...], past: tuple[Block, ...], point: Point, sweep: int
) -> tuple[tuple[Block, ...], tuple[Block, ...]]:
    """Both with something at the point: counted once more where something was known there, or had been."""
    for blocks in (known, past):
        same = [each for each in blocks if dmath.hypot(each.x - point[0], each.y - point[1]) < BEFORE_M]
        if same:
            again = replace(same[0], sweep=sweep, times=same[0].times + 1)
            known, past = (tuple(each for each in some if each is not same[0]) for some in (known, past))
            return (*known, again), past
    return (*known, Block(*point, sweep)), past


def _length(leg: Floats | None) -> float:
    """From one end to the other, metres."""
    return 0.0 if leg is None else float(dmath.hypot(leg[-1, 0] - leg[0, 0], leg[-1, 1] - leg[0, 1]))


def _stopped_by(leg: Floats | None, pose: Pose) -> Point | None:
    """Where on its way stands what stopped the robot; None if it arrived, or went a way of its own."""
    if leg is None or len(leg) < 2:
        return None
    off = dmath.hypot(leg[:, 0] - pose.x, leg[:, 1] - pose.y)
    if off[-1] < min(ARRIVED_M, 0.5 * _length(leg)) or off.min() > ASTRAY_M:
        return None
    at = int(np.argmin(off))
    ahead = np.flatnonzero(off[at:] >= BEFORE_M)
    x, y = leg[at + int(ahead[0]) if len(ahead) else -1].tolist()
    return x, y
