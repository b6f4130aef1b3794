"""What odometry says of two poses that follow one another, and how sure it is of it.

The robot turns, drives and turns again. Slip of the first turn bends the drive and turns what comes after it, so that
the errors across the drive and in heading go together; the residuals are made independent of one another.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.dmath import DEGREE, PI, Floats
from slam.geometry import GRAIN, quantise, wrap
from slam.graph.config import GraphConfig
from slam.graph.problem import Graph
from slam.sweep import Ints

UNJOINED = 0.01
"""The weight of a step that nobody knows: each standard deviation is a hundred times as large."""

SOUND = 1.0
"""So many steps that slip as is usual are taken to be known before the first."""


@dataclass(frozen=True)
class Steps:
    """What odometry says of s steps, ready to be held against poses and errors time and again.

    `sweeps` (s,) they led to; the raw step's `length` m and `direction` rad in the former frame; `arm`, the turn that
    bends the drive, and `turned`, all of it. `scale` (s, 3) is 1/σ along the drive, across it, and of the heading, once
    `gain` × what is across is taken out of that.
    """

    sweeps: Ints
    length: Floats
    direction: Floats
    arm: Floats
    turned: Floats
    gain: Floats
    scale: Floats

    @classmethod
    def of(cls, graph: Graph, sweeps: Ints, config: GraphConfig) -> "Steps":
        """The steps that led to these sweeps (s,)."""
        x, y, before, between, after = graph.motions[sweeps].T
        length, direction = dmath.hypot(x, y), dmath.atan2(y, x)
        first, middle, last = np.abs(graph.motions[sweeps, 2:]).T / (2.0 * PI)
        turn, metre = config.slip_turn_deg * DEGREE, config.slip_metre_deg * DEGREE
        own, step, part = config.heading_sigma_deg * DEGREE, config.step_sigma_m, config.step_sigma
        turn, metre = graph.slip * turn, graph.slip * metre
        early = turn * turn * (first + 0.5 * middle) + 0.25 * metre * metre * length
        late = turn * turn * (last + 0.5 * middle) + 0.75 * metre * metre * length + own * own
        along, across = step * step + part * part * length * length, step * step + length * length * early
        gain = length * early / across
        sigma = np.sqrt(np.stack([along, across, early + late - gain * gain * across], axis=1))
        sure = np.where(graph.joined[sweeps] != 0, 1.0, UNJOINED)[:, None]
        return cls(
            sweeps, length, direction, before + 0.5 * between, before + between + after, gain, sure / sigma
        )  # fmt: skip

    def residuals(self, poses: Floats, errors: Floats) -> Floats:
        """What odometry leaves over, in standard deviations, and its derivatives: (s, 3, 11).

        Rows: along the drive, across it, and in heading. Columns: by the former pose (3), by the latter (3), by the
        errors (4), and the residual itself.
        """
        rotation, stretch, drift, _ = errors.tolist()
        former, latter = poses[self.sweeps - 1], poses[self.sweeps]
        bend = rotation * self.arm + 0.5 * drift * self.length
        sine, cosine = dmath.sincos(former[:, 2] + bend + self.direction)
        wx, wy = latter[:, 0] - former[:, 0], latter[:, 1] - former[:, 1]
        along, across = cosine * wx + sine * wy, cosine * wy - sine * wx
        turn = (1.0 + rotation) * self.turned + drift * self.length
        whole = np.zeros((len(along), 3, 11))
        whole[:, 0, 3], whole[:, 0, 4], whole[:, 1, 3], whole[:, 1, 4], whole[:, 2, 5] = (
            cosine,
            sine,
            -sine,
            cosine,
            1.0,
        )
        whole[:, :2, :2] = -whole[:, :2, 3:5]
        # Whatever turns the drive turns what is along it into what is across.
        whole[:, 0, 2], whole[:, 1, 2], whole[:, 2, 2] = across, -along, -1.0
        whole[:, :2, 6] = whole[:, :2, 2] * self.arm[:, None]
        whole[:, :2, 8] = whole[:, :2, 2] * (0.5 * self.length)[:, None]
        whole[:, 2, 6], whole[:, 0, 7], whole[:, 2, 8] = -self.turned, -self.length, -self.length
        whole[:, 0, 10], whole[:, 1, 10] = along - (1.0 + stretch) * self.length, across
        whole[:, 2, 10] = wrap(latter[:, 2] - former[:, 2] - turn)
        whole[:, 2] -= self.gain[:, None] * whole[:, 1]
        return np.asarray(whole * self.scale[:, :, None])


def motion_residuals(graph: Graph, sweeps: Ints, config: GraphConfig) -> tuple[Floats, Floats, Floats, Floats]:
    """What `Steps.residuals` says of the steps to these sweeps (s,) where everything is now.

    The residuals (s, 3); their derivatives by the former pose, the latter (s, 3, 3) and the errors (s, 3, 4).
    """
    whole = Steps.of(graph, sweeps, config).residuals(graph.poses, graph.errors)
    return whole[:, :, 10], whole[:, :, :3], whole[:, :, 3:6], whole[:, :, 6:10]


def slip(graph: Graph, config: GraphConfig) -> float:
    """By how much odometry slips more than is usual, as the last poses show; 1 where it does not.

    The root mean square of what it leaves over in heading, over σ; the wildest step is left out, for a robot that was
    turned by hand once slips no more than before.
    """
    count = len(graph.poses)
    sweeps = np.arange(max(1, count - config.window), count)
    sweeps = sweeps[graph.joined[sweeps] != 0]
    x, y, before, between, after = graph.motions[sweeps].T
    length, turns = dmath.hypot(x, y), (np.abs(before) + np.abs(between) + np.abs(after)) / (2.0 * PI)
    rotation, _, drift, _ = graph.errors.tolist()
    expected = (1.0 + rotation) * (before + between + after) + drift * length
    off = wrap(graph.poses[sweeps, 2] - graph.poses[sweeps - 1, 2] - expected) / DEGREE
    turn, metre, own = config.slip_turn_deg, config.slip_metre_deg, config.heading_sigma_deg
    squares = np.sort(off * off / (turn * turn * turns + metre * metre * length + own * own))[:-1]
    return max(1.0, quantise(dmath.sqrt((dmath.total(squares) + SOUND) / (float(len(squares)) + SOUND)), GRAIN))
