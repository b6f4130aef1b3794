"""Routes made of other routes: with scans closer together or further apart, or with none.

Must not know: worlds, robots.
"""

from collections.abc import Iterator

from sonarlog.route import Action, Follow, Go, Repeat, Route, Scan, walk

SHORTEST_M = 0.1
"""No step is shorter: what would be left goes with the step before."""


def actions(route: Route) -> Iterator[Action]:
    """Every action, as where no way is closed."""
    walker = walk(route)
    try:
        action = next(walker)
        while True:
            yield action
            action = walker.send(False)
    except StopIteration:
        return


def respaced(route: Route, spacing: float) -> Route:
    """The same way with a scan at its beginning, after every so many metres of it, and at its end."""
    steps: list[Action] = [Scan()]
    since = 0.0
    for action in actions(route):
        if isinstance(action, Scan):
            continue
        if not isinstance(action, Go | Follow):
            steps.append(action)
            continue
        left, way = abs(action.metres), 1.0 if action.metres > 0 else -1.0
        while left > 0.0:
            step = min(left, spacing - since)
            step = left if left - step < SHORTEST_M else step
            steps.append(type(action)(round(way * step, 3)))
            left, since = round(left - step, 3), since + step
            if since >= spacing - SHORTEST_M:
                steps.append(Scan())
                since = 0.0
    return (*steps, Scan()) if not isinstance(steps[-1], Scan) else tuple(steps)


def without_scans(route: Route) -> Route:
    """The same way without a scan: the robot looks only while it drives."""
    return tuple(
        Repeat(step.times, inner) if isinstance(step, Repeat) else step
        for step in route
        if not isinstance(step, Scan) and (inner := without_scans(step.steps) if isinstance(step, Repeat) else (step,))
    )
