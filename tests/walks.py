"""Noise-free walks of a robot whose wheels err: what it truly did, and what its odometry says of it."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slam.algorithms import algorithm
from slam.association import Association
from slam.dmath import Floats
from slam.features import extract_features
from slam.geometry import Pose
from slam.motion import WheelErrors
from slam.pipeline import State, first_state
from slam.reliability import analyse_reliability
from slam.self_calibration import Calibrated, self_calibrate
from slam.sweep import TURN, Ints, Sweep
from tests.synthetic import RING, StraightWall

TRUE = WheelErrors()
STEPS = 90


@dataclass(frozen=True)
class Walk:
    """Sweeps as recorded, and where each was truly made, both in the frame of the first one's reference."""

    sweeps: list[Sweep]
    stations: list[Pose]


def walk(
    walls: Sequence[StraightWall],
    route: Sequence[tuple[float, float]],
    errors: WheelErrors = TRUE,
    sides: Sequence[int] = (1, -1),
    shoves: dict[int, Pose] | None = None,
) -> Walk:
    """A scan at each point of the route; the robot is driven so that it gets there, whatever its wheels make of it.

    It turns to the next point, drives (an arc, where the heading drifts), and scans: a full turn to the left for each
    1 in `sides`, to the right for each −1, by turns. `shoves[k]` is the step, in its own frame, by which it is carried
    off unawares before scan k; it goes on from there.
    """
    true = Pose(*route[0], 0.0)
    odometry = Pose(0.0, 0.0, 0.0)
    made, stations = [], []
    for k, (x, y) in enumerate(route):
        if k:
            length = math.hypot(x - true.x, y - true.y)
            driven = length / (1.0 + errors.distance)
            chord = math.atan2(y - true.y, x - true.x)
            turn = math.remainder(chord - 0.5 * errors.drift * driven - true.theta, 2 * math.pi)
            heading = odometry.theta + turn / (1.0 + errors.rotation)
            odometry = Pose(odometry.x + driven * math.cos(heading), odometry.y + driven * math.sin(heading), heading)
            true = Pose(x, y, true.theta + turn + errors.drift * driven)
        if shoves and k in shoves:
            true = true.compose(shoves[k])
        side = sides[k % len(sides)]
        sweep, middle = _turned(walls, true, odometry, side, errors)
        made.append(replace(sweep, t_ns=sweep.t_ns + 40_000_000_000 * k))
        stations.append(middle)
        true = Pose(true.x, true.y, true.theta + side * 2 * math.pi)
        odometry = Pose(odometry.x, odometry.y, odometry.theta + side * 2 * math.pi / (1.0 + errors.rotation))
    return Walk(made, [stations[0].step_to(station) for station in stations])


def _turned(
    walls: Sequence[StraightWall], true: Pose, odometry: Pose, side: int, errors: WheelErrors
) -> tuple[Sweep, Pose]:
    """A full turn from these headings on, and the true pose at its middle."""
    n = 8 * (STEPS + 1)
    sonar = np.arange(n) % 8
    turn = side * np.arange(n) / 8 * (2 * math.pi / STEPS)
    heading = true.theta + turn
    mount_x, mount_y, mount = (np.array([getattr(m, a) for m in RING.mountings])[sonar] for a in ("x", "y", "heading"))
    x = true.x + np.cos(heading) * mount_x - np.sin(heading) * mount_y
    y = true.y + np.sin(heading) * mount_x + np.cos(heading) * mount_y
    middle = 4 * STEPS  # half a turn
    sweep = Sweep(
        kind="scan",
        session=0,
        reference=middle,
        t_ns=np.arange(n) * 40_000_000,
        sonar=sonar.astype(np.int64),
        range_mm=_echoes_mm(walls, x, y, heading + mount),
        x_um=np.full(n, round(odometry.x * 1e6)),
        y_um=np.full(n, round(odometry.y * 1e6)),
        heading=np.rint((odometry.theta + turn / (1.0 + errors.rotation)) / (2 * math.pi) * TURN).astype(np.int64),
    )
    return sweep, Pose(true.x, true.y, true.theta + float(turn[middle]))


def _echoes_mm(walls: Sequence[StraightWall], x: Floats, y: Floats, axis: Floats) -> Ints:
    """Of each reading: the distance of the nearest wall whose foot lies in the beam; 5000 for none."""
    best = np.full(len(x), 5.0)
    for wall in walls:
        dx, dy = wall.x1 - wall.x0, wall.y1 - wall.y0
        part = ((x - wall.x0) * dx + (y - wall.y0) * dy) / (dx * dx + dy * dy)
        fx, fy = wall.x0 + part * dx - x, wall.y0 + part * dy - y
        aside = np.arctan2(fy, fx) - axis
        hit = (part >= 0) & (part <= 1) & (np.abs(np.angle(np.exp(1j * aside))) <= RING.half_beam)
        best = np.where(hit, np.minimum(best, np.hypot(fx, fy)), best)
    return np.asarray(np.rint(best * 1000).astype(np.int64))


@dataclass(frozen=True)
class Tracked:
    """What blocks B, E and F made of a sweep, and what the next one starts from."""

    calibrated: Calibrated
    association: Association
    pose: Pose
    state: State


def track(sweeps: Iterable[Sweep], name: str = "graph") -> list[Tracked]:
    """The pipeline's blocks B to F: all but the map."""
    chosen = algorithm(name)
    config, state, made = chosen.config, first_state(RING, chosen), []
    for sweep in sweeps:
        last = state.last(sweep.session)
        calibrated = self_calibrate(sweep, RING, last, state.calibration, config.self_calibration)
        walls = extract_features(analyse_reliability(calibrated, config.reliability), config.features).walls
        association = chosen.associate(calibrated, walls, state.track, config)
        found, after, learnt = chosen.localise(calibrated, walls, association, state.track, config)
        state = State(after, calibrated.wheels, sweep.session, learnt, state.map)
        made.append(Tracked(calibrated, association, found.pose, state))
    return made


def off(poses: Sequence[Pose], stations: Sequence[Pose]) -> list[float]:
    """How far each pose is from where it should be, in metres."""
    return [math.hypot(p.x - s.x, p.y - s.y) for p, s in zip(poses, stations, strict=True)]


def turned(poses: Sequence[Pose], stations: Sequence[Pose]) -> list[float]:
    """How far each pose is turned from where it should be, in degrees."""
    pairs = zip(poses, stations, strict=True)
    return [abs(math.degrees(math.remainder(p.theta - s.theta, 2 * math.pi))) for p, s in pairs]


def straight(stations: int, spacing: float = 0.8) -> list[tuple[float, float]]:
    """A route along the x axis."""
    return [(spacing * k, 0.0) for k in range(stations)]


def room(x0: float, y0: float, x1: float, y1: float) -> list[StraightWall]:
    """Four walls."""
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return [StraightWall(*corners[k], *corners[(k + 1) % 4]) for k in range(4)]
