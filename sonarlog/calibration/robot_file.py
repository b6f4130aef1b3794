"""A robot's file, written: what `sonarlog.robot` reads, with its calibration and how certain each number is.

Must not know: where the numbers come from.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sonarlog.calibration.correction import Calibration
from sonarlog.errors import SonarlogError
from sonarlog.robot import Robot

ABOUT = {
    "rotation_scale": "true turn over odometry's",
    "distance_scale": "true way over odometry's",
    "drift_deg_per_m": "odometry's heading runs away to the left by",
    "ring_deg": "all sonars look so far past their heading_deg, counter-clockwise",
    "sonar_deg": "and each one on top of that",
}


class CannotWriteRobot(SonarlogError):
    """A robot's file that exists already, or cannot be written."""


def check_free(path: Path, *, force: bool) -> None:
    """Raises CannotWriteRobot for a file that exists, unless forced."""
    if path.exists() and not force:
        raise CannotWriteRobot(f"{path} exists and is not overwritten: choose another name, or give --force")


def write_robot(robot: Robot, path: Path, *, force: bool = False) -> None:
    """Write the robot; reading it back gives the same one. Raises CannotWriteRobot."""
    check_free(path, force=force)
    try:
        path.write_text(robot_text(robot), encoding="utf-8")
    except OSError as error:
        raise CannotWriteRobot(f"cannot write {path}: {error.strerror or error}") from None


def robot_text(robot: Robot) -> str:
    """The robot as TOML."""
    data = robot.as_dict()
    lines = [f"{key} = {_value(value)}" for key, value in data.items() if key not in ("sonars", "calibration")]
    lines += ["", "# Millimetres and degrees in the robot's frame: x forward, y left, counter-clockwise positive."]
    lines += ["sonars = [", *(f"    {_table(sonar)}," for sonar in data["sonars"]), "]"]
    if robot.calibration is not None:
        lines += _calibration(robot.calibration)
    return "\n".join(lines) + "\n"


def _calibration(calibration: Calibration) -> list[str]:
    data = calibration.as_dict()
    lines = ["", "[calibration]"]
    lines += [f"{key} = {_value(data[key])}  # {about}" for key, about in ABOUT.items()]
    lines += ["# The digests of the recordings it was found in, as `sonarlog info` shows them."]
    lines += [f"recordings = {_value(data['recordings'])}"]
    if calibration.sigma:
        lines += ["", "[calibration.sigma]  # one standard deviation of each"]
        lines += [f"{key} = {_value(value)}" for key, value in calibration.sigma.items()]
    return lines


def _value(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(each) for each in value)}]"
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False)  # nan is no JSON


def _table(values: Mapping[str, Any]) -> str:
    return "{ " + ", ".join(f"{key} = {_value(value)}" for key, value in values.items()) + " }"
