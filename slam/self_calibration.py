"""Block B, self-calibration: beams start at the sonar, their bearings lose the rotation error [III.B].

The sweep itself shows the error: one wall seen by several sonars, at different times of the turn, must have one
bearing. A ridge fit pooled over all sweeps gives the rotation scale and each sonar's mounting error.
"""

from dataclasses import dataclass, replace

import numpy as np

from slam import dmath
from slam.arcs import Arc, ArcConfig, Beams, find_arcs
from slam.clusters import cluster
from slam.dmath import DEGREE, PI, Floats
from slam.geometry import ORIGIN, Pose, wrap
from slam.linear import solve_spd
from slam.motion import Motion, WheelErrors, Wheels
from slam.parallax import for_point
from slam.sweep import TURN, SonarRing, Sweep, SweepKind

JUMP_M = 3.0
"""Further than this no robot drives from sweep to sweep with its odometry interrupted."""


@dataclass(frozen=True)
class SelfCalibrationConfig:
    """Priors of the ridge fit; `fit = false` leaves the odometry as it came."""

    fit: bool = True
    bearing_sigma_deg: float = 2.0  # of one arc's middle, whose ends are 4° steps apart
    scale_sigma: float = 0.01
    mounting_sigma_deg: float = 1.0
    min_range_m: float = 0.10


@dataclass(frozen=True)
class Calibration:
    """What is known of the robot so far: true turn = (1 + rotation_scale) × odometry's; mounting errors in rad.

    `normal` (m+1, m+1) and `right` (m+1,) are the normal equations pooled over the sweeps seen. What no single sweep
    shows, localisation may learn: `distance_scale`, `drift` in rad/m, and `ring_bearing` in rad, by which all sonars
    together are turned against the direction of the drive.
    """

    rotation_scale: float
    mounting: tuple[float, ...]
    normal: Floats
    right: Floats
    distance_scale: float = 0.0
    drift: float = 0.0
    ring_bearing: float = 0.0

    @classmethod
    def unknown(cls, sonars: int) -> "Calibration":
        """Before the first sweep."""
        return cls(0.0, (0.0,) * sonars, np.zeros((sonars + 1, sonars + 1)), np.zeros(sonars + 1))

    @property
    def wheels(self) -> WheelErrors:
        """The errors of odometry."""
        return WheelErrors(self.rotation_scale, self.distance_scale, self.drift)


@dataclass(frozen=True)
class Last:
    """The sweep before: its odometry and its pose in the map; not `joined` where odometry was interrupted since."""

    wheels: Wheels
    pose: Pose
    joined: bool = True


@dataclass(frozen=True)
class Calibrated:
    """The sweep as beams in its frame F, and where the robot is thought to be.

    `turn` (n,) is the robot's heading in rad since the reference reading; `wheels` what odometry says, `motion` how it
    got here from the sweep before (None: nobody knows), `predicted` the place of F in the map; `too_near` counts
    readings below the sonar's own minimum, which say nothing. Not `joined`: odometry was interrupted on the way, and
    the motion is only what it counted.
    """

    kind: SweepKind
    beams: Beams
    turn: Floats
    wheels: Wheels
    motion: Motion | None
    predicted: Pose
    calibration: Calibration
    too_near: int
    joined: bool = True

    @property
    def odometry(self) -> Pose:
        """The raw pose of F."""
        return self.wheels.pose


def self_calibrate(
    sweep: Sweep,
    ring: SonarRing,
    last: Last | None,
    known: Calibration,
    config: SelfCalibrationConfig,
) -> Calibrated:
    """Beams of the sweep with the rotation error taken out, and the pose predicted from `last`.

    `last` is the sweep before; None puts F at the map's origin. Odometry that was interrupted goes on from where it
    stopped counting, and is believed as a guess; where it has jumped, the robot is taken to be where it was.
    """
    raw = _aimed(sweep, ring, known, config)
    if config.fit and sweep.kind == "scan":
        known = _learn(raw, ring, known, config)
        raw = _aimed(sweep, ring, known, config)
    if last is None:
        return replace(raw, predicted=ORIGIN)
    motion = last.wheels.motion_to(raw.wheels)
    if not last.joined and dmath.hypot(motion.x, motion.y) > JUMP_M:
        return replace(raw, predicted=last.pose, joined=False)
    predicted = last.pose.compose(motion.corrected(known.wheels)).quantised()
    return replace(raw, motion=motion, predicted=predicted, joined=last.joined)


def _aimed(sweep: Sweep, ring: SonarRing, known: Calibration, config: SelfCalibrationConfig) -> Calibrated:
    """Each reading's beam in F, with the calibration known so far."""
    at = sweep.reference
    odometry = Pose(
        float(sweep.x_um[at]) * 1e-6, float(sweep.y_um[at]) * 1e-6, float(sweep.heading[at] % TURN) * (2.0 * PI / TURN)
    ).quantised()
    turn = (sweep.heading - sweep.heading[at]).astype(np.float64) * (2.0 * PI / TURN) * (1.0 + known.rotation_scale)
    sine, cosine = dmath.sincos(odometry.theta)
    dx = (sweep.x_um - sweep.x_um[at]).astype(np.float64) * 1e-6
    dy = (sweep.y_um - sweep.y_um[at]).astype(np.float64) * 1e-6
    mount_x = np.array([m.x for m in ring.mountings])[sweep.sonar]
    mount_y = np.array([m.y for m in ring.mountings])[sweep.sonar]
    off = [e + known.ring_bearing for e in known.mounting]
    bearing = np.array([m.heading + e for m, e in zip(ring.mountings, off, strict=True)])[sweep.sonar]
    turn_sine, turn_cosine = dmath.sincos(turn)
    origin = np.stack(
        [
            (cosine * dx + sine * dy) + (turn_cosine * mount_x - turn_sine * mount_y),
            (cosine * dy - sine * dx) + (turn_sine * mount_x + turn_cosine * mount_y),
        ],
        axis=1,
    )
    distance = sweep.range_mm.astype(np.float64) * 1e-3
    near = distance < config.min_range_m
    echo = (sweep.range_mm < ring.max_range_mm) & ~near
    return Calibrated(
        kind=sweep.kind,
        beams=Beams(sweep.sonar, distance, echo, origin, bearing + turn, ring.half_beam),
        turn=turn,
        wheels=Wheels(odometry, *(int(sweep.heading[k]) for k in (0, at, -1))),
        motion=None,
        predicted=ORIGIN,
        calibration=known,
        too_near=int(np.count_nonzero(near)),
    )


def _learn(raw: Calibrated, ring: SonarRing, known: Calibration, config: SelfCalibrationConfig) -> Calibration:
    """Pool this sweep's arcs into the normal equations and solve them anew.

    An arc's bearing is φ − scale·turn − mounting error + noise; the RCD's own φ drops out with its mean.
    """
    # An arc cut by the start or the end of the turn has its middle in the wrong place.
    arcs = [arc for arc in find_arcs(raw.beams, ArcConfig(), closed=False) if arc.whole]
    size = len(ring.mountings) + 1
    normal, right = known.normal, known.right
    weight = _weight(config.bearing_sigma_deg * DEGREE)
    for members in cluster(arcs, ArcConfig()):
        rows, values = _arc_rows([arcs[i] for i in members], raw.turn, known, size)
        shares = weight * (rows[:, :, None] * rows[:, None, :])
        normal = np.cumsum(np.concatenate([normal[None], shares]), axis=0)[-1]
        right = np.cumsum(np.concatenate([right[None], weight * (rows * values[:, None])]), axis=0)[-1]
    prior = np.full(size, _weight(config.mounting_sigma_deg * DEGREE))
    prior[0] = _weight(config.scale_sigma)
    ridge = normal.copy()
    ridge[np.arange(size), np.arange(size)] += prior
    solution = solve_spd(ridge, right).tolist()
    return replace(known, rotation_scale=solution[0], mounting=tuple(solution[1:]), normal=normal, right=right)


def _weight(sigma: float) -> float:
    return 1.0 / (sigma * sigma)


def _arc_rows(arcs: list[Arc], turn: Floats, known: Calibration, size: int) -> tuple[Floats, Floats]:
    """One row an arc: how its uncorrected bearing depends on (scale, mounting errors), means taken out."""
    number = np.repeat(np.arange(len(arcs)), [len(arc.readings) for arc in arcs])
    turns = np.bincount(number, turn[np.array([reading for arc in arcs for reading in arc.readings])])
    middle = turns / np.bincount(number)
    raw_turn = middle / (1.0 + known.rotation_scale)
    sonar = np.array([arc.sonar for arc in arcs])
    off = wrap(np.array([arc.bearing for arc in arcs]) - arcs[0].bearing)
    if for_point(arcs) > 0.0:
        # A point is seen in another direction from each sonar: that is no mounting error.
        off = off + np.array([arc.aside for arc in arcs])
    values = off - ((middle - raw_turn) + np.array(known.mounting)[sonar])
    rows = np.zeros((len(arcs), size))
    rows[:, 0] = -raw_turn
    rows[np.arange(len(arcs)), 1 + sonar] = -1.0
    count = float(len(arcs))
    rows -= np.cumsum(rows, axis=0)[-1] / count
    values -= dmath.total(values) / count
    return rows, values
