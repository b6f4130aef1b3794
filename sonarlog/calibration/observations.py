"""What a recording says of its robot's errors: arcs of single sonars on walls seen again, and odometry in between.

The walls come from a replay with `paper`; the arcs are those of the beams as they were, nothing fitted.
Must not know: what the errors are, how they are found.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from slam.arcs import Arc, ArcConfig, find_arcs
from slam.geometry import Segment, wrap
from slam.self_calibration import Calibration, SelfCalibrationConfig, self_calibrate
from slam.sweep import TURN, Mounting, SonarRing, Sweep
from sonarlog.calibration.sightings import Seen, sure_walls, walk
from sonarlog.log import Floats, Ints, Log

Advance = Callable[[], None]

LONGEST = 60  # sweeps adjusted as one
NEAR_M, NEAR_RAD = 0.08, 0.2  # an arc this near to a wall of its sweep is one of that wall
FEWEST_SONARS = 3
METRES, RADIANS = 1e-6, 2.0 * np.pi / TURN


@dataclass(frozen=True)
class Way:
    """Odometry from one sweep's reference reading to the next's, in n pieces, in the frame of the first.

    dx, dy: metres; ahead: metres driven forwards; heading: rad halfway through the piece; turned: rad. All (n,).
    """

    dx: Floats
    dy: Floats
    ahead: Floats
    heading: Floats
    turned: Floats


@dataclass(frozen=True)
class Arcs:
    """a arcs: of which sweep, which wall and which sonar (a,); `turn` rad of odometry since the reference reading when
    the sonar looked along the normal, `bearing` rad of that in the sweep's frame, `distance` m of the wall from it.
    `aside` rad is what the bearing would be off by if it were not a wall but a corner or a pole: a wall's normal is the
    same wherever a sonar sits, a point is seen under another angle from beside.
    """

    sweep: Ints
    wall: Ints
    sonar: Ints
    turn: Floats
    bearing: Floats
    distance: Floats
    aside: Floats

    def __len__(self) -> int:
        return len(self.sweep)


@dataclass(frozen=True)
class Stretch:
    """Sweeps of one recording whose odometry is connected: `ways` from each to the next, and the arcs they saw.

    poses (n, 3) and walls (m, 2) of α and ρ, metres and radians, are where the replay had them.
    """

    poses: Floats
    walls: Floats
    ways: tuple[Way, ...]
    arcs: Arcs

    @property
    def metres(self) -> float:
        """Driven forwards or backwards."""
        return float(sum(np.abs(way.ahead).sum() for way in self.ways))

    @property
    def turns(self) -> float:
        """Turned in between, whole circles left and right."""
        return float(sum(np.abs(way.turned).sum() for way in self.ways)) / (2.0 * np.pi)


def stretches(log: Log, sweeps: Sequence[Sweep], advance: Advance = lambda: None) -> list[Stretch]:
    """A log's sweeps in stretches of at most LONGEST of one session; `advance` is called after each sweep."""
    found: list[list[Sweep]] = []
    for sweep in sweeps:
        if found and len(found[-1]) < LONGEST and found[-1][-1].session == sweep.session:
            found[-1].append(sweep)
        else:
            found.append([sweep])
    return [_stretch(log, part, advance) for part in found]


def _stretch(log: Log, sweeps: list[Sweep], advance: Advance) -> Stretch:
    ring = log.robot.ring()
    steps: list[Seen] = []
    for seen in walk(sweeps, ring):
        steps.append(seen)
        advance()
    chains = steps[-1].chains
    sure = sure_walls(chains)
    rows: list[tuple[int, int, Arc]] = []
    numbers: dict[int, int] = {}
    for place, seen in enumerate(steps):
        walls = [(chain, wall) for chain, wall in seen.walls if chain in sure]
        for chain, arcs in _arcs_by_wall(seen.sweep, ring, walls).items():
            wall = numbers.setdefault(chain, len(numbers))
            rows += [(place, wall, arc) for arc in arcs]
    roots = [chains.root(chain) for chain in numbers]
    return Stretch(
        poses=np.array([(seen.pose.x, seen.pose.y, seen.pose.theta) for seen in steps]),
        walls=np.array([(root.alpha, root.rho) for root in roots]).reshape(-1, 2),
        ways=tuple(_way(log, a, b) for a, b in pairwise(sweeps)),
        arcs=_columns(rows, ring),
    )


def _columns(rows: list[tuple[int, int, Arc]], ring: SonarRing) -> Arcs:
    return Arcs(
        sweep=np.array([sweep for sweep, _, _ in rows], dtype=np.int64),
        wall=np.array([wall for _, wall, _ in rows], dtype=np.int64),
        sonar=np.array([arc.sonar for _, _, arc in rows], dtype=np.int64),
        turn=np.array([arc.bearing - ring.mountings[arc.sonar].heading for _, _, arc in rows]),
        bearing=np.array([arc.bearing for _, _, arc in rows]),
        distance=np.array([arc.distance for _, _, arc in rows]),
        aside=np.array([-_beside(ring.mountings[arc.sonar]) / arc.distance for _, _, arc in rows]),
    )


def _beside(mounting: Mounting) -> float:
    """How far to the left of the line through the robot's centre along its axis a sonar sits, m."""
    return float(np.cos(mounting.heading) * mounting.y - np.sin(mounting.heading) * mounting.x)


def _arcs_by_wall(sweep: Sweep, ring: SonarRing, walls: list[tuple[int, Segment]]) -> dict[int, list[Arc]]:
    """The arcs of each chain's wall in this sweep, by chain, where enough sonars saw it."""
    plain = SelfCalibrationConfig(fit=False)
    beams = self_calibrate(sweep, ring, None, Calibration.unknown(len(ring.mountings)), plain).beams
    found: dict[int, list[Arc]] = {}
    for arc in find_arcs(beams, ArcConfig(), closed=False):
        near = [
            (abs(wrap(arc.bearing - wall.alpha)), chain)
            for chain, wall in walls
            if abs(arc.distance - wall.rho) <= NEAR_M
        ]
        if arc.whole and near and min(near)[0] <= NEAR_RAD:
            found.setdefault(min(near)[1], []).append(arc)
    return {chain: arcs for chain, arcs in found.items() if len({arc.sonar for arc in arcs}) >= FEWEST_SONARS}


def _way(log: Log, before: Sweep, after: Sweep) -> Way:
    """Odometry's own pieces; their way is turned by what the heading is wrong by, so each needs its heading."""
    odometry = log.odometry
    begin, end = int(before.t_ns[before.reference]), int(after.t_ns[after.reference])
    inside = (odometry.t_ns > begin) & (odometry.t_ns < end) & (odometry.session == before.session)
    x, y, heading = (
        np.concatenate([own[0][before.reference, None], rows[inside], own[1][after.reference, None]]).astype(np.float64)
        for own, rows in (
            ((before.x_um, after.x_um), odometry.x_um),
            ((before.y_um, after.y_um), odometry.y_um),
            ((before.heading, after.heading), odometry.heading),
        )
    )
    turned = np.diff(heading) * RADIANS
    middle = (0.5 * (heading[1:] + heading[:-1]) - heading[0]) * RADIANS
    sine, cosine = np.sin(heading[0] * RADIANS), np.cos(heading[0] * RADIANS)
    dx, dy = np.diff(x) * METRES, np.diff(y) * METRES
    dx, dy = cosine * dx + sine * dy, cosine * dy - sine * dx
    return Way(dx, dy, np.cos(middle) * dx + np.sin(middle) * dy, middle, turned)
