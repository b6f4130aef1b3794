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
    `spread` m the largest deviation from it. `whole`: neither end lies at the start or end of the turn.
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
    sonars = np.unique(beams.sonar).tolist()
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
    sonars = np.flatnonzero(np.bincount(beams.sonar))
    first = np.searchsorted(beams.sonar[order], sonars)
    blocks = np.split(order, first[1:])
    sizes = np.array([len(block) for block in blocks])
    turns = 2 if closed else 1
    index = np.concatenate([block for block in blocks for _ in range(turns)])
    axis = axis[index]
    if closed:
        axis[np.concatenate([2 * begin + np.arange(n, 2 * n) for begin, n in zip(first, sizes, strict=True)])] += (
            2.0 * PI
        )
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
    All runs grow at once; what can be told of a start and a later reading alone is told beforehand.
    """
    places = np.arange(len(tracks.index))
    block = np.searchsorted(tracks.begin, places, side="right") - 1
    start = np.flatnonzero(tracks.echo & (places < (tracks.begin + tracks.circle)[block]))
    inside = _inside(start, block, tracks, config)  # (starts, places ahead)
    pairs = _pairs(start, inside, tracks, config)
    member = np.zeros(inside.shape, dtype=bool)
    member[:, 0] = True
    going, misses = np.ones(len(start), dtype=bool), np.zeros(len(start), dtype=np.int64)
    low, high = tracks.distance[start], tracks.distance[start].copy()
    for ahead in range(1, inside.shape[1]):
        going &= inside[:, ahead]
        of, levels = pairs[ahead]
        grown = member[of, : ahead + 1]
        grown[:, ahead] = True
        lower = np.minimum(low[of], tracks.distance[start[of] + ahead])
        higher = np.maximum(high[of], tracks.distance[start[of] + ahead])
        grows = going[of] & (higher - lower <= _bridged(config)) & _keeps_one(levels, grown, config)
        grown_of = of[grows]
        low[grown_of], high[grown_of] = lower[grows], higher[grows]
        misses += 1
        misses[grown_of] -= 1
        member[grown_of, ahead] = True
        going &= misses <= config.max_misses
    last = start + inside.shape[1] - 1 - np.argmax(member[:, ::-1], axis=1)
    wide = tracks.axis[last] - tracks.axis[start] >= config.min_width_deg * DEGREE
    arcs = np.flatnonzero(wide & (np.count_nonzero(member, axis=1) >= config.min_readings))
    rows, ahead_of = np.nonzero(member[arcs])
    members = np.split(start[arcs][rows] + ahead_of, np.searchsorted(rows, np.arange(1, len(arcs))))
    return list(zip(block[start[arcs]].tolist(), [run.tolist() for run in members], strict=False))


def _bridged(config: ArcConfig) -> float:
    """No lever arm makes one distance of ranges that differ by more, in metres."""
    return 4.0 * config.spread_m + 0.1


def _inside(start: Ints, block: Ints, tracks: _Tracks, config: ArcConfig) -> Bools:
    """Whether a reading so many places after each start may belong to its run, for all it is (k, n) not too far on."""
    limit = np.minimum(start + tracks.circle[block[start]], tracks.end[block[start]])
    columns = [np.ones(len(start), dtype=bool)]
    while columns[-1].any():
        place = np.minimum(start + len(columns), len(tracks.axis) - 1)
        near = tracks.axis[place] - tracks.axis[start] <= config.max_width_deg * DEGREE
        columns.append(near & (start + len(columns) < limit))
    return np.stack(columns, axis=1)


def _pairs(start: Ints, inside: Bools, tracks: _Tracks, config: ArcConfig) -> list[tuple[Ints, Floats]]:
    """For each number of places ahead the starts (numbers) whose run may grow to there, and the distances then.

    (k, places) metres: of every reading from the start to there with the lever arm of the two's middle taken out.
    """
    last = np.minimum(start[:, None] + np.arange(inside.shape[1]), len(tracks.axis) - 1)
    may = inside & tracks.echo[last]
    may &= np.abs(tracks.distance[last] - tracks.distance[start][:, None]) <= _bridged(config)
    ahead, of = np.nonzero(may.T)
    sine, cosine = dmath.sincos(0.5 * (tracks.axis[start[of]] + tracks.axis[start[of] + ahead]))
    place = np.minimum(start[of][:, None] + np.arange(inside.shape[1]), len(tracks.axis) - 1)
    levels = tracks.distance[place] + (tracks.x[place] * cosine[:, None] + tracks.y[place] * sine[:, None])
    borders = np.searchsorted(ahead, np.arange(inside.shape[1] + 1)).tolist()
    return [(of[i:j], levels[i:j, : k + 1]) for k, (i, j) in enumerate(pairwise(borders))]


def _keeps_one(levels: Floats, member: Bools, config: ArcConfig) -> Bools:
    """Whether the members' distances (k, n) all lie within the spread of their mean."""
    mean = np.cumsum(np.where(member, levels, 0.0), axis=1)[:, -1] / np.count_nonzero(member, axis=1)
    return np.asarray(((np.abs(levels - mean[:, None]) <= config.spread_m) | ~member).all(axis=1))


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
    runs = [np.array(run) for *_, run in chosen]
    if not runs:
        return []
    flat, sizes = np.concatenate(runs), np.array([len(run) for run in runs])
    sine, cosine = dmath.sincos(0.5 * (tracks.axis[[run[0] for run in runs]] + tracks.axis[[run[-1] for run in runs]]))
    lever = tracks.x[flat] * np.repeat(cosine, sizes) + tracks.y[flat] * np.repeat(sine, sizes)
    levels_of, readings_of = (tracks.distance[flat] + lever).tolist(), tracks.index[flat].tolist()
    arcs, at = [], 0
    for sonar, begin, circle, run in chosen:
        levels, readings = levels_of[at : at + len(run)], readings_of[at : at + len(run)]
        at += len(run)
        first, last = run[0], run[-1]
        whole = closed or (first > begin and last < begin + circle - 1)
        around = tracks.axis[[first - 1, first, last, min(last + 1, len(tracks.axis) - 1)]].tolist()
        if first == begin:
            around[0] = float(tracks.axis[begin + circle - 1]) - 2.0 * PI
        mean = dmath.ordered_sum(levels) / len(levels)
        arcs.append(
            Arc(
                sonar=sonar,
                readings=tuple(readings),
                before=around[0] if whole else around[1],
                first=around[1],
                last=around[2],
                after=around[3] if whole else around[2],
                distance=mean,
                spread=max(abs(level - mean) for level in levels),
                whole=whole,
            )
        )
    return arcs


def cluster(arcs: list[Arc], config: ArcConfig) -> list[tuple[int, ...]]:
    """Arcs (indices) of at least `min_sonars` sonars that agree in bearing and distance, the largest group first."""
    if not arcs:
        return []
    bearing = np.array([arc.bearing for arc in arcs])
    distance = np.array([arc.distance for arc in arcs])
    sonar = np.array([arc.sonar for arc in arcs])
    free = np.ones(len(arcs), dtype=bool)
    groups: list[tuple[int, ...]] = []
    near = (np.abs(wrap(bearing[:, None] - bearing[None, :])) <= config.agree_deg * DEGREE) & (
        np.abs(distance[:, None] - distance[None, :]) <= config.agree_m
    )
    while True:
        seed = int(np.argmax(np.count_nonzero(near & free[None, :], axis=1) * free))
        members = np.flatnonzero(near[seed] & free)
        if len(members) < config.min_sonars:
            return groups
        centre = bearing[seed] + dmath.mean(wrap(bearing[members] - bearing[seed]))
        level = dmath.mean(distance[members])
        about = np.abs(wrap(bearing - centre)) <= config.agree_deg * DEGREE
        members = np.flatnonzero(free & about & (np.abs(distance - level) <= config.agree_m))
        if len(members) == 0:
            members = np.array([seed])
        elif len(np.unique(sonar[members])) >= config.min_sonars:
            groups.append(tuple(members.tolist()))
        free[members] = False
