"""How odometry errs: what the wheels turned, and what the robot made of it on the floor.

Must not know: walls, commands, packets.
"""

from dataclasses import dataclass, fields, replace
from math import sqrt

from slam.dmath import DEGREE, PI
from sonarlog.errors import SonarlogError
from sonarlog.sim.rng import Noise

_PATCH_M, _PATCH_TURN = 0.1, 0.1 * 2.0 * PI
"""The floor is made of patches, of one grip each: so much driven, or a tenth of a turn."""
_TYPICAL = {"rotation": 0.006, "distance": 0.006, "drift": 0.32, "slip": 0.4}
_LIMITS = {"rotation": (0.5, 2.0), "distance": (0.5, 2.0), "drift": (-45.0, 45.0), "slip": (0.0, 45.0)}


class BadOdometry(SonarlogError):
    """Errors of odometry that cannot be read, or that no robot has."""

    def __init__(self, text: str) -> None:
        limits = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in _LIMITS.items())
        super().__init__(
            f"odometry {text!r} is neither a factor from 0 to 10 for the seed's own errors (0 is perfect) "
            f"nor a list such as rotation=1.01,drift=0.3; known are {limits}"
        )


@dataclass(frozen=True)
class OdometryErrors:
    """What odometry says over what is true; the defaults say the truth.

    rotation, distance: its turn and its metre, over the true ones. drift: its heading runs away from the true one by
    so many degrees a metre driven. slip: standard deviation of heading, in degrees per √metre driven or √turn turned.
    """

    rotation: float = 1.0
    distance: float = 1.0
    drift: float = 0.0
    slip: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            low, high = _LIMITS[field.name]
            if not low <= getattr(self, field.name) <= high:
                raise BadOdometry(f"{field.name}={getattr(self, field.name)}")


def draw_errors(seed: int, scale: float = 1.0) -> OdometryErrors:
    """This seed's robot: each error between 0.7 and 1.3 of what is typical, times `scale`, to either side."""
    noise = Noise(seed, "wheels")
    size = {}
    for n, (name, typical) in enumerate(_TYPICAL.items()):
        sign = 1.0 if noise.bits(2 * n) & 1 else -1.0
        size[name] = sign * typical * scale * (0.7 + 0.6 * noise.uniform(2 * n + 1))
    return OdometryErrors(1.0 + size["rotation"], 1.0 + size["distance"], size["drift"], abs(size["slip"]))


def parse_errors(text: str, seed: int) -> OdometryErrors:
    """A factor on the seed's own errors, or a list of named errors with the rest perfect. Raises BadOdometry."""
    try:
        if "=" not in text:
            scale = float(text)
            if not 0.0 <= scale <= 10.0:
                raise BadOdometry(text)
            return draw_errors(seed, scale)
        pairs = [part.split("=") for part in text.split(",")]
        return replace(OdometryErrors(), **{name.strip(): float(value) for name, value in pairs})
    except (ValueError, TypeError):
        raise BadOdometry(text) from None


class Floor:
    """Turns what the wheels did into what the robot did; the grip of patch n is number n of the seed's noise."""

    def __init__(self, errors: OdometryErrors, seed: int) -> None:
        self._errors = errors
        self._noise = Noise(seed, "slip")
        self._patches = 0.0
        self._patch = -1
        self._skew = 0.0  # rad of heading lost over this patch

    def true_motion(self, distance: float, turn: float) -> tuple[float, float]:
        """Metres and radians that come of these metres and radians of the wheels."""
        errors = self._errors
        passed = abs(distance) / _PATCH_M + abs(turn) / _PATCH_TURN
        self._patches += passed
        if int(self._patches) != self._patch:
            self._patch = int(self._patches)
            self._skew = self._noise.normal(self._patch) * errors.slip * DEGREE * sqrt(0.1)
        lost = errors.drift * DEGREE * distance + self._skew * passed
        return distance / errors.distance, turn / errors.rotation - lost
