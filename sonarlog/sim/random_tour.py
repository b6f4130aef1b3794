"""The way through a random place, as a route's text and as the line it runs along in truth.

Must not know: walls, chance.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from math import ceil

from sonarlog.sim.outline import Point, Stretch

STATION_M = 0.8
NARROW_M = 2.2
BLIND_M, NARROW_BLIND_M = 0.7, 1.4


@dataclass(frozen=True)
class Visit:
    """At `along` of a leg the robot turns to that side (1 left, -1 right), goes in so deep, and comes back."""

    along: float
    side: int
    deep: float


@dataclass
class Tour:
    """A route in the making. `line` holds the points between which the robot goes straight."""

    steps: list[str] = field(default_factory=list)
    line: list[Point] = field(default_factory=list)

    @property
    def text(self) -> str:
        """As `sonarlog record --route` takes it."""
        return "; ".join(self.steps)

    def along(
        self, stretch: Stretch, begin: float, end: float, visits: tuple[Visit, ...] = (), *, hall: bool = False
    ) -> None:
        """From here to there along a stretch, a scan before each step, in and out at the visits.

        The robot keeps to the middle by what its sonars see; it goes straight on by odometry in a hall, and near
        openings and bends, where they see too much: in a narrow way an edge ahead looks like its end.
        """
        bend = BLIND_M if stretch.leg.left + stretch.leg.right > NARROW_M else NARROW_BLIND_M
        visits = tuple(sorted(visits, key=lambda visit: visit.along))
        stops = [begin, *(visit.along for visit in visits), end]
        for i, (a, b) in enumerate(pairwise(stops)):
            places = _places(a, b)
            for here, there in pairwise(places):
                near = here - a < (BLIND_M if i else bend) or b - there < (BLIND_M if i < len(visits) else bend) or hall
                self.line += [stretch.at(here), stretch.at(there)]
                self.steps += ["scan", f"{'go' if near else 'follow'} {there - here:.2f}"]
            if i < len(visits):
                self._visit(stretch, visits[i])

    def turn(self, degrees: float) -> None:
        """On the spot, at the end of a leg, after a scan there."""
        self.steps += ["scan", f"turn {degrees:g}"]

    def _visit(self, stretch: Stretch, visit: Visit) -> None:
        places = _places(0.0, visit.deep)
        self.line += [stretch.at(visit.along), stretch.at(visit.along, visit.side * visit.deep)]
        self.steps += ["scan", f"turn {90 * visit.side}"]
        for here, there in pairwise(places):
            self.steps += [f"go {there - here:.2f}", "scan"]
        # Back the other way round, so that what odometry gets wrong about turns does not add up.
        self.steps += [f"turn {-180 * visit.side}", f"go {visit.deep:.2f}", f"turn {90 * visit.side}"]

    def mirrored(self) -> "Tour":
        """The same the other way round: left is right."""
        steps = [f"turn {-float(s[5:]):g}" if s.startswith("turn ") else s for s in self.steps]
        return Tour(steps, [(x, -y) for x, y in self.line])


def _places(begin: float, end: float) -> list[float]:
    """Where the robot stands between two stops, in whole centimetres."""
    count = max(1, ceil((end - begin) / (STATION_M + 0.05)))
    return [round(begin + (end - begin) * k / count, 2) for k in range(count + 1)]
