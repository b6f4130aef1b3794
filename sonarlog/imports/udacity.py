"""The RoboND corridor: a real robot with 8 ultrasonic sensors, as two white-space files of integers.

POSES has `t_ms x_mm y_mm theta` with theta in tenths of a degree, MEASUREMENT `t_ms z0 … z7` in mm.
Must not know: recordings.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from slam.sweep import TURN
from sonarlog.imports.rows import BadRow, Row, lines_of
from sonarlog.robot import Robot, Sonar, load_robot

BEARINGS_DEG = (-90.0, -37.5, -22.5, -7.5, 7.5, 22.5, 37.5, 90.0)
TENTHS = 3600  # of a degree in a turn


def robot() -> Robot:
    """The course's robot: its cone is 20° wide; where on the robot the sensors sit was never said, so 0.

    The body is an AmigoBot's for want of any other.
    """
    sonars = tuple(Sonar(0.0, 0.0, bearing) for bearing in BEARINGS_DEG)
    return replace(load_robot("amigo-sh"), name="udacity", half_beam_deg=10.0, max_range_mm=5000, sonars=sonars)


def rows(measurement: Path, poses: Path) -> Iterator[Row]:
    """The rows of both files, which go together line by line. Raises BadRow."""
    ranges, places = list(_integers(measurement, 1 + len(BEARINGS_DEG))), list(_integers(poses, 4))
    if len(ranges) != len(places):
        raise BadRow(measurement, 0, f"has {len(ranges)} rows, {poses} has {len(places)}: they must go together")
    for (line, (t_ms, *distances)), (_, (pose_ms, x_mm, y_mm, theta)) in zip(ranges, places, strict=True):
        if t_ms != pose_ms:
            raise BadRow(measurement, line, f"time {t_ms} ms, but {pose_ms} ms in {poses}")
        yield Row(line, t_ms * 1_000_000, x_mm * 1000, y_mm * 1000, heading(theta), tuple(distances))


def heading(tenths: int) -> int:
    """Tenths of a degree in 1/2^20 of a turn, rounded; `round(heading * 3600 / 2^20)` is the inverse."""
    return (tenths * TURN + TENTHS // 2) // TENTHS


def _integers(path: Path, width: int) -> Iterator[tuple[int, list[int]]]:
    for number, line in enumerate(lines_of(path), start=1):
        if not line.strip():
            continue
        try:
            values = [int(word) for word in line.split()]
        except ValueError:
            raise BadRow(path, number, f"{line.strip()[:40]!r} is no row of integers") from None
        if len(values) != width:
            raise BadRow(path, number, f"{len(values)} numbers where {width} belong")
        yield number, values
