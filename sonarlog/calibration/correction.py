"""What a robot gets wrong, as its file has it, and odometry with that taken out.

Odometry's errors are those of UMBmark: a wrong track width shows as `rotation_scale`, wheels of unequal size as
`drift_deg_per_m`, and both wheels' size as `distance_scale`. Borenstein and Feng, Measurement and correction of
systematic odometry errors in mobile robots, 1996. Integers in, integers out, and the same ones on every machine.
Must not know: how the numbers were found, packets, files.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from slam import dmath
from slam.dmath import PI
from slam.sweep import TURN

RADIANS = 2.0 * PI / TURN
LIMITS = {"rotation_scale": (0.5, 2.0), "distance_scale": (0.5, 2.0), "drift_deg_per_m": (-45.0, 45.0)}
LARGEST_BEARING_DEG = 45.0

Place = tuple[int, int, int]  # µm, µm, 1/TURN of a turn


@dataclass(frozen=True)
class Calibration:
    """The true turn is `rotation_scale` times odometry's, less `drift_deg_per_m` for each of its metres forwards.

    The true way is `distance_scale` times odometry's. Sonar i looks `ring_deg + sonar_deg[i]` past where its mounting
    has it. `sigma` holds one standard deviation of each number that was found, by name (`sonar_deg` a list, NaN for
    those not found); `recordings` are the digests of what it was found in.
    """

    rotation_scale: float = 1.0
    distance_scale: float = 1.0
    drift_deg_per_m: float = 0.0
    ring_deg: float = 0.0
    sonar_deg: tuple[float, ...] = ()
    sigma: Mapping[str, Any] = field(default_factory=dict)
    recordings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, (low, high) in LIMITS.items():
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name} goes from {low:g} to {high:g}; it cannot be {getattr(self, name)}")
        for off in (self.ring_deg, *self.sonar_deg):
            if not abs(off) <= LARGEST_BEARING_DEG:
                raise ValueError(f"a sonar is at most {LARGEST_BEARING_DEG:g}° off; it cannot be {off}")

    def bearing_deg(self, sonar: int) -> float:
        """How far that sonar looks past where its mounting has it."""
        return self.ring_deg + (self.sonar_deg[sonar] if self.sonar_deg else 0.0)

    def as_dict(self) -> dict[str, Any]:
        """Plain values; `from_dict` takes them back."""
        return asdict(self) | {"sonar_deg": list(self.sonar_deg), "recordings": list(self.recordings)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], sonars: int) -> "Calibration":
        """Of a robot with so many sonars. Raises ValueError or TypeError."""
        known = [entry.name for entry in fields(cls)]
        if not isinstance(data, Mapping):
            raise ValueError(f"calibration is a table, not {data!r}")
        for key in data:
            if key not in known:
                raise ValueError(f"unknown key {key!r} in its calibration; known are {', '.join(known)}")
        values = dict(data)
        for name in (*LIMITS, "ring_deg"):
            if name in values:
                values[name] = float(values[name])
        values["sonar_deg"] = tuple(float(off) for off in data.get("sonar_deg", ()))
        if values["sonar_deg"] and len(values["sonar_deg"]) != sonars:
            raise ValueError(f"its calibration has {len(values['sonar_deg'])} sonar_deg for {sonars} sonars")
        values["sigma"] = dict(data.get("sigma", {}))
        values["recordings"] = tuple(str(digest) for digest in data.get("recordings", ()))
        return cls(**values)


def reckoning(calibration: Calibration | None) -> Callable[[Place], Place]:
    """Takes odometry's places one after another and gives each as it is with the errors taken out.

    The first place is taken as it is. Where odometry begins anew, the caller goes on from the place before.
    """
    return (lambda place: place) if calibration is None else _Reckoning(calibration).place


class _Reckoning:
    """Dead reckoning along odometry's own steps; the way is kept in fractions of a µm, the heading follows exactly."""

    def __init__(self, calibration: Calibration) -> None:
        self._calibration = calibration
        self._drift = calibration.drift_deg_per_m / 360.0 * TURN * 1e-6  # heading units a µm
        self._first = 0  # heading
        self._last: Place | None = None
        self._ahead = 0  # µm driven forwards
        self._heading = 0
        self._x = self._y = 0.0

    def place(self, raw: Place) -> Place:
        """The next place, corrected."""
        if self._last is None:
            self._last = raw
            self._first = self._heading = raw[2]
            self._x, self._y = float(raw[0]), float(raw[1])
            return raw
        dx, dy = raw[0] - self._last[0], raw[1] - self._last[1]
        middle = 0.5 * (raw[2] + self._last[2])
        sine, cosine = dmath.sincos(middle % TURN * RADIANS)
        self._ahead += round(cosine * dx + sine * dy)
        turned = (raw[2] - self._first) * self._calibration.rotation_scale
        heading = self._first + round(turned - self._drift * self._ahead)
        off = 0.5 * (heading + self._heading) - middle
        sine, cosine = dmath.sincos(off % TURN * RADIANS)
        self._x += self._calibration.distance_scale * (cosine * dx - sine * dy)
        self._y += self._calibration.distance_scale * (sine * dx + cosine * dy)
        self._last, self._heading = raw, heading
        return round(self._x), round(self._y), heading
