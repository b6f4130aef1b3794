"""Block F of `paper`: turn, then shift the robot until its walls lie on their chains, held against odometry [III.F].

The paper's two searches, with a score that weighs: a wall counts by how good its bearing is, no more than so much if it
disagrees, and odometry is one more witness. A wall that was taken for another one cannot carry the robot off alone.

Must not know: how walls were taken for chains.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, Association, Chains, Link
from slam.dmath import DEGREE, Floats
from slam.geometry import Pose, Segment, wrap
from slam.localisation import GRAIN, Localisation, LocalisationConfig, keep_prediction
from slam.recognition import RecognitionConfig, place_of
from slam.self_calibration import Calibration


@dataclass(frozen=True)
class WeighingConfig:
    """How good a bearing is beside its own sigma, how good distances and the robot's position are, and odometry.

    A wall weighs no more than one that is off by `most` times its sigma; odometry no more than `odometry`, which is
    more than any one wall and less than two. `drift_m2` says how slowly the drift of the wheels is learnt.
    """

    bearing_sigma_deg: float = 0.7
    distance_sigma_m: float = 0.015
    position_sigma_m: float = 0.03
    turn_sigma_deg: float = 1.2
    shift_sigma_m: float = 0.03
    most: float = 2.5
    odometry: float = 4.0
    drift_m2: float = 3.0


@dataclass(frozen=True)
class Aim:
    """The line (α, ρ) that a chain shows from here, its bearing against the wall's good to `sigma` rad."""

    alpha: float
    rho: float
    sigma: float


def weigh(
    predicted: Pose,
    association: Association,
    sigmas: tuple[float, ...],
    chains: Chains,
    poses: tuple[Pose, ...],
    config: LocalisationConfig,
    recognition: RecognitionConfig,
    weights: WeighingConfig,
) -> Localisation:
    """The turn with the least weight against it, then the shift; no linked wall, no correction.

    `sigmas` are those of the walls' bearings, in rad. Features whose nature is not told yet say nothing of the turn.
    """
    links = association.links
    if not links:
        return keep_prediction(predicted, association, chains, config)
    walls = [association.predicted[link.wall] for link in links]
    aims = [_aim(link, sigmas[link.wall], predicted, chains, poses, recognition, weights) for link in links]
    sure = [k for k, link in enumerate(links) if link.nature != OPEN]
    off = np.array([wrap(walls[k].alpha - aims[k].alpha) for k in sure]) / DEGREE
    turn = _best_turn(off, np.array([aims[k].sigma for k in sure]) / DEGREE, config, weights)
    there = Pose(predicted.x, predicted.y, 0.0)
    spin = Pose(0.0, 0.0, turn * DEGREE)
    spun = [wall.moved(Pose(-there.x, -there.y, 0.0)).moved(spin).moved(there) for wall in walls]
    shift, before, after = _best_shift(spun, aims, config, weights)
    pose = Pose(predicted.x + shift[0], predicted.y + shift[1], predicted.theta + turn * DEGREE).quantised()
    average = dmath.mean(np.abs(off)) if sure else 0.0
    return Localisation(pose, turn, shift, average, before, after, len(walls))


def _aim(
    link: Link,
    sigma: float,
    here: Pose,
    chains: Chains,
    poses: tuple[Pose, ...],
    recognition: RecognitionConfig,
    weights: WeighingConfig,
) -> Aim:
    own = dmath.hypot(sigma, weights.bearing_sigma_deg * DEGREE)
    if link.nature != POINT:
        root = chains.members[chains.roots[link.chain]]
        return Aim(root.segment.alpha, root.segment.rho, dmath.hypot(own, root.sigma))
    place = place_of(chains.of(link.chain), poses, recognition)
    alpha, rho = place.line(here)
    aside = dmath.hypot(place.across(alpha), weights.position_sigma_m)
    return Aim(alpha, rho, dmath.hypot(own, aside / dmath.hypot(place.x - here.x, place.y - here.y)))


def _best_turn(off: Floats, sigma: Floats, config: LocalisationConfig, weights: WeighingConfig) -> float:
    """The turn in degrees with the least weight against it, of walls (n,) off by so much; then the smallest."""
    if not len(off):
        return 0.0
    steps = int(float(np.abs(off).max()) / config.angle_step_deg) + 1
    turns = np.arange(-steps, steps + 1).astype(np.float64) * config.angle_step_deg
    ratio = np.minimum(np.abs(off[:, None] + turns[None, :]) / sigma[:, None], weights.most)
    odometry = turns / weights.turn_sigma_deg
    # Between the median of the walls, which drops what is wrong, and their mean, which uses all that is right.
    against = np.cumsum(ratio * np.sqrt(ratio), axis=0)[-1] + np.minimum(odometry * odometry, weights.odometry)
    return float(turns[_least(against, np.abs(turns))])


def _best_shift(
    walls: list[Segment], aims: list[Aim], config: LocalisationConfig, weights: WeighingConfig
) -> tuple[tuple[float, float], float, float]:
    """The cell of the window with the least weight against it, then the nearest; mean d1 before and after."""
    half = config.window // 2
    steps = np.arange(-half, half + 1).astype(np.float64) * config.cell_m
    dx, dy = np.repeat(steps, len(steps)), np.tile(steps, len(steps))
    d1, against = np.zeros(len(dx)), np.zeros(len(dx))
    for wall, aim in zip(walls, aims, strict=True):
        sine, cosine = dmath.sincos(aim.alpha)
        moved = cosine * dx + sine * dy
        off = [np.abs(moved + ((cosine * x + sine * y) - aim.rho)) for x, y in wall.probe().tolist()]
        mean = (off[0] + off[1] + off[2]) / 3.0
        d1 += mean
        against += np.minimum(mean / weights.distance_sigma_m, weights.most)
    square = dx * dx + dy * dy
    odometry = square / (weights.shift_sigma_m * weights.shift_sigma_m)
    best = _least(against + np.minimum(odometry, weights.odometry), square)
    count = float(len(walls))
    return (float(dx[best]), float(dy[best])), float(d1[len(d1) // 2]) / count, float(d1[best]) / count


def _least(against: Floats, size: Floats) -> int:
    """Where the weight is least; of equal ones (on paper) the smallest, then the first."""
    cost = np.rint(against * GRAIN)
    lowest = np.flatnonzero(cost == cost.min())
    return int(lowest[np.argmin(np.rint(size[lowest] * GRAIN))])


def with_drift(known: Calibration, turn: float, metres: float, corrections: int, config: WeighingConfig) -> Calibration:
    """What a correction by `turn` rad after so many metres says of the drift: a ridge mean over all `corrections`.

    A turn that odometry itself cannot have made, a push, says nothing.
    """
    jolt = abs(turn) / (config.turn_sigma_deg * DEGREE)
    if jolt * jolt > config.odometry:
        return known
    gain = metres / (metres * metres * float(corrections) + config.drift_m2)
    return Calibration(
        known.rotation_scale,
        known.mounting,
        known.normal,
        known.right,
        known.distance_scale,
        known.drift + gain * turn,
        known.ring_bearing,
    )
