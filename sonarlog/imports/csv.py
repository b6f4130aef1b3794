"""A plain form for any sonar log: mountings in comment lines, units in the column names (docs/recording.md).

Must not know: recordings.
"""

import csv
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from decimal import ROUND_HALF_EVEN, Decimal, InvalidOperation, Overflow
from pathlib import Path

from slam.sweep import TURN
from sonarlog.imports.rows import BadRow, Row, lines_of
from sonarlog.robot import Robot, Sonar, load_robot

TWO_PI = Decimal("6.283185307179586476925286766559")
TIME = {"ns": Decimal(1), "us": Decimal(10**3), "ms": Decimal(10**6), "s": Decimal(10**9)}
LENGTH = {"um": Decimal(1), "mm": Decimal(10**3), "m": Decimal(10**6)}
RANGE = {"mm": Decimal(1), "m": Decimal(10**3)}
ANGLE = {"turn": Decimal(TURN), "deg": Decimal(TURN) / 360, "rad": TURN / TWO_PI}
LARGEST = 10**18
SETTING = re.compile(r"#\s*(name|half_beam_deg|max_range_mm|radius_mm|sonar)\s*:\s*(.*?)\s*$")
REPORTED = "odometry"
RANGE_COLUMN = re.compile(r"r(\d+)_(mm|m)$")


@dataclass(frozen=True)
class Column:
    """Where a quantity stands and what turns it into integers."""

    index: int
    name: str
    factor: Decimal


@dataclass(frozen=True)
class Table:
    """A file of this form: its robot, its columns and its lines of data with their numbers."""

    path: Path
    robot: Robot
    pose: tuple[Column, Column, Column, Column]  # t, x, y, theta
    ranges: tuple[Column, ...]
    reported: int | None  # the column that says whether the robot reported the pose; None: it did, always
    data: tuple[tuple[int, list[str]], ...]


def read(path: Path) -> Table:
    """Head and lines of the file. Raises BadRow for what is missing or unknown in the head."""
    lines = lines_of(path)
    robot = _robot(path, lines)
    numbered = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if not numbered:
        raise BadRow(path, 0, "has no line of column names, such as t_s,x_m,y_m,theta_deg,r0_m")
    cells = [(number, _cells(path, number, line)) for number, line in numbered]
    head_line, names = cells[0]
    t, x, y, theta = (
        _column(path, head_line, names, quantity, units)
        for quantity, units in (("t", TIME), ("x", LENGTH), ("y", LENGTH), ("theta", ANGLE))
    )
    ranges = _range_columns(path, head_line, names)
    known = {column.index for column in (t, x, y, theta, *ranges)}
    reported = names.index(REPORTED) if REPORTED in names else None
    for index, name in enumerate(names):
        if index not in known and index != reported:
            raise BadRow(path, head_line, f"unknown column {name!r}")
    if len(ranges) != len(robot.sonars):
        raise BadRow(path, head_line, f"{len(ranges)} range columns, but {len(robot.sonars)} '# sonar:' lines")
    return Table(path, robot, (t, x, y, theta), ranges, reported, tuple(cells[1:]))


def rows(table: Table) -> Iterator[Row]:
    """The rows. Raises BadRow for a cell that is no number and a row of the wrong length."""
    width = len(table.pose) + len(table.ranges) + (table.reported is not None)
    for line, cells in table.data:
        if len(cells) != width:
            raise BadRow(table.path, line, f"{len(cells)} cells where {width} belong")

        def cell(column: Column, line: int = line, cells: list[str] = cells) -> int:
            return _number(table.path, line, column, cells[column.index])

        t_ns, x_um, y_um, heading = (cell(column) for column in table.pose)
        ranges = tuple(_range(cells[c.index], cell, c, table.robot.max_range_mm) for c in table.ranges)
        yield Row(line, t_ns, x_um, y_um, heading, ranges, _reported(table, line, cells))


def _reported(table: Table, line: int, cells: list[str]) -> bool:
    text = "1" if table.reported is None else cells[table.reported]
    if text not in ("0", "1"):
        raise BadRow(table.path, line, f"{REPORTED} is {text!r}, not 0 or 1")
    return text == "1"


def _range(text: str, cell: Callable[[Column], int], column: Column, no_echo_mm: int) -> int | None:
    """Empty or nan: no reading. inf: a reading without echo."""
    if text.lower() in ("", "nan"):
        return None
    return no_echo_mm if text.lower() in ("inf", "+inf") else cell(column)


def _number(path: Path, line: int, column: Column, text: str) -> int:
    try:
        value = Decimal(text) * column.factor
        if abs(value) < LARGEST:
            return int(value.to_integral_value(ROUND_HALF_EVEN))
    except InvalidOperation:  # text, nan
        raise BadRow(path, line, f"{column.name} is {text!r}, no number") from None
    except Overflow:
        pass
    raise BadRow(path, line, f"{column.name} is {text!r}, too large")


def _cells(path: Path, number: int, line: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], strict=True))]
    except csv.Error as error:
        raise BadRow(path, number, f"is no CSV: {error}") from None


def _column(path: Path, line: int, names: list[str], quantity: str, units: dict[str, Decimal]) -> Column:
    known = [f"{quantity}_{unit}" for unit in units]
    found = [name for name in names if name in known]
    if len(found) != 1:
        raise BadRow(path, line, f"one column of {', '.join(known)} is needed, there are {len(found)}")
    return Column(names.index(found[0]), found[0], units[found[0].removeprefix(f"{quantity}_")])


def _range_columns(path: Path, line: int, names: list[str]) -> tuple[Column, ...]:
    found: dict[int, Column] = {}
    for index, name in enumerate(names):
        match = RANGE_COLUMN.match(name)
        if match:
            found[int(match[1])] = Column(index, name, RANGE[match[2]])
    if not found or sorted(found) != list(range(len(found))):
        raise BadRow(path, line, "range columns r0_mm, r1_mm, … (or _m) are needed, without a gap")
    return tuple(found[sonar] for sonar in sorted(found))


def _robot(path: Path, lines: list[str]) -> Robot:
    """Sonars, beam and range from the comment lines; what they do not say is an AmigoBot's."""
    sonars: list[Sonar] = []
    settings: dict[str, str] = {}
    for number, line in enumerate(lines, 1):
        match = SETTING.match(line)
        if match and match[1] == "sonar":
            sonars.append(_sonar(path, number, match[2]))
        elif match:
            settings[match[1]] = match[2]
    for key in ("half_beam_deg", "max_range_mm"):
        if key not in settings:
            raise BadRow(path, 0, f"has no line '# {key}: …'")
    try:
        half_beam_deg, max_range_mm = float(settings["half_beam_deg"]), int(settings["max_range_mm"])
        radius_mm = int(settings.get("radius_mm", 180))
    except ValueError as error:
        raise BadRow(path, 0, f"has a bad number in its comment lines: {error}") from None
    if not (0 < half_beam_deg < 90 and max_range_mm > 0 and radius_mm > 0):
        raise BadRow(path, 0, "needs 0 < half_beam_deg < 90, max_range_mm > 0 and radius_mm > 0")
    return replace(
        load_robot("amigo-sh"),
        name=settings.get("name", path.stem),
        half_beam_deg=half_beam_deg,
        max_range_mm=max_range_mm,
        radius_mm=radius_mm,
        sonars=tuple(sonars),
    )


def _sonar(path: Path, line: int, text: str) -> Sonar:
    try:
        x_mm, y_mm, heading_deg = (float(word) for word in text.split())
    except ValueError:
        raise BadRow(path, line, f"'# sonar:' takes x_mm y_mm heading_deg, not {text!r}") from None
    return Sonar(x_mm, y_mm, heading_deg)
