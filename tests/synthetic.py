"""Noise-free sweeps of an ideal robot among straight walls, worked from the formulas alone."""

import math
from dataclasses import dataclass

import numpy as np

from slam.geometry import Pose
from slam.sweep import TURN, Mounting, SonarRing, Sweep

AMIGO_MM_DEG = ((76, 100, 90), (125, 75, 41), (150, 30, 15), (150, -30, -15), (125, -75, -41), (76, -100, -90),
                (-140, -58, -145), (-140, 58, 145))  # fmt: skip
HALF_BEAM = math.radians(12.5)
RING = SonarRing(tuple(Mounting(x / 1000, y / 1000, math.radians(h)) for x, y, h in AMIGO_MM_DEG), HALF_BEAM, 5000)


@dataclass(frozen=True)
class StraightWall:
    """From (x0, y0) to (x1, y1), metres."""

    x0: float
    y0: float
    x1: float
    y1: float


def corridor(width: float = 2.0, length: float = 40.0) -> list[StraightWall]:
    return [
        StraightWall(-length, width / 2, length, width / 2),
        StraightWall(-length, -width / 2, length, -width / 2),
    ]


def echo_mm(walls: list[StraightWall], x: float, y: float, axis: float) -> int:
    """The perpendicular distance of the nearest wall whose foot lies in the beam; 5000 for none."""
    best = 5.0
    for wall in walls:
        dx, dy = wall.x1 - wall.x0, wall.y1 - wall.y0
        part = ((x - wall.x0) * dx + (y - wall.y0) * dy) / (dx * dx + dy * dy)
        fx, fy = wall.x0 + part * dx - x, wall.y0 + part * dy - y
        off = math.remainder(math.atan2(fy, fx) - axis, 2 * math.pi)
        if 0 <= part <= 1 and abs(off) <= HALF_BEAM:
            best = min(best, math.hypot(fx, fy))
    return round(best * 1000)


def scan(
    walls: list[StraightWall],
    true: Pose,
    odometry: Pose | None = None,
    step_deg: float = 4.0,
    sonars: tuple[int, ...] = tuple(range(8)),
) -> Sweep:
    """A full turn in place at the true pose, its middle reading's odometry as given (default: the truth)."""
    odometry = odometry or true
    rows = []
    count = round(360 / step_deg)
    for k in range(count + 1):
        for sonar in sonars:
            # Discs fire one after the other, so each sees other headings.
            turn = math.radians((k + sonar / 8) * step_deg - 180.0)
            heading = true.theta + turn
            mount = RING.mountings[sonar]
            x = true.x + math.cos(heading) * mount.x - math.sin(heading) * mount.y
            y = true.y + math.sin(heading) * mount.x + math.cos(heading) * mount.y
            rows.append((sonar, echo_mm(walls, x, y, heading + mount.heading), odometry.theta + turn))
    disc, mm, headings = (np.array(column) for column in zip(*rows, strict=True))
    n = len(rows)
    return Sweep(
        kind="scan",
        session=0,
        reference=int(np.argmin(np.abs(headings - odometry.theta))),
        t_ns=np.arange(n) * 40_000_000,
        sonar=disc.astype(np.int64),
        range_mm=mm.astype(np.int64),
        x_um=np.full(n, round(odometry.x * 1e6)),
        y_um=np.full(n, round(odometry.y * 1e6)),
        heading=np.rint(headings / (2 * math.pi) * TURN).astype(np.int64),
    )
