"""The conditions of the bench: what is otherwise than usual about robot, sonar, odometry or route.

Must not know: worlds, algorithms.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources

from sonarlog.errors import SonarlogError


class BadCondition(SonarlogError):
    """A condition that nobody knows."""

    def __init__(self, name: str) -> None:
        super().__init__(f"there is no condition {name!r}; known are {', '.join(CONDITIONS)}, or all")


@dataclass(frozen=True)
class Condition:
    """One row of the bench.

    `settings` of the simulator's URL, each with the values that the seeds take in turn. `spacing`: metres from scan to
    scan, if not the usual 0.8; `scans` False: none at all. `robot`: a file of `sonarlog/bench/robots`. `guided`: a
    tour by odometry alone would not come round, so somebody sees to that (`sonarlog/bench/guide.py`).
    """

    name: str
    about: str
    settings: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    spacing: float | None = None
    scans: bool = True
    robot: str = ""
    guided: bool = False

    def settings_of(self, seed: int) -> dict[str, str]:
        """What this seed takes."""
        return {key: values[seed % len(values)] for key, values in self.settings.items()}

    def robot_file(self) -> str | None:
        """Where the robot's file is."""
        return str(resources.files("sonarlog.bench") / "robots" / f"{self.robot}.toml") if self.robot else None


def _set(name: str, about: str, *, guided: bool = False, **settings: str) -> Condition:
    return Condition(name, about, {key: (value,) for key, value in settings.items()}, guided=guided)


PLAIN = Condition("plain", "as the simulator is: 1 cm of noise, 4 % of wild readings, 0.8 m from scan to scan")
_SONARS = tuple(map(str, range(8)))
_NOT_TO_THE_SIDE = tuple(f"{sonar}:1500" for sonar in (1, 2, 3, 4, 6, 7))  # the route is steered by those to the side

CONDITIONS = {
    condition.name: condition
    for condition in (
        PLAIN,
        _set("perfect", "odometry without error, sonar without noise and wild readings",
             odometry="0", noise="0", outliers="0"),
        *(_set(f"outliers-{n}", f"{n} % of wild readings", outliers=f"{n / 100:g}") for n in (3, 10, 20)),
        *(_set(f"noise-{cm}cm", f"{cm} cm of noise", noise=str(mm)) for cm, mm in (("0.5", 5), ("1", 10), ("3", 30))),
        *(Condition(f"spacing-{m}", f"{m} m from scan to scan", spacing=m, guided=m != 0.8)
          for m in (0.4, 0.8, 1.2, 1.6)),
        Condition("driving", "no turn in place to scan: the robot looks while it drives", scans=False, guided=True),
        *(_set(f"odometry-{f}", f"odometry errs {f} times as much", odometry=f, guided=float(f) > 1)
          for f in ("0.3", "1", "3", "6")),
        *(_set(f"mounting-{deg}", f"each sonar looks {deg}° past where it ought to", mounting=deg)
          for deg in ("0.5", "1", "2")),
        Condition("dead-sonar", "one sonar hears nothing", {"dead": _SONARS}),
        Condition("stuck-sonar", "one sonar always says 1.5 m", {"stuck": _NOT_TO_THE_SIDE}),
        _set("kidnapped-3deg", "turned by 3° unawares after 10 m", kick="after=10,turn=3", guided=True),
        _set("kidnapped-20cm", "put 20 cm to the side unawares after 10 m", kick="after=10,aside=0.2", guided=True),
        _set("kidnapped-20cm-ahead", "put 20 cm ahead unawares after 10 m", kick="after=10,ahead=0.2", guided=True),
        Condition("robot-ring8", "another robot: 8 sonars, one every 45°", robot="ring8"),
        Condition("robot-front8", "another robot: 8 sonars, all to the front half", robot="front8"),
        Condition("robot-ring16", "another robot: 16 sonars, one every 22.5°, two at a time", robot="ring16"),
    )
}  # fmt: skip
"""By name, in the order of the tables."""


def conditions_named(names: Sequence[str]) -> list[Condition]:
    """The conditions of these names; `all` is every one. Raises BadCondition."""
    for name in names:
        if name != "all" and name not in CONDITIONS:
            raise BadCondition(name)
    chosen = CONDITIONS if "all" in names else names
    return [CONDITIONS[name] for name in dict.fromkeys(chosen)]
