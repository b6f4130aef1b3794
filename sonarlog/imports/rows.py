"""Rows of a foreign log, and the recording they become: Range, Odometry and static TF, no wire.

Must not know: the formats that rows come from.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from sonarlog.decode import Pose, Reading
from sonarlog.errors import SonarlogError
from sonarlog.recording.writer import RecordingWriter
from sonarlog.robot import Robot

LATEST_NS = (1 << 31) * 1_000_000_000  # a ROS 2 stamp has 31 bits of seconds
FARTHEST_UM = 1 << 40  # a thousand kilometres: below, metres in a double give the µm back
FARTHEST_MM = 1_000_000  # one kilometre: below, metres in a float32 give the mm back


class BadRow(SonarlogError):
    """A line of a log that cannot be used, or (line 0) a log without any."""

    def __init__(self, path: Path, line: int, why: str) -> None:
        super().__init__(f"{path}:{line}: {why}" if line else f"{path} {why}")


@dataclass(frozen=True)
class Row:
    """One moment: where odometry had the robot (µm, µm, 1/2^20 of a turn), and mm by sonar, None for no reading.

    `odometry` is False where the pose is known of the readings' moment only, and is none that the robot reported.
    """

    line: int
    t_ns: int
    x_um: int
    y_um: int
    heading: int
    ranges_mm: tuple[int | None, ...]
    odometry: bool = True


def lines_of(path: Path) -> list[str]:
    """The lines of a text file. Raises BadRow where it cannot be read or is no UTF-8."""
    try:
        return path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise BadRow(path, 0, f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise BadRow(path, 0, f"is no text: byte {error.start} is not UTF-8") from None


def write_rows(
    path: Path,
    rows: Iterable[Row],
    robot: Robot,
    *,
    source: Path,
    command_line: str,
    config: Mapping[str, str],
    force: bool = False,
) -> int:
    """Write a recording of these rows; how many. `source` is the file they are from.

    Times, µm, headings within their turn and mm come back from `read_log` as they were. Nothing is written unless
    every row is good. Raises BadRow, OutputExists, CannotWrite.
    """
    checked = _checked(source, list(rows), robot)
    with RecordingWriter(
        path, started_wall_ns=0, command_line=command_line, config=config, wire=False, force=force
    ) as recording:
        recording.identity({"imported_from": source.name}, robot)
        for row in checked:
            pose = Pose(row.x_um, row.y_um, row.heading)
            if row.odometry:
                recording.odometry(row.t_ns, *pose)
            else:
                recording.reading_odometry(row.t_ns, *pose)
            readings = [
                Reading(row.t_ns, sonar, distance, pose)
                for sonar, distance in enumerate(row.ranges_mm)
                if distance is not None
            ]
            for reading in readings:
                recording.reading(reading.t_ns, reading.sonar, reading.range_mm)
            recording.points(row.t_ns, readings)
    return len(checked)


def _checked(source: Path, rows: list[Row], robot: Robot) -> list[Row]:
    if not rows:
        raise BadRow(source, 0, "holds no rows")
    last_ns = -1
    for row in rows:
        if not 0 <= row.t_ns < LATEST_NS:
            raise BadRow(source, row.line, f"time {row.t_ns / 1e9:g} s is negative or beyond 2038")
        if row.t_ns <= last_ns:
            raise BadRow(source, row.line, f"time {row.t_ns / 1e9:.9g} s does not come after the row before")
        if max(abs(row.x_um), abs(row.y_um)) >= FARTHEST_UM:
            raise BadRow(source, row.line, "the position is over a thousand kilometres away")
        if len(row.ranges_mm) != len(robot.sonars):
            raise BadRow(source, row.line, f"{len(row.ranges_mm)} ranges for {len(robot.sonars)} sonars")
        for sonar, distance in enumerate(row.ranges_mm):
            if distance is not None and not 0 <= distance < FARTHEST_MM:
                raise BadRow(source, row.line, f"sonar {sonar}: a range of {distance} mm is not 0 to 1 km")
        last_ns = row.t_ns
    if all(distance is None for row in rows for distance in row.ranges_mm):
        raise BadRow(source, 0, "holds no readings")
    if not any(row.odometry for row in rows):
        raise BadRow(source, 0, "holds no row of odometry: some must have another odometry than 0")
    return rows
