"""What a bench is to do: cases, the recordings they need, and the algorithms that replay them.

Must not know: processes, files but their names, results.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from slam.algorithms import Algorithm, algorithm
from sonarlog.bench.conditions import CONDITIONS
from sonarlog.bench.recipe import Recipe
from sonarlog.errors import SonarlogError
from sonarlog.sim.world import RANDOM, load_world

FIVE = ("corridor", "bend", "loop", "office", "clutter")
_NUMBERS = re.compile(r"(\d+)(?:-(\d+))?")
_MOST = 10_000


class BadPlan(SonarlogError):
    """A bench that cannot be read."""


@dataclass(frozen=True)
class Contender:
    """An algorithm with some settings changed; `label` is how it was written: `graph` or `graph+association.d2_m=1`.

    It goes to other processes, which an algorithm's functions do not, so it holds names and values only.
    """

    label: str
    name: str
    settings: tuple[tuple[str, object], ...] = ()

    @property
    def algorithm(self) -> Algorithm:
        """As it is configured. Raises SlamError."""
        return algorithm(self.name).configured(dict(self.settings))


@dataclass(frozen=True)
class Case:
    """One recording's place in the bench."""

    world: str
    seed: int
    condition: str

    @property
    def place(self) -> str:
        """The name of the table's row: random places are one."""
        return RANDOM.rstrip(":") if self.world.startswith(RANDOM) else self.world

    def recipe(self) -> Recipe:
        """How its recording is made."""
        return Recipe.of(_world(self.world), self.seed, CONDITIONS[self.condition], self.world)


_world = cache(load_world)


@dataclass(frozen=True)
class Plan:
    """All of it."""

    worlds: tuple[str, ...]
    seeds: tuple[int, ...]
    conditions: tuple[str, ...]
    contenders: tuple[Contender, ...]

    def cases(self) -> list[Case]:
        """World by world within a condition: what matters most comes first."""
        return [Case(w, s, c) for c in self.conditions for w in self.worlds for s in self.seeds]


def worlds_of(text: str) -> tuple[str, ...]:
    """From `corridor,random:1-20,mine.toml`: random places by number or range. Raises BadPlan, BadWorld."""
    worlds: list[str] = []
    for part in parts_of("worlds", text):
        kind, colon, numbers = part.partition(":")
        if colon and f"{kind}:" == RANDOM:
            worlds += [f"{RANDOM}{number}" for number in numbers_of("worlds", numbers)]
        else:
            worlds.append(part)
    for world in worlds:
        _world(world)
    return tuple(dict.fromkeys(worlds))


def numbers_of(what: str, text: str) -> tuple[int, ...]:
    """`1-20` or `3,5,8-10`. Raises BadPlan."""
    numbers: list[int] = []
    for part in parts_of(what, text):
        match = _NUMBERS.fullmatch(part)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if not first <= last <= first + _MOST:
            raise BadPlan(f"{what}: {part!r} is no number and no range such as 1-20")
        numbers += range(first, last + 1)
    return tuple(dict.fromkeys(numbers))


def contender(text: str, parse_value: Callable[[str], object]) -> Contender:
    """From `NAME` or `NAME+block.key=value+…`. Raises BadPlan, SlamError."""
    name, *changes = text.split("+")
    settings: dict[str, object] = {}
    for change in changes:
        key, equals, value = change.partition("=")
        if not equals:
            raise BadPlan(f"algorithm {text!r}: {change!r} is no BLOCK.KEY=VALUE")
        settings[key.strip()] = parse_value(value.strip())
    made = Contender(text, name.strip(), tuple(settings.items()))
    made.algorithm  # noqa: B018 - it is refused here, not in some process later
    return made


def parts_of(what: str, text: str) -> list[str]:
    """The names between commas. Raises BadPlan."""
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if not parts:
        raise BadPlan(f"{what}: nothing is named")
    return parts
