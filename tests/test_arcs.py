"""Arcs against the plainest way to grow them: from every reading, one reading after the other, in scalars."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from slam import dmath
from slam.arcs import ArcConfig, Beams, find_arcs
from slam.dmath import DEGREE, PI
from slam.geometry import wrap

Run = tuple[tuple[int, ...], float]


@st.composite
def sweeps(draw: st.DrawFn) -> Beams:
    """Up to three sonars' readings of a turn, most of them from one or two surfaces, some at the same bearing."""
    count = draw(st.integers(0, 40))
    numbers = st.lists(st.integers(0, 999), min_size=count, max_size=count)
    sonar, kind, noise, steps = (np.array(draw(numbers), dtype=np.int64) for _ in range(4))
    surface = np.where(kind % 10 < 6, 1.5, np.where(kind % 10 < 8, 1.58, 0.002 * kind + 0.3))
    origin = np.stack([0.15 * (sonar % 3) - 0.1, 0.05 * (sonar % 3)], axis=1)
    axis = np.sort((steps % 180) * 2.0 * DEGREE) + 0.1
    return Beams(sonar % 3, surface + 6e-5 * noise, kind % 13 != 0, origin, axis, 0.2)


def plain_runs(beams: Beams, sonar: int, config: ArcConfig, *, closed: bool) -> list[Run]:
    """(readings, distance) of every arc of one sonar, as the words of the algorithm have it."""
    mine = [int(k) for k in np.flatnonzero(beams.sonar == sonar)]
    bearing = {k: wrap(float(beams.axis[k])) if closed else float(beams.axis[k]) for k in mine}
    ring = sorted(mine, key=lambda k: (bearing[k], k))
    track = [(k, bearing[k]) for k in ring] + [(k, bearing[k] + 2.0 * PI) for k in ring if closed]

    def levels(places: list[int]) -> list[float]:
        sine, cosine = dmath.sincos(0.5 * (track[places[0]][1] + track[places[-1]][1]))
        chosen = [track[place][0] for place in places]
        return [float(beams.distance[k] + (beams.origin[k, 0] * cosine + beams.origin[k, 1] * sine)) for k in chosen]

    def one(places: list[int]) -> bool:
        mean = dmath.ordered_sum(levels(places)) / len(places)
        ranges = [float(beams.distance[track[place][0]]) for place in places]
        near = max(ranges) - min(ranges) <= 4.0 * config.spread_m + 0.1
        return near and all(abs(level - mean) <= config.spread_m for level in levels(places))

    runs = []
    for start in range(len(ring)):
        run, misses = [start], 0
        for place in range(start + 1, min(start + len(ring), len(track))) if beams.echo[track[start][0]] else ():
            if track[place][1] - track[start][1] > config.max_width_deg * DEGREE or misses > config.max_misses:
                break
            if beams.echo[track[place][0]] and one([*run, place]):
                run.append(place)
            else:
                misses += 1
        if len(run) >= config.min_readings and track[run[-1]][1] - track[start][1] >= config.min_width_deg * DEGREE:
            runs.append(run)
    taken: set[int] = set()
    chosen = []
    for run in sorted(runs, key=lambda run: (-len(run), run[0])):
        if not taken & {place % len(ring) for place in run}:
            taken |= {place % len(ring) for place in run}
            chosen.append(run)
    return [
        (tuple(track[place][0] for place in run), dmath.ordered_sum(levels(run)) / len(run)) for run in sorted(chosen)
    ]


@settings(max_examples=150, deadline=None)
@given(sweeps(), st.integers(2, 4), st.integers(0, 2), st.sampled_from([0.0, 10.0]), st.booleans())
def test_arcs_are_those_of_the_plain_search(beams: Beams, least: int, misses: int, width: float, closed: bool) -> None:
    config = ArcConfig(min_readings=least, max_misses=misses, min_width_deg=width)
    found = find_arcs(beams, config, closed=closed)
    for sonar in range(3):
        expected = plain_runs(beams, sonar, config, closed=closed)
        assert [(arc.readings, arc.distance) for arc in found if arc.sonar == sonar] == expected
