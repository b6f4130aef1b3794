"""A recording as a CARMEN log, the text form that laser SLAM systems of two decades read (docs/export.md).

ODOM: each odometry packet. SONAR: each firing, with the mounting of the sonar that fired. ROBOTLASER1: each sweep as
one scan of a laser that looks all round from the robot's centre. Must not know: files.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from slam.sweep import TURN, Sweep
from sonarlog.log import Floats, Log
from sonarlog.robot import Robot

HOST = "sonarlog"
BEAMS = 360
ACCURACY_M = 0.01
TURN_RAD = 2.0 * np.pi


def carmen_lines(log: Log, sweeps: Sequence[Sweep]) -> Iterator[str]:
    """Line after line in order of time; seconds on the recording's clock, metres and radians."""
    yield "# CARMEN log of a sonar robot"
    yield "# ODOM x y theta tv rv accel timestamp host logger_timestamp"
    yield "# SONAR cone num [ranges] [x y theta of each] timestamp host logger_timestamp"
    yield "# ROBOTLASER1 type start fov step max accuracy remission_mode num [ranges] 0 laser_pose robot_pose tv rv ..."
    yield from _parameters(log.robot)
    timed = [*_odometry(log), *_sonar(log), *_scans(log.robot, sweeps)]
    timed.sort(key=lambda line: line[0])
    for _, line in timed:
        yield line


def _parameters(robot: Robot) -> Iterator[str]:
    """What readers of laser logs ask for: the laser sits in the robot's centre."""
    values = {
        "robot_length": robot.length_mm / 1000,
        "robot_width": robot.width_mm / 1000,
        "robot_frontlaser_use": "on",
        "robot_frontlaser_offset": 0.0,
        "robot_frontlaser_max": robot.max_range_mm / 1000,
        "laser_front_laser_resolution": 360.0 / BEAMS,
        "laser_front_laser_fov": 360.0,
    }
    for name, value in values.items():
        yield f"PARAM {name} {value} 0.000000 {HOST} 0.000000"


def _odometry(log: Log) -> Iterator[tuple[int, str]]:
    odometry = log.odometry
    x, y, theta = odometry.x_um / 1e6, odometry.y_um / 1e6, odometry.heading * (TURN_RAD / TURN)
    speeds = [(0.0, 0.0)]
    for k, (before, now) in enumerate(pairwise(odometry.t_ns.tolist())):
        seconds = max(now - before, 1) / 1e9
        ahead = (x[k + 1] - x[k]) * np.cos(theta[k]) + (y[k + 1] - y[k]) * np.sin(theta[k])
        speeds.append((float(ahead / seconds), float((theta[k + 1] - theta[k]) / seconds)))
    for k, t_ns in enumerate(odometry.t_ns.tolist()):
        speed, turning = speeds[k]
        pose = f"{x[k]:.6f} {y[k]:.6f} {_wrapped(theta[k]):.6f}"
        yield t_ns, f"ODOM {pose} {speed:.6f} {turning:.6f} 0.000000 {_stamp(t_ns)}"


def _sonar(log: Log) -> Iterator[tuple[int, str]]:
    ring = log.robot.ring()
    columns = (log.readings.t_ns, log.readings.sonar, log.readings.range_mm)
    for t_ns, sonar, range_mm in zip(*(column.tolist() for column in columns), strict=True):
        mounting = ring.mountings[sonar]
        where = f"{mounting.x:.3f} {mounting.y:.3f} {mounting.heading:.6f}"
        yield t_ns, f"SONAR {2 * ring.half_beam:.6f} 1 {range_mm / 1000:.3f} {where} {_stamp(t_ns)}"


def _scans(robot: Robot, sweeps: Sequence[Sweep]) -> Iterator[tuple[int, str]]:
    most = robot.max_range_mm / 1000
    head = f"ROBOTLASER1 0 {-np.pi:.6f} {TURN_RAD:.6f} {TURN_RAD / BEAMS:.6f} {most:.3f} {ACCURACY_M} 0 {BEAMS}"
    for sweep in sweeps:
        at = sweep.reference
        heading = _wrapped(float(sweep.heading[at]) * (TURN_RAD / TURN))
        pose = f"{sweep.x_um[at] / 1e6:.6f} {sweep.y_um[at] / 1e6:.6f} {heading:.6f}"
        beams = " ".join(f"{distance:.3f}" for distance in pseudo_scan(robot, sweep).tolist())
        body = f"{robot.length_mm / 2000:.3f} {robot.width_mm / 2000:.3f} 0.000000"
        t_ns = int(sweep.t_ns[at])
        yield t_ns, f"{head} {beams} 0 {pose} {pose} 0.000000 0.000000 {body} {_stamp(t_ns)}"


def pseudo_scan(robot: Robot, sweep: Sweep) -> Floats:
    """Distances (360,) m from the robot's centre at the sweep's reference, beams 1° wide from −180° on.

    Each echo is put on its sonar's axis; of several in one beam the nearest counts. A beam without any has the maximum
    range, which readers take for no return.
    """
    ring, most = robot.ring(), robot.max_range_mm / 1000
    place = np.array([(m.x, m.y, m.heading) for m in ring.mountings])[sweep.sonar]
    theta = sweep.heading * (TURN_RAD / TURN)
    away = sweep.range_mm / 1000
    x = sweep.x_um / 1e6 + np.cos(theta) * place[:, 0] - np.sin(theta) * place[:, 1]
    y = sweep.y_um / 1e6 + np.sin(theta) * place[:, 0] + np.cos(theta) * place[:, 1]
    x = x + away * np.cos(theta + place[:, 2]) - sweep.x_um[sweep.reference] / 1e6
    y = y + away * np.sin(theta + place[:, 2]) - sweep.y_um[sweep.reference] / 1e6
    bearing = np.arctan2(y, x) - theta[sweep.reference]
    beam = np.floor((bearing / TURN_RAD + 0.5) * BEAMS + 0.5).astype(np.int64) % BEAMS
    scan = np.full(BEAMS, most)
    seen = sweep.range_mm < robot.max_range_mm
    np.minimum.at(scan, beam[seen], np.hypot(x, y)[seen])
    return scan


def _wrapped(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


def _stamp(t_ns: int) -> str:
    return f"{t_ns / 1e9:.6f} {HOST} {t_ns / 1e9:.6f}"
