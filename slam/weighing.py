"""Block F of `paper`: turn, then shift the robot until its walls lie on their chains, held against odometry [III.F].

The paper's two searches, with a score that weighs: a wall counts by how good its bearing and its chain's line are, no
more than so much if it disagrees, and odometry is one more witness. A wall that was taken for another one cannot carry
the robot off alone, and does not join the chain either.

Must not know: how walls were taken for chains.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, Association, Link, foot
from slam.dmath import DEGREE, Floats
from slam.geometry import Pose, Segment, wrap
from slam.landmarks import Landmarks, Line
from slam.localisation import GRAIN, Localisation, LocalisationConfig, keep_prediction
from slam.self_calibration import Calibration

FINER = 5
"""So many times finer the window is searched once more, about its best cell."""
FARTHER = 0.003
"""This part of odometry's weight against a shift knows no bound: who is pushed aside is not carried along the walls."""


@dataclass(frozen=True)
class WeighingConfig:
    """How good a bearing is beside its own sigma, how good distances and the robot's position are, and odometry.

    A wall weighs no more than one that is off by `most` times its sigma, and at the pose found joins no chain; odometry
    no more than `odometry`, which is more than any one wall and less than two. `drift_m2` says how slowly the drift of
    the wheels is learnt.
    """

    bearing_sigma_deg: float = 0.5
    distance_sigma_m: float = 0.015
    position_sigma_m: float = 0.03
    turn_sigma_deg: float = 1.0
    shift_sigma_m: float = 0.025
    most: float = 2.0
    odometry: float = 4.0
    drift_m2: float = 1.0


@dataclass(frozen=True)
class Witness:
    """A linked wall, where the pose has it, and the line that its chain shows from there.

    `aim.sigma` and `aim.off` say how well the two should agree, in rad and m, with the wall's own errors.
    """

    link: Link
    wall: Segment
    aim: Line

    @property
    def turned(self) -> float:
        """The wall's bearing less the line's, rad."""
        return wrap(self.wall.alpha - self.aim.alpha)

    def beside(self, pose: Pose) -> float:
        """How far beside the line the wall's foot point is to a robot at this pose, m."""
        sine, cosine = dmath.sincos(self.aim.alpha)
        x, y = foot(self.wall, pose)
        return abs((cosine * x + sine * y) - self.aim.rho)


@dataclass(frozen=True)
class Balance:
    """The links of a sweep, and all that says how much each counts; `sigmas` of the walls' bearings are in rad."""

    association: Association
    sigmas: tuple[float, ...]
    landmarks: Landmarks
    weights: WeighingConfig

    def witnesses(self, walls: tuple[Segment, ...], here: Pose) -> list[Witness]:
        """The linked ones of the walls as they lie in the map, seen from here."""
        return [self._witness(link, walls[link.wall], here) for link in self.association.links]

    def _witness(self, link: Link, wall: Segment, here: Pose) -> Witness:
        line = self.landmarks.line(link.chain, link.nature, here, foot(wall, here))
        own = dmath.hypot(self.sigmas[link.wall], self.weights.bearing_sigma_deg * DEGREE)
        sigma = dmath.hypot(own, line.sigma)
        if link.nature == POINT:  # A step aside turns the line of sight.
            sine, cosine = dmath.sincos(line.alpha)
            distance = max(line.rho - (cosine * here.x + sine * here.y), self.weights.position_sigma_m)
            sigma = dmath.hypot(sigma, self.weights.position_sigma_m / distance)
        off = dmath.hypot(self.weights.distance_sigma_m, line.off)
        return Witness(link, wall, Line(line.alpha, line.rho, sigma, off))


def weigh(balance: Balance, predicted: Pose, config: LocalisationConfig) -> Localisation:
    """The turn with the least weight against it, then the shift; no linked wall, no correction.

    Features whose nature is not told yet say nothing of the turn.
    """
    association, weights = balance.association, balance.weights
    if not association.links:
        return keep_prediction(predicted, association, balance.landmarks.chains, config)
    witnesses = balance.witnesses(association.predicted, predicted)
    off, sigma = _off(witnesses)
    turn = _best_turn(off, sigma, config, weights)
    shift, before, after = _best_shift(_spun(witnesses, predicted, turn), config, weights)
    pose = Pose(predicted.x + shift[0], predicted.y + shift[1], predicted.theta + turn * DEGREE).quantised()
    average = dmath.mean(np.abs(off)) if len(off) else 0.0
    return Localisation(pose, turn, shift, average, before, after, len(witnesses))


def without_strangers(balance: Balance, walls: tuple[Segment, ...], pose: Pose) -> Association:
    """The links of the walls, as they lie at the pose found, that agree with their chains there."""
    most = balance.weights.most
    kept = [
        witness.link
        for witness in balance.witnesses(walls, pose)
        if abs(witness.turned) <= most * witness.aim.sigma and witness.beside(pose) <= most * witness.aim.off
    ]
    return replace(balance.association, links=tuple(kept))


def _spun(witnesses: list[Witness], about: Pose, turn_deg: float) -> list[Witness]:
    back, spin, there = Pose(-about.x, -about.y, 0.0), Pose(0.0, 0.0, turn_deg * DEGREE), Pose(about.x, about.y, 0.0)
    return [replace(witness, wall=witness.wall.moved(back).moved(spin).moved(there)) for witness in witnesses]


def _off(witnesses: list[Witness]) -> tuple[Floats, Floats]:
    """By how many degrees each wall (n,) is turned against its line, and how good that is; not those untold."""
    sure = [witness for witness in witnesses if witness.link.nature != OPEN]
    off = np.array([witness.turned for witness in sure]) / DEGREE
    return off, np.array([witness.aim.sigma for witness in sure]) / DEGREE


def _best_turn(off: Floats, sigma: Floats, config: LocalisationConfig, weights: WeighingConfig) -> float:
    """The turn in degrees with the least weight against it, of walls (n,) off by so much; then the smallest."""
    turns = _turns(off, config)
    odometry = turns / weights.turn_sigma_deg
    against = _against_turns(off, sigma, turns, weights) + np.minimum(odometry * odometry, weights.odometry)
    return float(turns[_least(against, np.abs(turns))])


def _turns(off: Floats, config: LocalisationConfig) -> Floats:
    """The turns to look at, in degrees, none at all in the middle."""
    steps = int(float(np.abs(off).max(initial=0.0)) / config.angle_step_deg) + 1
    return np.arange(-steps, steps + 1).astype(np.float64) * config.angle_step_deg


def _against_turns(off: Floats, sigma: Floats, turns: Floats, weights: WeighingConfig) -> Floats:
    """The weight of all walls (n,) against each of the turns."""
    ratio = np.minimum(np.abs(off[:, None] + turns[None, :]) / sigma[:, None], weights.most)
    none = np.zeros((1, len(turns)))
    return np.asarray(np.cumsum(np.concatenate([none, _weight(ratio)]), axis=0)[-1])


def _best_shift(
    witnesses: list[Witness], config: LocalisationConfig, weights: WeighingConfig
) -> tuple[tuple[float, float], float, float]:
    """The cell of the window with the least weight against it, then a piece of that; mean d1 before and after."""
    half = config.window // 2
    dx, dy = _cells(half, config.cell_m)
    d1, best = _search(dx, dy, witnesses, weights)
    finer_dx, finer_dy = _cells(FINER, config.cell_m / float(FINER))
    fx, fy = finer_dx + dx[best], finer_dy + dy[best]
    finer, piece = _search(fx, fy, witnesses, weights)
    return (float(fx[piece]), float(fy[piece])), float(d1[len(d1) // 2]), float(finer[piece])


def _cells(half: int, cell_m: float) -> tuple[Floats, Floats]:
    steps = np.arange(-half, half + 1).astype(np.float64) * cell_m
    return np.repeat(steps, len(steps)), np.tile(steps, len(steps))


def _search(dx: Floats, dy: Floats, witnesses: list[Witness], weights: WeighingConfig) -> tuple[Floats, int]:
    """The mean d1 after each shift (n,), and which shift has the least weight against it; then the smallest."""
    d1, against = _against_shifts(dx, dy, witnesses, weights)
    square = dx * dx + dy * dy
    odometry = square / (weights.shift_sigma_m * weights.shift_sigma_m)
    return d1, _least(against + np.minimum(odometry, weights.odometry) + FARTHER * odometry, square)


def _against_shifts(dx: Floats, dy: Floats, witnesses: list[Witness], weights: WeighingConfig) -> tuple[Floats, Floats]:
    """The mean d1 after each shift (n,), and the weight of all walls against it."""
    d1, against = np.zeros(len(dx)), np.zeros(len(dx))
    for witness in witnesses:
        sine, cosine = dmath.sincos(witness.aim.alpha)
        moved = cosine * dx + sine * dy
        off = [np.abs(moved + ((cosine * x + sine * y) - witness.aim.rho)) for x, y in witness.wall.probe().tolist()]
        mean = (off[0] + off[1] + off[2]) / 3.0
        d1 += mean
        against += _weight(np.minimum(mean / witness.aim.off, weights.most))
    return d1 / float(len(witnesses)), against


def _weight(ratio: Floats) -> Floats:
    """Between the median of the walls, which drops what is wrong, and their mean, which uses all that is right."""
    return ratio * np.sqrt(ratio)


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
