"""What odometry says of two poses that follow one another, and how sure it is of it.

The robot turns, drives and turns again. Slip of the first turn bends the drive and turns what comes after it, so that
the errors across the drive and in heading go together; the residuals are made independent of one another.
"""

import numpy as np

from slam import dmath
from slam.dmath import DEGREE, PI, Floats
from slam.geometry import wrap
from slam.graph.config import GraphConfig
from slam.graph.problem import DISTANCE, DRIFT, ROTATION, Graph
from slam.sweep import Ints

UNJOINED = 0.01
"""The weight of a step that nobody knows: each standard deviation is a hundred times as large."""


def motion_residuals(graph: Graph, sweeps: Ints, config: GraphConfig) -> tuple[Floats, Floats, Floats, Floats]:
    """Of the steps that led to these sweeps (s,): what odometry leaves over (s, 3), in standard deviations.

    Along the drive, across it, and in heading; and its derivatives by the former pose, the latter (s, 3, 3) and the
    errors (s, 3, 4).
    """
    x, y, before, between, after = (graph.motions[sweeps, k] for k in range(5))
    errors = graph.errors.tolist()
    length = dmath.hypot(x, y)
    arm, turned = before + 0.5 * between, before + between + after
    sine, cosine = dmath.sincos(errors[ROTATION] * arm + 0.5 * errors[DRIFT] * length)
    rx, ry = cosine * x - sine * y, sine * x + cosine * y
    dx, dy = (1.0 + errors[DISTANCE]) * rx, (1.0 + errors[DISTANCE]) * ry
    turn = (1.0 + errors[ROTATION]) * turned + errors[DRIFT] * length
    former, latter = graph.poses[sweeps - 1], graph.poses[sweeps]
    sine, cosine = dmath.sincos(former[:, 2])
    wx, wy = latter[:, 0] - former[:, 0], latter[:, 1] - former[:, 1]
    gx, gy = cosine * wx + sine * wy, cosine * wy - sine * wx
    zero, one = np.zeros(len(length)), np.ones(len(length))
    columns = [
        [gx - dx, gy - dy, wrap(latter[:, 2] - former[:, 2] - turn)],
        [-cosine, sine, zero],
        [-sine, -cosine, zero],
        [gy, -gx, -one],
        [cosine, -sine, zero],
        [sine, cosine, zero],
        [zero, zero, one],
        [dy * arm, -dx * arm, -turned],
        [-rx, -ry, zero],
        [0.5 * dy * length, -0.5 * dx * length, -length],
        [zero, zero, zero],
    ]
    whole = np.stack([np.stack(column, axis=1) for column in columns], axis=2)  # (s, 3, 11)
    white = _whitened(whole, graph, sweeps, np.stack([dx, dy], axis=1), config)
    return white[:, :, 0], white[:, :, 1:4], white[:, :, 4:7], white[:, :, 7:11]


def _whitened(rows: Floats, graph: Graph, sweeps: Ints, drive: Floats, config: GraphConfig) -> Floats:
    """Rows (s, 3, c) of x, y, heading as rows along the drive, across it, and heading, in standard deviations."""
    before, between, after = (np.abs(graph.motions[sweeps, k]) / (2.0 * PI) for k in (2, 3, 4))
    length = dmath.hypot(drive[:, 0], drive[:, 1])
    turn, metre = (config.slip_turn_deg * DEGREE), (config.slip_metre_deg * DEGREE)
    early = turn * turn * (before + 0.5 * between) + 0.25 * metre * metre * length
    late = turn * turn * (after + 0.5 * between) + 0.75 * metre * metre * length
    late += config.heading_sigma_deg * DEGREE * (config.heading_sigma_deg * DEGREE)
    along = config.step_sigma_m * config.step_sigma_m + config.step_sigma * config.step_sigma * length * length
    across = config.step_sigma_m * config.step_sigma_m + length * length * early
    gain = length * early / across
    heading = early + late - gain * gain * across
    moved = length > 1e-6
    ux = np.where(moved, drive[:, 0] / np.where(moved, length, 1.0), 1.0)[:, None]
    uy = np.where(moved, drive[:, 1] / np.where(moved, length, 1.0), 0.0)[:, None]
    sure = np.where(graph.joined[sweeps] != 0, 1.0, UNJOINED)[:, None]
    beside = ux * rows[:, 1] - uy * rows[:, 0]
    white = [
        (ux * rows[:, 0] + uy * rows[:, 1]) / np.sqrt(along)[:, None],
        beside / np.sqrt(across)[:, None],
        (rows[:, 2] - gain[:, None] * beside) / np.sqrt(heading)[:, None],
    ]
    return np.stack([part * sure for part in white], axis=1)
