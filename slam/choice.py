"""The choice among prospects: what each is worth, the best one near by, and the best one far off.

Must not know: how the map is read, what was decided before.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.frontier_config import FrontierConfig
from slam.intent import Intent
from slam.planning import DIAGONAL, STRAIGHT, Cell, Ground, Path, Ways
from slam.prospects import Prospects
from slam.roads import Journeys, Roads
from slam.scene import Scene
from slam.sweep import Ints
from slam.terrain import COARSE
from slam.window import Window

FIRST_M = 1.5
"""Places so near are looked at first; then, as long as any may be better, those twice as far."""

ENTRY_M = 4.0
"""Roads begin at scans that are so near by the way over the ground."""

ROUND = 16
"""Waves of the search for ways between two looks at what may still win."""


@dataclass(frozen=True)
class Region:
    """A piece of frontier: its cells, its middle (x, y) m, and the m² that the best place near it would show."""

    cells: int
    centre: tuple[float, float]
    gain_m2: float


@dataclass(frozen=True)
class Choice:
    """What was chosen: where to scan, what would be seen there, its value for the way, and the way, or most of it."""

    goal: tuple[float, float]
    region: Region
    value: float
    path: Path


@dataclass(frozen=True)
class Bar:
    """How much a place must show that the robot goes there, after so many `scans`, with that in mind."""

    config: FrontierConfig
    known: Intent
    scans: int
    last: bool = False

    def least(self, length_m: Floats) -> Floats:
        """The m² at least for ways so long."""
        config = self.config
        mapped = self.scans / config.picky_scans
        if self.last:
            least = np.minimum(config.min_gain_m2 + config.near_gain_m2 * length_m, self.enough)
            whole = config.min_gain_m2 + config.far_gain_m2 * length_m
            long = (length_m > config.far_m * self.scans) & (mapped > 1.0)
            return np.where(long, np.maximum(least, np.minimum(whole, config.enough_gain_m2)), least)
        more = config.more_gain_m2 * max(1.0, mapped)
        return np.minimum(config.min_gain_m2 + more * length_m, config.enough_gain_m2)

    @property
    def enough(self) -> float:
        """The m² that are enough in the end for any way that is not too long for what was driven."""
        config = self.config
        return min(config.far_enough_m2 * max(1.0, self.scans / config.weary_scans), config.far_most_m2)

    def worth(self, prospects: Prospects) -> Floats:
        """What each place is worth before the way to it: what it would show, less where the way was in vain before."""
        config, places = self.config, prospects.places
        worth = shown(prospects, config)
        if self.last:
            wide = (prospects.gains >= config.wide_m2) & (prospects.away >= 0.75 * config.apart_m)
            far = prospects.away >= 1.5 * config.apart_m
            worth = np.where(far, worth, 0.0)
            worth = np.where(wide, np.maximum(worth, np.where(far, config.far_enough_m2, self.enough)), worth)
        for each in self.known.vain:
            near = _metres(places, np.array([each.x, each.y])) < config.vain_m
            for _ in range(each.times):
                worth = np.where(near, worth * config.vain_share, worth)
        if self.known.goal is not None:
            same = _metres(places, np.array(self.known.goal)) < config.vain_m
            worth = np.where(same, worth * config.stay, worth)
        return worth

    def value(self, worth: Floats, length_m: Floats) -> Floats:
        """What places of that worth are worth for the ways to them; 0 where that is too little to go."""
        return np.where(worth >= self.least(length_m), worth / (length_m + self.config.settle_m), 0.0)


def shown(prospects: Prospects, config: FrontierConfig) -> Floats:
    """What a place would show, less near an earlier scan, and where the robot would know less where it is."""
    worth = np.minimum(prospects.gains, config.most_gain_m2) * (1.0 - config.lost * (2.0 - prospects.square))
    some = (prospects.away >= config.apart_m / 2.0) | (prospects.gains >= config.step_gain_m2)
    return np.where(some, worth * np.minimum(prospects.away / config.apart_m, 1.0), 0.0)


class Lookout:
    """What places in a window would show, looked at from the nearest on, and what is known without looking."""

    def __init__(self, scene: Scene, window: Window, start: Cell, config: FrontierConfig, more: Prospects) -> None:
        self.scene, self.prospects = scene, more
        self._apart_m = config.apart_m / 4.0
        coarse, fine = (scene.lattice(config.apart_m / part, window) for part in (2.0, 4.0))
        near = scene.ground.length_m(_least(start, fine[0] // COARSE, fine[1] // COARSE)) <= config.apart_m
        self._rows, self._columns = (
            np.concatenate([all_over, close[near]]) for all_over, close in zip(coarse, fine, strict=True)
        )
        self._straight = scene.ground.length_m(_least(start, self._rows // COARSE, self._columns // COARSE))
        self._within_m = -1.0
        self.most_m = float(self._straight.max(initial=0.0))

    def look(self, within_m: float) -> None:
        """Look at what is so near, as the crow flies."""
        new = (self._straight > self._within_m) & (self._straight <= within_m)
        if new.any():
            found = self.scene.prospects(self._rows[new], self._columns[new], self._apart_m)
            self.prospects = self.prospects.and_(found)
        self._within_m = max(self._within_m, within_m)


@dataclass(frozen=True)
class Afar:
    """Prospects (n,) out of the window, each `beside` a scan; all scans (k, 2) m and the roads between them."""

    prospects: Prospects
    beside: Ints
    scans: Floats
    roads: Roads


def near_by(lookout: Lookout, ways: Ways, bar: Bar) -> Choice | None:
    """The best of the places in the window. As many are looked at as may still win."""
    within_m = FIRST_M
    while True:
        lookout.look(within_m)
        best, value = _best(lookout, ways, bar)
        if within_m >= lookout.most_m or value > bar.config.most_gain_m2 * bar.config.stay / (
            within_m + bar.config.settle_m
        ):
            break
        within_m *= 2.0
    if value <= 0.0:
        return None
    goal = lookout.prospects.places[best].tolist()
    return _choice(lookout.prospects, best, value, ways.path(lookout.scene.ground.cell(*goal)))


def _best(lookout: Lookout, ways: Ways, bar: Bar) -> tuple[int, float]:
    """The best of those that were looked at, of equals the first, and its value; 0: there is none."""
    ground, prospects = lookout.scene.ground, lookout.prospects
    worth = bar.worth(prospects)
    rows, columns = ground.cells_at(prospects.places)
    least = _least(ways.start, rows, columns)
    costs = np.full(len(worth), -1.0)
    waiting, best, value, more = np.flatnonzero(worth > 0.0), 0, 0.0, True
    while len(waiting):
        costs[waiting] = ways.costs(rows[waiting], columns[waiting])
        # The way to what was not found is no shorter than the straight one, and longer than what was gone so far.
        lengths = ground.length_m(np.where(costs < 0.0, np.maximum(least, ways.reached), costs))
        values = bar.value(worth, lengths)
        sure = np.where(costs < 0.0, 0.0, values)
        best = int(np.argmax(sure))
        value = float(sure[best])
        if not more:
            break
        waiting = waiting[(costs[waiting] < 0.0) & (values[waiting] > 0.0) & (values[waiting] >= value)]
        for _ in range(ROUND if len(waiting) else 0):
            more = ways.go_on()
    return best, value


def afar(far: Afar, ways: Ways, ground: Ground, bar: Bar, above: float) -> Choice | None:
    """The best of the places far off, if it is worth more than `above`; the way leads to the scan beside it."""
    prospects, scans, beside = far.prospects, far.scans, far.beside
    worth = bar.worth(prospects)
    if not (bar.value(worth, _metres(prospects.places, scans[-1])) > above).any():
        return None  # as the crow flies
    more = True
    while more and ground.length_m(float(ways.reached)) < ENTRY_M:
        more = ways.go_on()
    near = {k: ways.cost(ground.cell(*scans[k].tolist())) for k in np.flatnonzero(ground.holds(scans)).tolist()}
    journeys = Journeys(far.roads, scans, {k: ground.length_m(float(cost)) for k, cost in near.items() if cost >= 0})
    beyond, within_m = _metres(prospects.places, scans[beside]), 2.0 * ENTRY_M
    while True:
        more = journeys.go_on(within_m)
        lengths = journeys.metres[beside] + beyond
        values = bar.value(worth, lengths)
        best = int(np.argmax(values))
        # The way to what was not found is longer than what was gone so far.
        others = bar.value(worth, within_m + beyond)[np.isinf(lengths)]
        if not (more and ((others > above) & (others >= values[best])).any()):
            break
        within_m *= 2.0
    if not values[best] > above:
        return None
    entry, road = journeys.road(int(beside[best]))
    points = np.concatenate([ways.path(ground.cell(*scans[entry].tolist())).points, road])
    return _choice(prospects, best, float(values[best]), Path(points, float(lengths[best])))


def _choice(prospects: Prospects, chosen: int, value: float, path: Path) -> Choice:
    (x, y), centre = prospects.places[chosen].tolist(), prospects.regions[chosen].tolist()
    region = Region(int(prospects.cells[chosen]), (centre[0], centre[1]), float(prospects.gains[chosen]))
    return Choice((x, y), region, value, path)


def _least(start: Cell, rows: Ints, columns: Ints) -> Floats:
    """The costs of the ways to cells of the ground if nothing stood in them."""
    dr, dc = np.abs(rows - start[0]), np.abs(columns - start[1])
    costs = STRAIGHT * np.maximum(dr, dc) + (DIAGONAL - STRAIGHT) * np.minimum(dr, dc)
    return np.asarray(costs, dtype=np.float64)


def _metres(places: Floats, others: Floats) -> Floats:
    """From each place to another, or to the same."""
    steps = places - others
    return np.asarray(dmath.hypot(steps[:, 0], steps[:, 1]))
