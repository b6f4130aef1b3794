"""Arcs: runs of readings of one sonar that keep one distance while its axis turns through a surface's normal [II].

While any ray of the beam meets a wall at right angles the sonar reads the wall's perpendicular distance, so a turning
sonar reads a constant over the width of its beam. The lever arm is taken out first: a beam of origin o that reads r
from a wall of normal n puts the wall at D = r + o·n from the frame's origin.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.dmath import DEGREE, Floats
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
class _Run:
    """A candidate arc: positions in a sonar's track."""

    members: tuple[int, ...]
    distances: tuple[float, ...]


@dataclass(frozen=True)
class _Track:
    """One sonar's readings in order of bearing, as plain floats."""

    index: list[int]
    axis: list[float]
    distance: list[float]
    echo: list[bool]
    x: list[float]
    y: list[float]
    closed: bool


def find_arcs(beams: Beams, config: ArcConfig, *, closed: bool) -> list[Arc]:
    """All arcs, by sonar, then by bearing; `closed`: the turn is a full circle, so arcs may cross its seam."""
    arcs: list[Arc] = []
    for sonar in range(int(beams.sonar.max()) + 1 if len(beams.sonar) else 0):
        track = _track(beams, sonar, closed=closed)
        arcs.extend(_arc(sonar, track, run) for run in _longest_runs(track, config))
    return arcs


def _track(beams: Beams, sonar: int, *, closed: bool) -> _Track:
    """Sorted by bearing. A closed circle is laid out twice, so that a run may cross the seam."""
    chosen = np.flatnonzero(beams.sonar == sonar)
    axis = wrap(beams.axis[chosen]) if closed else beams.axis[chosen]
    order = np.argsort(axis, kind="stable")
    chosen, axis = chosen[order], axis[order]
    if closed:
        axis = np.concatenate([axis, axis + 2.0 * dmath.PI])
        chosen = np.concatenate([chosen, chosen])
    return _Track(
        chosen.tolist(),
        axis.tolist(),
        beams.distance[chosen].tolist(),
        beams.echo[chosen].tolist(),
        beams.origin[chosen, 0].tolist(),
        beams.origin[chosen, 1].tolist(),
        closed,
    )


def _longest_runs(track: _Track, config: ArcConfig) -> list[_Run]:
    """Runs that share no reading, the longest first taken; in order of bearing."""
    circle = len(track.index) // 2 if track.closed else len(track.index)
    runs = [run for start in range(circle) if (run := _grow(track, start, circle, config)) is not None]
    runs.sort(key=lambda run: (-len(run.members), run.members[0]))
    taken: set[int] = set()
    chosen = []
    for run in runs:
        places = [m % circle for m in run.members]
        if not any(place in taken for place in places):
            taken.update(places)
            chosen.append(run)
    return sorted(chosen, key=lambda run: run.members[0])


def _grow(track: _Track, start: int, circle: int, config: ArcConfig) -> _Run | None:
    """The longest run from `start` on, or None if it is no arc."""
    if not track.echo[start]:
        return None
    members, distances, misses = [start], [track.distance[start]], 0
    for k in range(start + 1, min(start + circle, len(track.index))):
        if track.axis[k] - track.axis[start] > config.max_width_deg * DEGREE:
            break
        grown = _levelled(track, [*members, k], config) if track.echo[k] else None
        if grown is not None:
            members.append(k)
            distances = grown
        elif misses == config.max_misses:
            break
        else:
            misses += 1
    wide = track.axis[members[-1]] - track.axis[start] >= config.min_width_deg * DEGREE
    return _Run(tuple(members), tuple(distances)) if wide and len(members) >= config.min_readings else None


def _levelled(track: _Track, members: list[int], config: ArcConfig) -> list[float] | None:
    """The members' distances with the lever arm taken out, or None if they differ by more than the spread."""
    rough = [track.distance[m] for m in members]
    if max(rough) - min(rough) > 4.0 * config.spread_m + 0.1:  # no lever arm bridges this
        return None
    sine, cosine = dmath.sincos(0.5 * (track.axis[members[0]] + track.axis[members[-1]]))
    distances = [track.distance[m] + (track.x[m] * cosine + track.y[m] * sine) for m in members]
    mean = dmath.ordered_sum(distances) / len(distances)
    return distances if all(abs(d - mean) <= config.spread_m for d in distances) else None


def _arc(sonar: int, track: _Track, run: _Run) -> Arc:
    begin, end = run.members[0], run.members[-1]
    first, last = track.axis[begin], track.axis[end]
    mean = dmath.ordered_sum(run.distances) / len(run.distances)
    if track.closed:
        before = track.axis[begin - 1] if begin else track.axis[len(track.axis) // 2 - 1] - 2.0 * dmath.PI
        after, whole = track.axis[end + 1], True
    else:
        whole = begin > 0 and end < len(track.axis) - 1
        before, after = (track.axis[begin - 1], track.axis[end + 1]) if whole else (first, last)
    return Arc(
        sonar=sonar,
        readings=tuple(track.index[m] for m in run.members),
        before=before,
        first=first,
        last=last,
        after=after,
        distance=mean,
        spread=max(abs(d - mean) for d in run.distances),
        whole=whole,
    )


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
