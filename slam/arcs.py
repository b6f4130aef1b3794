"""Arcs: runs of readings of one sonar that keep one distance while its axis turns through a surface's normal [II].

While any ray of the beam meets a wall at right angles the sonar reads the wall's perpendicular distance, so a turning
sonar reads a constant over the width of its beam. The lever arm is taken out first: a beam of origin o that reads r
from a wall of normal n puts the wall at D = r + o·n from the frame's origin.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from slam import dmath
from slam.dmath import DEGREE, PI, Floats
from slam.geometry import Bools, wrap
from slam.sweep import Ints


@dataclass(frozen=True)
class Beams:
    """n readings in order of firing: (n,) sonar, distance m, echo, axis rad; (n, 2) origin m; all in the sweep's F."""

    sonar: Ints
    distance: Floats
    echo: Bools
    origin: Floats
    axis: Floats
    half_beam: float

    def levels(self, bearing: float, chosen: Ints | None = None) -> Floats:
        """Distance (m) from F's origin of a surface with this normal, as each (chosen) reading has it."""
        sine, cosine = dmath.sincos(bearing)
        distance, origin = self.distance, self.origin
        if chosen is not None:
            distance, origin = distance[chosen], origin[chosen]
        return distance + (origin[:, 0] * cosine + origin[:, 1] * sine)


@dataclass(frozen=True)
class ArcConfig:
    """What makes an arc, and which arcs of different sonars are one region of constant depth."""

    spread_m: float = 0.03
    min_readings: int = 3
    max_misses: int = 1
    min_width_deg: float = 10.0
    max_width_deg: float = 45.0
    agree_deg: float = 8.0
    agree_m: float = 0.06
    min_sonars: int = 3


@dataclass(frozen=True)
class Arc:
    """Readings (indices, in order of bearing) of one sonar at one distance.

    `first` and `last` are the extreme axis angles in rad (first ≤ last), `before` and `after` those of the sonar's next
    readings on either side, which are no part of it: the arc's true edges lie in between. `distance` m from F's origin,
    `spread` m the largest deviation from it. `whole`: neither end lies at the start or end of the turn. `aside` rad is
    the parallax: from F's origin a point at that distance is seen so much further round than from the sonar; a plane's
    normal is the same from everywhere.
    """

    sonar: int
    readings: tuple[int, ...]
    before: float
    first: float
    last: float
    after: float
    distance: float
    spread: float
    whole: bool
    aside: float = 0.0

    @property
    def bearing(self) -> float:
        """Bearing of the surface's normal: the middle of the arc, rad."""
        return 0.25 * ((self.before + self.first) + (self.last + self.after))


@dataclass(frozen=True)
class _Tracks:
    """Every sonar's readings in order of bearing, sonar after sonar, (n,) each; a closed circle is laid out twice.

    Readings of a sonar stand at `begin` to `end` (sonars,) and a turn of it is `circle` (sonars,) readings long.
    """

    index: Ints
    axis: Floats
    distance: Floats
    echo: Bools
    x: Floats
    y: Floats
    begin: Ints
    end: Ints
    circle: Ints


def find_arcs(beams: Beams, config: ArcConfig, *, closed: bool) -> list[Arc]:
    """All arcs, by sonar, then by bearing; `closed`: the turn is a full circle, so arcs may cross its seam."""
    if not len(beams.sonar):
        return []
    tracks = _tracks(beams, closed=closed)
    sonars = np.flatnonzero(np.bincount(beams.sonar)).tolist()
    runs: list[list[list[int]]] = [[] for _ in sonars]
    for block, members in _runs(tracks, config):
        runs[block].append(members)
    begins, circles = tracks.begin.tolist(), tracks.circle.tolist()
    chosen = [
        (sonar, begin, circle, run)
        for sonar, begin, circle, of in zip(sonars, begins, circles, runs, strict=True)
        for run in _longest(of, begin, circle)
    ]
    return _arcs(chosen, tracks, closed=closed)


def _tracks(beams: Beams, *, closed: bool) -> _Tracks:
    axis = wrap(beams.axis) if closed else beams.axis
    order = np.lexsort((axis, beams.sonar))
    sizes = np.bincount(beams.sonar)
    sizes = sizes[sizes > 0]
    first = np.cumsum(sizes) - sizes
    turns = 2 if closed else 1
    place = np.arange(turns * len(order)) - np.repeat(turns * first, turns * sizes)  # from the first of its sonar
    again, size = place >= np.repeat(sizes, turns * sizes), np.repeat(sizes, turns * sizes)
    index = order[np.repeat(first, turns * sizes) + np.where(again, place - size, place)]
    axis = axis[index]
    axis[again] += 2.0 * PI
    begin = turns * first
    return _Tracks(
        index=index,
        axis=axis,
        distance=beams.distance[index],
        echo=beams.echo[index],
        x=beams.origin[index, 0],
        y=beams.origin[index, 1],
        begin=begin,
        end=begin + turns * sizes,
        circle=sizes,
    )


def _runs(tracks: _Tracks, config: ArcConfig) -> list[tuple[int, list[int]]]:
    """For each reading the longest run that starts with it, if it is an arc; with the number of its sonar's block.

    A run takes the next reading in if all its distances, with the lever arm taken out, then lie within the spread.
    All runs grow at once: each as if it took in whatever it may, up to the first reading that does not fit; that one is
    a miss, and from there on the run grows again.
    """
    places = np.arange(len(tracks.index))
    block = np.searchsorted(tracks.begin, places, side="right") - 1
    start = np.flatnonzero(tracks.echo & (places < (tracks.begin + tracks.circle)[block]))
    start, member = _hopeful(start, block, tracks, config)
    pairs = _Pairs.of_starts(start, member, tracks)
    while len(pairs.of):
        wrong = ~_fit(pairs, member, config)
        first = np.full(len(start), member.shape[1])
        np.minimum.at(first, pairs.of[wrong], pairs.ahead[wrong])
        missed = np.flatnonzero(first < member.shape[1])
        member[missed, first[missed]] = False
        member[missed] &= np.cumsum(~member[missed], axis=1) <= config.max_misses
        again = (pairs.ahead > first[pairs.of]) & member[pairs.of, pairs.ahead]
        pairs = pairs.at(np.flatnonzero(again))
    last = start + member.shape[1] - 1 - np.argmax(member[:, ::-1], axis=1)
    wide = tracks.axis[last] - tracks.axis[start] >= config.min_width_deg * DEGREE
    arcs = np.flatnonzero(wide & (np.count_nonzero(member, axis=1) >= config.min_readings))
    rows, ahead_of = np.nonzero(member[arcs])
    members = (start[arcs][rows] + ahead_of).tolist()
    borders = np.searchsorted(rows, np.arange(len(arcs) + 1)).tolist()
    return list(zip(block[start[arcs]].tolist(), [members[i:j] for i, j in pairwise(borders)], strict=True))


def _bridged(config: ArcConfig) -> float:
    """No lever arm makes one distance of ranges that differ by more, in metres."""
    return 4.0 * config.spread_m + 0.1


def _hopeful(start: Ints, block: Ints, tracks: _Tracks, config: ArcConfig) -> tuple[Ints, Bools]:
    """The starts whose run may become an arc, and whether it may grow to so many places ahead (k, n).

    Not farther than a turn or an arc can be wide. Ranges that no lever arm makes one distance are misses; a run that
    has too many of them grows no more.
    """
    width, axis = config.max_width_deg * DEGREE, tracks.axis
    limit = np.minimum(start + tracks.circle[block[start]], tracks.end[block[start]])
    sorted_axis = axis + 1000.0 * block  # each sonar's axes are sorted
    ahead = np.searchsorted(sorted_axis, sorted_axis[start] + (width + 1e-6)) - start
    place = start[:, None] + np.arange(int(ahead.max(initial=1)))
    last = np.minimum(place, len(axis) - 1)
    may = (axis[last] - axis[start][:, None] <= width) & (place < limit[:, None]) & tracks.echo[last]
    may &= np.abs(tracks.distance[last] - tracks.distance[start][:, None]) <= _bridged(config)
    may[:, 0] = True
    may &= np.cumsum(~may, axis=1) <= config.max_misses
    farthest = may.shape[1] - 1 - np.argmax(may[:, ::-1], axis=1)
    hopeful = axis[start + farthest] - axis[start] >= config.min_width_deg * DEGREE
    return start[hopeful], may[hopeful, : int(farthest[hopeful].max(initial=0)) + 1]


@dataclass(frozen=True)
class _Pairs:
    """Starts (p,) and places ahead (p,) that their runs may grow to.

    Of the readings from the start on (p, places) the `ranges` m as measured, and the `levels`: with the lever arm of
    the middle of the two taken out.
    """

    of: Ints
    ahead: Ints
    levels: Floats
    ranges: Floats

    @classmethod
    def of_starts(cls, start: Ints, may: Bools, tracks: _Tracks) -> "_Pairs":
        """All that may be (k, places)."""
        of, ahead = np.nonzero(may)
        of, ahead = of[ahead > 0], ahead[ahead > 0]
        sine, cosine = dmath.sincos(0.5 * (tracks.axis[start[of]] + tracks.axis[start[of] + ahead]))
        place = np.minimum(start[of][:, None] + np.arange(may.shape[1]), len(tracks.axis) - 1)
        ranges = tracks.distance[place]
        lever = tracks.x[place] * cosine[:, None] + tracks.y[place] * sine[:, None]
        return cls(of, ahead, ranges + lever, ranges)

    def at(self, chosen: Ints) -> "_Pairs":
        """Those of these numbers."""
        return _Pairs(self.of[chosen], self.ahead[chosen], self.levels[chosen], self.ranges[chosen])


def _fit(pairs: _Pairs, member: Bools, config: ArcConfig) -> Bools:
    """Whether all distances of each run, from its start to the place ahead, lie within the spread of their mean.

    And whether a lever arm can make one distance of the ranges at all.
    """
    inside = member[pairs.of] & (np.arange(member.shape[1]) <= pairs.ahead[:, None])
    sums = np.cumsum(np.where(inside, pairs.levels, 0.0), axis=1)[:, -1]
    mean = sums / np.count_nonzero(inside, axis=1)
    one = ((np.abs(pairs.levels - mean[:, None]) <= config.spread_m) | ~inside).all(axis=1)
    low, high = np.where(inside, pairs.ranges, np.inf).min(axis=1), np.where(inside, pairs.ranges, 0.0).max(axis=1)
    return np.asarray(one & (high - low <= _bridged(config)))


def _longest(runs: list[list[int]], begin: int, circle: int) -> list[list[int]]:
    """Runs of one sonar that share no reading, the longest first taken; in order of bearing."""
    taken: set[int] = set()
    chosen = []
    for run in sorted(runs, key=lambda run: (-len(run), run[0])):
        places = [(place - begin) % circle for place in run]
        if taken.isdisjoint(places):
            taken.update(places)
            chosen.append(run)
    return sorted(chosen, key=lambda run: run[0])


def _arcs(chosen: list[tuple[int, int, int, list[int]]], tracks: _Tracks, *, closed: bool) -> list[Arc]:
    """Arcs of runs given as (sonar, where its block begins, how long a turn is, places)."""
    if not chosen:
        return []
    flat = np.array([place for *_, run in chosen for place in run])
    sizes = np.array([len(run) for *_, run in chosen])
    ends = np.cumsum(sizes)
    sine, cosine = dmath.sincos(0.5 * (tracks.axis[flat[ends - sizes]] + tracks.axis[flat[ends - 1]]))
    lever = tracks.x[flat] * np.repeat(cosine, sizes) + tracks.y[flat] * np.repeat(sine, sizes)
    number = np.repeat(np.arange(len(sizes)), sizes)
    levels = tracks.distance[flat] + lever
    mean = np.bincount(number, levels) / sizes
    across = tracks.y[flat] * np.repeat(cosine, sizes) - tracks.x[flat] * np.repeat(sine, sizes)
    aside = np.bincount(number, across) / sizes / mean
    spread = np.zeros(len(sizes))
    np.maximum.at(spread, number, np.abs(levels - mean[number]))
    readings, axis = tracks.index[flat].tolist(), tracks.axis.tolist()
    arcs = []
    for (sonar, begin, circle, run), end, distance, off, parallax in zip(
        chosen, ends.tolist(), mean.tolist(), spread.tolist(), aside.tolist(), strict=True
    ):
        first, last = run[0], run[-1]
        whole = closed or (first > begin and last < begin + circle - 1)
        before = axis[begin + circle - 1] - 2.0 * PI if first == begin else axis[first - 1]
        arcs.append(
            Arc(
                sonar=sonar,
                readings=tuple(readings[end - len(run) : end]),
                before=before if whole else axis[first],
                first=axis[first],
                last=axis[last],
                after=axis[min(last + 1, len(axis) - 1)] if whole else axis[last],
                distance=distance,
                spread=off,
                whole=whole,
                aside=parallax,
            )
        )
    return arcs
