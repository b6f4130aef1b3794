"""The odometer: positions as SIPs have them to one way that goes on, over the wraps of their counters and over resets.

Must not know: packets, when they came, what is made of the way.
"""

from slam import dmath
from slam.sweep import TURN
from sonarlog.robot import Robot

WRAP = 1 << 15
"""X and Y count modulo this on 15-bit robots, and so they do on 16-bit ones."""

RADIANS = 6.283185307179586 / TURN

Units = tuple[int, int, int]  # x, y, heading in the robot's own units
Place = tuple[int, int, int]  # µm, µm, 1/TURN of a turn


class Odometer:
    """Where the robot is, from the first position on; the heading is not wrapped.

    After a reset it begins at zero with axes of its own: it is taken to go on where it was seen last, the way it looks.
    """

    def __init__(self, robot: Robot) -> None:
        self._units = (0, 0, 0)  # since it began, unwrapped
        self._step = (0, 0, 0)  # the last one
        self._base: Place = (0, 0, 0)  # where it began
        self._axes: tuple[float, float] | None = None  # cosine and sine of how its axes lie; None: as ours
        self.become(robot)

    def become(self, robot: Robot) -> None:
        """Go on with the parameters of the robot that has turned out to be there."""
        self._nm = round(robot.mm_per_unit * 1e6)
        self._turn = robot.heading_units_per_turn

    def begin(self, heading: int, missed: int = 0) -> None:
        """It counts anew, and says so far that heading; so many steps like the last one are taken to be missed."""
        x, y, turned = (now + missed * step for now, step in zip(self._units, self._step, strict=True))
        self._units = (x, y, turned)
        self._base, self._units, self._step = self.place(), (0, 0, 0), (0, 0, 0)
        off = (self._base[2] - self._heading(heading)) % TURN
        sine, cosine = dmath.sincos(off * RADIANS)
        self._axes = (cosine, sine) if off else None

    def step(self, before: Units, now: Units) -> Units:
        """From one position to the next, the short way round each wrap."""
        x, y, heading = (b - a for a, b in zip(before, now, strict=True))
        return shortest(x, WRAP), shortest(y, WRAP), shortest(heading, self._turn)

    def go(self, step: Units) -> None:
        """By so much it has gone on."""
        (x, y, heading), (dx, dy, turned) = self._units, step
        self._units, self._step = (x + dx, y + dy, heading + turned), step

    def place(self) -> Place:
        """Where the robot is."""
        x, y, heading = self._units
        x_um, y_um = (x * self._nm + 500) // 1000, (y * self._nm + 500) // 1000
        if self._axes is not None:
            cosine, sine = self._axes
            x_um, y_um = round(cosine * x_um - sine * y_um), round(sine * x_um + cosine * y_um)
        return self._base[0] + x_um, self._base[1] + y_um, self._base[2] + self._heading(heading)

    def _heading(self, units: int) -> int:
        return (units * TURN + self._turn // 2) // self._turn


def shortest(difference: int, modulus: int) -> int:
    """The difference modulo `modulus` that is nearest to zero."""
    return (difference + modulus // 2) % modulus - modulus // 2
