"""What a robot is: geometry, sonar mountings and conversion factors, read from a small TOML file.

Three are built in (`sonarlog/robots/*.toml`); a user copies one, edits it and names its path instead.
"""

import tomllib
from dataclasses import asdict, dataclass, fields, replace
from importlib import resources
from pathlib import Path
from typing import Any

from slam.sweep import Mounting, SonarRing
from sonarlog.calibration.correction import Calibration
from sonarlog.errors import SonarlogError

RADIANS = 0.017453292519943295  # per degree
DEFAULT_ROBOT = "amigo-sh"
"""Taken where a robot says nothing of itself, or something that nobody knows."""


class BadRobot(SonarlogError):
    """A robot that is neither built in nor a readable file."""


@dataclass(frozen=True)
class Sonar:
    """One sonar: millimetres and degrees in the robot's frame (x forward, y left, +ccw)."""

    x_mm: float
    y_mm: float
    heading_deg: float


@dataclass(frozen=True)
class Robot:
    """Parameters of one robot type; factors turn the robot's integers into mm, mm/s and turns."""

    name: str
    mm_per_unit: float
    heading_units_per_turn: int
    velocity_mm_s_per_unit: float
    range_mm_per_unit: float
    radius_mm: int
    width_mm: int
    length_mm: int
    max_velocity_mm_s: int
    max_turn_deg_s: int
    sip_cycle_ms: int
    sonar_cycle_ms: int
    half_beam_deg: float
    max_range_mm: int
    sonars: tuple[Sonar, ...]
    calibration: Calibration | None = None

    def ring(self) -> SonarRing:
        """The sonars as the pipeline takes them, looking where they were found to look: metres and radians."""
        mountings = tuple(
            Mounting(s.x_mm / 1000, s.y_mm / 1000, (s.heading_deg + self._off_deg(number)) * RADIANS)
            for number, s in enumerate(self.sonars)
        )
        return SonarRing(mountings, self.half_beam_deg * RADIANS, self.max_range_mm)

    def _off_deg(self, number: int) -> float:
        return self.calibration.bearing_deg(number) if self.calibration else 0.0

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as kept in a recording's metadata; `from_dict` takes them back."""
        values = asdict(replace(self, calibration=None))
        values.pop("calibration")
        return values if self.calibration is None else values | {"calibration": self.calibration.as_dict()}

    @classmethod
    def from_dict(cls, data: dict[str, Any], where: str = "robot parameters") -> "Robot":
        """Check and build. Raises BadRobot naming the key that is missing, unknown or of the wrong kind."""
        known = {f.name: f.type for f in fields(cls)}
        for key in data:
            if key not in known:
                raise BadRobot(f"{where}: unknown key {key!r}; known are {', '.join(known)}")
        for key in known:
            if key not in data and key != "calibration":
                raise BadRobot(f"{where}: key {key!r} is missing")
        values = dict(data)
        try:
            values["sonars"] = tuple(Sonar(**{k: float(v) for k, v in sonar.items()}) for sonar in data["sonars"])
            for key, kind in known.items():
                if kind in (int, float, str):
                    values[key] = kind(values[key])
            if "calibration" in data:
                values["calibration"] = Calibration.from_dict(data["calibration"], len(values["sonars"]))
        except (TypeError, ValueError, AttributeError) as error:
            raise BadRobot(f"{where}: {error}") from None
        return cls(**values)


def built_in() -> list[str]:
    """Names of the robots that come with sonarlog."""
    folder = resources.files("sonarlog") / "robots"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def load_robot(name: str) -> Robot:
    """A built-in robot by (case-insensitive) name, or the robot in the TOML file at that path."""
    if name.lower() in built_in():
        text = (resources.files("sonarlog") / "robots" / f"{name.lower()}.toml").read_text(encoding="utf-8")
    else:
        try:
            text = Path(name).read_text(encoding="utf-8")
        except OSError as error:
            raise BadRobot(
                f"robot {name!r} is not built in ({', '.join(built_in())}) and not a readable file: {error.strerror}"
            ) from None
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadRobot(f"robot file {name}: {error}") from None
    return Robot.from_dict(data, f"robot {name}")
