"""Someone who walks beside the robot and sees where it is: a tour driven true, however much odometry errs.

What the robot records is not touched by that: its odometry and sonars err as they do. Must not know: worlds, files.
"""

from collections.abc import Callable, Iterator

from slam.dmath import DEGREE, atan2, hypot, sincos
from sonarlog.bench.routes import actions
from sonarlog.route import Action, Go, Route, Scan, Turn
from sonarlog.surroundings import wrap

TURN_DEG, STEP_M = 2.0, 0.05
"""Less than this off, nothing is corrected."""
FAR_M = 0.3
"""So near to its goal the robot is not turned to it any more: the next goal is."""

WhereIs = Callable[[], tuple[float, float, float]]
"""Where the robot truly is: x m, y m, heading in degrees."""


def guided(route: Route, where_is: WhereIs) -> Iterator[Action]:
    """The route's actions as they have to be now to come to where they lead on paper, from (0, 0, 0) on.

    `follow` goes straight on, too.
    """
    x, y, heading = 0.0, 0.0, 0.0
    for action in actions(route):
        if isinstance(action, Scan):
            yield action
        elif isinstance(action, Turn):
            heading += action.degrees
            # A half turn to the left stays one to the left, whatever little is left to correct.
            before = heading - action.degrees
            yield Turn(action.degrees + wrap(before - where_is()[2]))
        else:
            sine, cosine = sincos(heading * DEGREE)
            x, y = x + action.metres * cosine, y + action.metres * sine
            yield from _towards(x, y, heading, where_is, backwards=action.metres < 0)


def _towards(x: float, y: float, heading: float, where_is: WhereIs, *, backwards: bool) -> Iterator[Action]:
    true_x, true_y, true_heading = where_is()
    dx, dy = x - true_x, y - true_y
    sine, cosine = sincos(heading * DEGREE)
    distance = dx * cosine + dy * sine
    if abs(distance) > FAR_M:
        heading = atan2(dy, dx) / DEGREE + (180.0 if backwards else 0.0)
        distance = hypot(dx, dy) * (-1.0 if backwards else 1.0)
    off = wrap(heading - true_heading)
    if abs(off) > TURN_DEG:
        yield Turn(off)
    if (distance < -STEP_M) if backwards else (distance > STEP_M):
        yield Go(distance)
