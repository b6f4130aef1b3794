"""What may be wrong with the robot itself: sonars that look elsewhere than its file says, are dead or stuck; a kick.

Must not know: worlds, sound, odometry, packets.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from sonarlog.errors import SonarlogError
from sonarlog.sim.rng import Noise

LARGEST_MOUNTING_DEG = 20.0


class BadFault(SonarlogError):
    """A fault that cannot be read, or that the robot cannot have."""


@dataclass(frozen=True)
class SonarFaults:
    """Faults by the number of the sonar. None by default.

    mounting_deg: how far each sonar looks past where the robot's file has it, by number; those not named look there.
    stuck_mm: what each of these sonars says at every ping, whatever is there; a dead one says that nothing answers.
    """

    mounting_deg: tuple[float, ...] = ()
    stuck_mm: Mapping[int, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Kick:
    """Someone moves the robot in one step, as soon as its wheels have run `after` metres, and it does not notice.

    turn: degrees counter-clockwise; ahead, aside: metres forward and to the left.
    """

    after: float
    turn: float = 0.0
    ahead: float = 0.0
    aside: float = 0.0

    def __post_init__(self) -> None:
        for name, (low, high) in _KICK_LIMITS.items():
            if not low <= getattr(self, name) <= high:
                raise ValueError(name)


_KICK_LIMITS = {"after": (0.0, 10_000.0), "turn": (-180.0, 180.0), "ahead": (-1.0, 1.0), "aside": (-1.0, 1.0)}


def draw_mounting(size_deg: float, count: int, seed: int) -> tuple[float, ...]:
    """This seed's mounting errors of so many sonars: 0.7 to 1.3 times that many degrees each, to either side."""
    noise = Noise(seed, "mounting")
    return tuple(
        (size_deg if noise.bits(2 * n) & 1 else -size_deg) * (0.7 + 0.6 * noise.uniform(2 * n + 1))
        for n in range(count)
    )


def parse_faults(
    mounting_deg: float, dead: str, stuck: str, *, seed: int, sonars: int, max_range_mm: int
) -> SonarFaults:
    """From the settings' text: `dead` is `0,3`, `stuck` is `2:1500,5:800` (mm). Raises BadFault."""
    held = {_sonar("dead", part, sonars): max_range_mm for part in _parts(dead)}
    for part in _parts(stuck):
        number, colon, range_mm = part.partition(":")
        if not colon or not range_mm.strip().isdecimal() or not 0 < int(range_mm) <= max_range_mm:
            raise BadFault(f"stuck={stuck!r} is no list of SONAR:MM such as 2:1500, with 1 to {max_range_mm} mm")
        held[_sonar("stuck", number, sonars)] = int(range_mm)
    return SonarFaults(draw_mounting(mounting_deg, sonars, seed) if mounting_deg else (), held)


def parse_kick(text: str) -> Kick | None:
    """From `after=10,turn=3` or `after=10,aside=0.2`; None for no text. Raises BadFault."""
    if not text:
        return None
    try:
        pairs = [part.split("=") for part in text.split(",")]
        return Kick(**{name.strip(): float(value) for name, value in pairs})
    except (ValueError, TypeError):
        known = ", ".join(f"{f.name} {_KICK_LIMITS[f.name][0]:g} to {_KICK_LIMITS[f.name][1]:g}" for f in fields(Kick))
        raise BadFault(f"kick={text!r} is no list such as after=10,turn=3; known are {known}") from None


def _parts(text: str) -> list[str]:
    return [part for part in text.split(",") if part.strip()]


def _sonar(name: str, text: str, sonars: int) -> int:
    if not text.strip().isdecimal() or int(text) >= sonars:
        raise BadFault(f"{name}: there is no sonar {text.strip()!r}; this robot has 0 to {sonars - 1}")
    return int(text)
