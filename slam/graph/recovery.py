"""Where else the robot may be when hardly a wall is where odometry puts it: the places that explain what it sees.

A wall taken for a line tells the turn; two walls that are not parallel, or a point, then tell the place. Every place so
found is held against all walls. Must not know: how sure odometry is, what becomes of the best one.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.dmath import DEGREE, Floats
from slam.geometry import wrap
from slam.graph.near import Near
from slam.graph.problem import looks

ALIKE_M, ALIKE_DEG = 0.05, 2.0
"""How far a wall is off the landmark it is, as seen from a place that only one or two walls tell: one σ."""
UNEXPLAINED = 9.0
"""χ² of a wall that nothing explains, and of a place at the border of what is in reach."""
ELSEWHERE_M, ELSEWHERE_DEG = 0.2, 5.0
"""Two places farther apart are not the same."""
SIDEWAYS = 0.35
"""Sine of the angle between two walls from which on they tell the place."""
BEYOND_M = 1.0
"""So far from where it was seen a line may go on."""
GRID_M = 0.03
"""Shifts nearer together are one."""


@dataclass(frozen=True)
class Reach:
    """How far off the robot may be: metres and radians."""

    shift: float
    turn: float


def places(near: Near, bearing: Floats, distance: Floats, pose: Floats, reach: Reach) -> tuple[Floats, Floats]:
    """The place that explains walls (n,) in F best and the best one elsewhere (≤ 2, 3), and what each costs in χ².

    `pose` (3,) is where odometry puts the robot; the farther off, the likelier must a place be.
    """
    found = _found(near, bearing + near.ring, distance, pose, reach)
    cost = _costs(near, bearing, distance, found)
    off = (found - pose) / np.maximum([reach.shift, reach.shift, reach.turn], 1e-6)
    cost = cost + UNEXPLAINED * np.cumsum(off * off, axis=1)[:, -1]
    chosen = [int(np.argmin(cost))]
    apart = found - found[chosen]
    elsewhere = (dmath.hypot(apart[:, 0], apart[:, 1]) > ELSEWHERE_M) | (np.abs(apart[:, 2]) > ELSEWHERE_DEG * DEGREE)
    if bool(elsewhere.any()):
        chosen.append(int(np.argmin(np.where(elsewhere, cost, np.inf))))
    return found[chosen], cost[chosen]


def _found(near: Near, bearing: Floats, distance: Floats, pose: Floats, reach: Reach) -> Floats:
    """Places (g, 3) within reach from which one or two of the walls are where landmarks are."""
    lines = near.line[near.as_line]
    turns = wrap(lines[None, :, 0] - (bearing[:, None] + float(pose[2]))).ravel()
    turns = np.unique(np.rint(turns[np.abs(turns) <= reach.turn] / DEGREE)) * DEGREE
    found = [pose[None]]
    for turn in [0.0, *turns.tolist()]:
        shifts = _shifts(near, bearing, distance, pose + np.array([0.0, 0.0, turn]))
        shifts = shifts[dmath.hypot(shifts[:, 0], shifts[:, 1]) <= reach.shift]
        shifts = np.unique(np.rint(shifts / GRID_M) + 0.0, axis=0) * GRID_M
        found.append(np.column_stack([pose[:2] + shifts, np.full(len(shifts), pose[2] + turn)]))
    return np.concatenate(found)


def _shifts(near: Near, bearing: Floats, distance: Floats, pose: Floats) -> Floats:
    """Shifts (s, 2) that bring walls onto landmarks, the robot being turned as in `pose`."""
    sine, cosine = dmath.sincos(bearing + float(pose[2]))
    points = near.point[near.as_point]
    far = (distance[:, None] + points[:, 2])[:, :, None] * np.stack([cosine, sine], axis=1)[:, None]
    onto_points = (points[None, :, :2] - (pose[:2] + far)).reshape(-1, 2)
    lines, anchor = near.line[near.as_line], near.anchor[near.as_line]
    turned = np.abs(wrap(lines[None, :, 0] - (bearing[:, None] + float(pose[2]))))
    of, line = np.nonzero(turned <= 2.0 * ALIKE_DEG * DEGREE)
    ny, nx = dmath.sincos(lines[line, 0])
    across = lines[line, 1] - (nx * (pose[0] - anchor[line, 0]) + ny * (pose[1] - anchor[line, 1])) - distance[of]
    onto_lines = across[:, None] * np.stack([nx, ny], axis=1)
    first, second = np.nonzero(of[:, None] < of[None, :])
    sideways = nx[first] * ny[second] - ny[first] * nx[second]
    clear = np.abs(sideways) >= SIDEWAYS
    first, second, sideways = first[clear], second[clear], sideways[clear]
    both = np.stack(
        [
            (across[first] * ny[second] - across[second] * ny[first]) / sideways,
            (across[second] * nx[first] - across[first] * nx[second]) / sideways,
        ],
        axis=1,
    )
    return np.concatenate([onto_lines, onto_points, both])


def _costs(near: Near, bearing: Floats, distance: Floats, there: Floats) -> Floats:
    """χ² of the walls from each of g places (g, 3): of each wall that of the landmark it fits best."""
    of = np.concatenate([near.as_line, near.as_point])
    is_point = np.arange(len(of)) >= len(near.as_line)
    count, size = len(there), len(of)
    many = np.tile(of, count)
    seen = looks(
        np.repeat(there, size, axis=0), np.tile(is_point, count), near.line[many], near.point[many],
        near.anchor[many], near.ring,
    )  # fmt: skip
    foot = -seen.by_landmark[:, 1, 0].reshape(count, size)[:, : len(near.as_line)]
    out_of_sight = np.zeros((count, size), dtype=bool)
    out_of_sight[:, : len(near.as_line)] = (foot < near.extent[:, 0] - BEYOND_M) | (foot > near.extent[:, 1] + BEYOND_M)
    b = wrap(bearing[None, :, None] - seen.bearing.reshape(count, 1, size)) / (ALIKE_DEG * DEGREE)
    d = (distance[None, :, None] - seen.distance.reshape(count, 1, size)) / ALIKE_M
    chi = np.where(out_of_sight[:, None, :], np.inf, b * b + d * d)
    chi = np.minimum(chi.min(axis=2, initial=UNEXPLAINED), UNEXPLAINED)
    return np.cumsum(chi, axis=1)[:, -1]
