"""Block F, local localisation: turn, then shift the robot until its walls lie on the roots of their chains [III.F].

Where a corridor leaves the place along it unobservable the distance to the roots has a valley, and its strict minimum
walks to the border of the window at every station. A small price on the length of the shift keeps the robot where
odometry put it unless the walls say otherwise.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.association import POINT, WALL, Association, Chains
from slam.dmath import DEGREE, Floats
from slam.geometry import Pose, Segment, wrap

GRAIN = float(1 << 30)
"""Costs are compared in multiples of 1/GRAIN: what is equal on paper is equal here."""


@dataclass(frozen=True)
class LocalisationConfig:
    """The search: angle step, N × N cells, and the price of a metre of shift (0: the paper's strict minimum).

    Odometry is taken as it is until a correction explains what is seen better by `refuted` in χ² (0: it never is); by
    `refuted_driving` where the robot looks while it drives: such bearings are no worse than their σ, those of a scan
    share their errors.
    """

    angle_step_deg: float = 1.0
    window: int = 11
    cell_m: float = 0.05
    shift_price: float = 0.1
    refuted: float = 0.0
    refuted_driving: float = 9.0


@dataclass(frozen=True)
class Localisation:
    """The corrected pose and how it was found: turn ψ and shift from the prediction, and what was left over.

    `mean_turn_deg` is the paper's Avg_ang_diff; `d1_before`, `d1_after` are mean distances to the roots in metres.
    `moved` are earlier sweeps whose poses are known better now, `merged` chains that turned out to be one (kept, gone).
    """

    pose: Pose
    turn_deg: float
    shift: tuple[float, float]
    mean_turn_deg: float
    d1_before: float
    d1_after: float
    walls_used: int
    moved: tuple[tuple[int, Pose], ...] = ()
    merged: tuple[tuple[int, int], ...] = ()


def keep_prediction(
    predicted: Pose, association: Association, chains: Chains, config: LocalisationConfig
) -> Localisation:
    """No correction: raw odometry, as in the paper's figures 8 and 11."""
    return Localisation(predicted, 0.0, (0.0, 0.0), 0.0, 0.0, 0.0, 0)


def search(predicted: Pose, association: Association, chains: Chains, config: LocalisationConfig) -> Localisation:
    """The paper's search over orientations, then over the cells of a window. No associated wall, no correction.

    Points say nothing of the orientation, and features whose nature is not told yet only where no wall does.
    """
    links = [link for link in association.links if link.nature != POINT]
    if not links:
        return keep_prediction(predicted, association, chains, config)
    walls = [association.predicted[link.wall] for link in links]
    roots = [chains.root(link.chain) for link in links]
    sure = [k for k, link in enumerate(links) if link.nature == WALL] or range(len(links))
    differences = np.array([wrap(walls[k].alpha - roots[k].alpha) for k in sure]) / DEGREE
    average, turn = best_turn(differences, config.angle_step_deg)
    turned = Pose(predicted.x, predicted.y, predicted.theta + turn * DEGREE)
    here = Pose(predicted.x, predicted.y, 0.0)
    spun = [w.moved(Pose(-here.x, -here.y, 0.0)).moved(Pose(0.0, 0.0, turn * DEGREE)).moved(here) for w in walls]
    shift, before, after = best_shift(spun, roots, config)
    pose = Pose(turned.x + shift[0], turned.y + shift[1], turned.theta).quantised()
    return Localisation(pose, turn, shift, average, before, after, len(walls))


def best_turn(differences_deg: Floats, step_deg: float = 1.0) -> tuple[float, float]:
    """Avg_ang_diff and the turn ψ in [−n, n] degrees, n = ⌊Avg_ang_diff⌋, that leaves the smallest mean angle.

    `differences_deg` (n,) are current minus root; of equal turns the smaller |ψ| wins, then the negative one.
    """
    average = dmath.mean(np.abs(differences_deg))
    steps = int((average + 1e-9) / step_deg)
    best = (0.0, 0.0, 0.0)
    for k in range(-steps, steps + 1):
        turn = k * step_deg
        cost = float(np.rint(dmath.mean(np.abs(differences_deg + turn)) * GRAIN))
        if k == -steps or (cost, abs(turn)) < best[:2]:
            best = (cost, abs(turn), turn)
    return average, best[2]


def best_shift(
    walls: list[Segment], roots: list[Segment], config: LocalisationConfig
) -> tuple[tuple[float, float], float, float]:
    """The shift in metres over the window that brings the walls nearest to their roots; mean d1 before and after.

    Of equal costs the smaller shift wins, then row order (x first); with price 0, row order alone.
    """
    half = config.window // 2
    steps = np.arange(-half, half + 1).astype(np.float64) * config.cell_m
    dx, dy = np.repeat(steps, len(steps)), np.tile(steps, len(steps))
    d1 = np.zeros(len(dx))
    for wall, root in zip(walls, roots, strict=True):
        sine, cosine = dmath.sincos(root.alpha)
        moved = cosine * dx + sine * dy
        off = [np.abs(moved + ((cosine * x + sine * y) - root.rho)) for x, y in wall.probe().tolist()]
        d1 += (off[0] + off[1] + off[2]) / 3.0
    d1 /= float(len(walls))
    length = dmath.hypot(dx, dy)
    cost = np.rint((d1 + config.shift_price * length) * GRAIN)
    if config.shift_price == 0.0:
        best = int(np.argmin(cost))
    else:
        lowest = np.flatnonzero(cost == cost.min())
        best = int(lowest[np.argmin(np.rint(length[lowest] * GRAIN))])
    return (float(dx[best]), float(dy[best])), float(d1[len(d1) // 2]), float(d1[best])
