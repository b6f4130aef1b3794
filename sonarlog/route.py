"""A route: what the robot is to do, as text and as steps.

    scan; go 0.8; turn 90; repeat 3 (scan; follow 0.8)
    calibration 1

Must not know: the robot, time, what became of a step (whoever drives says so).
"""

import re
from collections.abc import Generator
from dataclasses import dataclass
from typing import Never

from sonarlog.errors import SonarlogError

WORDS = "scan, go METRES, turn DEGREES, follow METRES, repeat N (…), calibration METRES"
LONGEST = 1000.0  # metres in one step
CALIBRATION_SIDE = 1.0  # metres; safe in a free space of two


class BadRoute(SonarlogError):
    """A route that cannot be read; says where and what would do."""

    def __init__(self, text: str, at: int, problem: str) -> None:
        line = text.count("\n", 0, at) + 1
        column = at - (text.rfind("\n", 0, at) + 1) + 1
        where = f"line {line}, character {column}" if "\n" in text.strip() else f"character {column}"
        super().__init__(f"route, {where}: {problem}; a route is made of {WORDS}, separated by ;")


@dataclass(frozen=True)
class Scan:
    """Turn on the spot by a full circle."""


@dataclass(frozen=True)
class Go:
    """Straight on by odometry, backwards if negative."""

    metres: float


@dataclass(frozen=True)
class Turn:
    """On the spot by odometry, counter-clockwise."""

    degrees: float


@dataclass(frozen=True)
class Follow:
    """Onwards in the middle of what the sonars see."""

    metres: float


@dataclass(frozen=True)
class Repeat:
    """The steps, so many times; ends early when a step inside finds the way closed."""

    times: int
    steps: "tuple[Step, ...]"


Action = Scan | Go | Turn | Follow
Step = Action | Repeat
Route = tuple[Step, ...]

TOKEN = re.compile(r"\s*(?:#[^\n]*\s*)*([A-Za-z]+|[-+]?[0-9]*\.?[0-9]+|$|.)")


def parse_route(text: str) -> Route:
    """The steps of a route's text (words in any case, `#` comments to the end of a line). Raises BadRoute."""
    reader = _Reader(text)
    steps = _steps(reader)
    if reader.token:
        reader.fail(f"{reader.token!r} is not expected here")
    if not steps:
        reader.fail("the route is empty")
    return steps


def default_route(spacing: float, stations: int) -> Route:
    """Scan, and follow what is open to the next scan, until the way is closed or there were `stations` scans."""
    return (Scan(), Repeat(stations - 1, (Follow(spacing), Scan()))) if stations > 1 else (Scan(),)


def calibration_route(side: float) -> Route:
    """Squares of that side about where the robot stands, both ways by turns, as UMBmark drives them, with scans.

    One each way with a scan on every side, then two each way with a scan at the end: what heading loses by the metre
    shows over metres, what it loses by the turn in the scans, and left and right squares tell the two apart.
    Borenstein and Feng, Measurement and correction of systematic odometry errors in mobile robots, 1996.
    """
    half = Go(side / 2)

    def square(way: int, *after: Action) -> Route:
        return (Repeat(4, (half, Turn(90.0 * way), half, *after)), Turn(180.0 * way))

    plain = (Repeat(2, (*square(1), Scan(), *square(-1), Scan())),)
    return (Scan(), half, Turn(90.0), *square(1, Scan()), *square(-1, Scan()), *plain)


def walk(route: Route) -> Generator[Action, bool, bool]:
    """Action after action; whoever drives sends back whether the way was closed (it made no headway).

    That ends the `repeat` around it, innermost only; outside of one the route goes on.
    """
    for step in route:
        if isinstance(step, Repeat):
            for _ in range(step.times):
                if (yield from _pass(step.steps)):
                    break
        else:
            yield step
    return False


def _pass(steps: Route) -> Generator[Action, bool, bool]:
    for step in steps:
        if isinstance(step, Repeat):
            yield from walk((step,))
        elif (yield step):
            return True
    return False


class _Reader:
    """One token ahead."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._end = 0
        self.next()

    def next(self) -> None:
        match = TOKEN.match(self.text, self._end)
        assert match is not None  # the pattern ends in "anything"
        self.token = match.group(1).lower()
        self.start = match.start(1)
        self._end = match.end()

    def number(self, word: str, unit: str, low: float, high: float) -> float:
        at = self.start
        try:
            value = float(self.token)
        except ValueError:
            self.fail(f"{word} needs a number of {unit}" + (f", not {self.token!r}" if self.token else ""))
        if not low <= value <= high:
            raise BadRoute(self.text, at, f"{word} {value:g} is outside {low:g}..{high:g}")
        self.next()
        return value

    def expect(self, token: str, after: str) -> None:
        if self.token != token:
            self.fail(f"{after} needs {token!r}" + (f", not {self.token!r}" if self.token else ""))
        self.next()

    def fail(self, problem: str) -> Never:
        raise BadRoute(self.text, self.start, problem)


def _steps(reader: _Reader) -> Route:
    steps: list[Step] = []
    while reader.token not in ("", ")"):
        if reader.token == ";":
            reader.next()
            continue
        steps.append(_step(reader))
        if reader.token not in ("", ")", ";"):
            reader.fail(f"';' is missing before {reader.token!r}")
    return tuple(steps)


def _step(reader: _Reader) -> Step:
    word, at = reader.token, reader.start
    if word not in ("scan", "go", "turn", "follow", "repeat", "calibration"):
        reader.fail(f"{word!r} is no step")
    reader.next()
    if word == "scan":
        return Scan()
    if word == "calibration":
        given = reader.token not in ("", ")", ";")
        side = reader.number(word, "metres", 0.3, 10) if given else CALIBRATION_SIDE
        return Repeat(1, calibration_route(side))
    if word == "turn":
        return Turn(reader.number(word, "degrees", -3600, 3600))
    if word == "go":
        return Go(reader.number(word, "metres", -LONGEST, LONGEST))
    if word == "follow":
        return Follow(reader.number(word, "metres", 0.05, LONGEST))
    times = reader.number(word, "times", 1, 100_000)
    if times != int(times):
        raise BadRoute(reader.text, at, f"{times:g} is not a whole number of times")
    reader.expect("(", "repeat N")
    steps = _steps(reader)
    reader.expect(")", "repeat")
    if not steps:
        raise BadRoute(reader.text, at, "nothing to repeat")
    return Repeat(int(times), steps)
