"""Routes: text to steps, where text goes wrong, and how a closed way ends a repeat."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sonarlog.route import (
    Action,
    BadRoute,
    Follow,
    Go,
    Repeat,
    Route,
    Scan,
    Turn,
    default_route,
    parse_route,
    walk,
)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("scan; go 0.8; turn 90; scan", (Scan(), Go(0.8), Turn(90), Scan())),
        ("SCAN ;; Turn -55\n; # there\nfollow .5;", (Scan(), Turn(-55), Follow(0.5))),
        ("repeat 2 (scan; repeat 3 (go -1))", (Repeat(2, (Scan(), Repeat(3, (Go(-1),)))),)),
        ("# a tour\n\nrepeat 12 (scan; follow 0.8); scan", (Repeat(12, (Scan(), Follow(0.8))), Scan())),
    ],
)
def test_text_to_steps(text: str, steps: Route) -> None:
    assert parse_route(text) == steps


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "character 1: the route is empty"),
        ("scan go 1", "character 6: ';' is missing before 'go'"),
        ("go", "character 3: go needs a number of metres"),
        ("go fast", "character 4: go needs a number of metres, not 'fast'"),
        ("go 1e9", "';' is missing before 'e'"),
        ("turn 4000", "character 6: turn 4000 is outside -3600..3600"),
        ("follow -1", "follow -1 is outside"),
        ("jump 3", "character 1: 'jump' is no step"),
        ("scan; @", "character 7: '@' is no step"),
        ("repeat 2 scan", r"character 10: repeat N needs '\(', not 'scan'"),
        ("repeat 2 (scan", r"repeat needs '\)'"),
        ("repeat 2.5 (scan)", "2.5 is not a whole number of times"),
        ("repeat 2 ()", "nothing to repeat"),
        ("scan)", "'\\)' is not expected here"),
        ("scan;\ngo x\n;scan", "line 2, character 4: go needs"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(text: str, message: str) -> None:
    with pytest.raises(BadRoute, match=message):
        parse_route(text)


def actions(route: Route, closed_at: set[int]) -> list[Action]:
    walker, done = walk(route), []
    try:
        action = next(walker)
        while True:
            done.append(action)
            action = walker.send(len(done) - 1 in closed_at)
    except StopIteration:
        return done


def test_a_closed_way_ends_the_repeat_around_it_only() -> None:
    route = parse_route("repeat 2 (scan; repeat 9 (follow 1; scan); turn 180); go 1; scan")
    onwards = [Follow(1), Scan()]
    lap = [Scan(), *onwards, *onwards, Follow(1), Turn(180)]
    assert actions(route, {5, 12, 14}) == [*lap, *lap, Go(1), Scan()]


def test_the_default_route_ends_with_a_scan_where_the_way_is_closed() -> None:
    assert actions(default_route(0.8, 3), set()) == [Scan(), Follow(0.8), Scan(), Follow(0.8), Scan()]
    assert actions(default_route(0.8, 40), {3}) == [Scan(), Follow(0.8), Scan(), Follow(0.8)]
    assert actions(default_route(0.8, 1), set()) == [Scan()]


@given(st.text(alphabet="scangoturfllwrepeat 0123456789.-();#\n", max_size=60))
def test_any_text_is_read_or_refused(text: str) -> None:
    refused = ""
    try:
        assert parse_route(text)
    except BadRoute as error:
        refused = str(error)
    assert not refused or refused.startswith("route, ")


def driven(route: Route) -> tuple[float, float, float]:
    """Where a perfect robot ends, and the largest coordinate it ever had."""
    x = y = heading = largest = 0.0
    walker = walk(route)
    try:
        action = next(walker)
        while True:
            if isinstance(action, Turn):
                heading += action.degrees
            elif isinstance(action, Go):
                x += action.metres * math.cos(math.radians(heading))
                y += action.metres * math.sin(math.radians(heading))
                largest = max(largest, abs(x), abs(y))
            action = walker.send(False)
    except StopIteration:
        return math.hypot(x - 0.5, y), heading, largest


def test_a_calibration_stays_in_its_square_and_turns_as_often_left_as_right() -> None:
    off, heading, largest = driven(parse_route("calibration 1"))
    assert off == pytest.approx(0.0, abs=1e-9)
    assert heading == pytest.approx(90.0)
    assert largest == pytest.approx(0.5)
    assert parse_route("calibration") == parse_route("calibration 1") != parse_route("calibration 2; scan")
    with pytest.raises(BadRoute, match=r"calibration 50 is outside 0.3\.\.10"):
        parse_route("calibration 50")
