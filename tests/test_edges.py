"""What an RCD's edges tell: its bearing, whether a plane or a point answers, a wall with something at its end."""

import math

import numpy as np
import pytest

from slam.arcs import Arc, Beams
from slam.dmath import DEGREE
from slam.edges import find_edges, nearer_side
from slam.parallax import for_point

STEP, HALF = 4.0 * DEGREE, 14.0 * DEGREE


def arc(sonar: int, low: float, high: float, *, phase: float, aside: float = 0.0, distance: float = 1.0) -> Arc:
    """The readings at steps of 4° from `phase` on that lie between the edges."""
    first = phase + STEP * math.ceil((low - phase) / STEP)
    last = phase + STEP * math.floor((high - phase) / STEP)
    return Arc(sonar, (sonar,), first - STEP, first, last, last + STEP, distance, 0.0, True, aside)


def ring_of(bearing: float, asides: list[float], *, point: bool) -> list[Arc]:
    """Eight sonars' arcs of a plane whose normal has this bearing, or of a point there; each steps at its own phase."""
    return [
        arc(k, bearing - HALF - a * point, bearing + HALF - a * point, phase=0.37 * k * STEP, aside=a)
        for k, a in enumerate(asides)
    ]


ASIDE = [-0.075, -0.03, 0.02, 0.01, -0.01, 0.075, 0.03, -0.02]


@pytest.mark.parametrize("bearing_deg", [0.0, 1.3, -170.2, 179.9])
def test_eight_sonars_in_steps_of_4_degrees_fix_a_bearing_to_some_tenths(bearing_deg: float) -> None:
    edges = find_edges(ring_of(bearing_deg * DEGREE, ASIDE, point=False))
    assert abs(math.remainder(edges.middle - bearing_deg * DEGREE, 2 * math.pi)) <= 0.3 * DEGREE
    assert abs(edges.width - 2 * HALF) <= 0.6 * DEGREE


def test_one_wild_arc_moves_it_by_little() -> None:
    arcs = ring_of(0.0, [0.0] * 8, point=False)
    clean = find_edges(arcs)
    arcs[3] = arc(3, -HALF + 4.5 * DEGREE, HALF, phase=0.37 * 3 * STEP)
    assert abs(find_edges(arcs).middle - clean.middle) <= 0.25 * DEGREE


@pytest.mark.parametrize("point", [True, False], ids=["point", "plane"])
def test_sonars_that_stand_apart_tell_a_point_from_a_plane(point: bool) -> None:
    arcs = ring_of(0.4, ASIDE, point=point)
    evidence = for_point(arcs)
    assert (evidence > 9.0) if point else (evidence < -9.0)
    assert abs(find_edges(arcs).middle - 0.4) <= 0.5 * DEGREE
    assert for_point(ring_of(0.4, [0.0] * 8, point=point)) == 0.0  # from one place nothing tells


def beams_of(wall: float, corner: float, deeper: float) -> tuple[Beams, list[Arc]]:
    """A wall 1 m off, and beside it a corner that stands so much `deeper`; all sonars at F's origin."""
    axes: list[float] = []
    ranges: list[float] = []
    sonars: list[int] = []
    arcs = []
    for k in range(8):
        steps = 0.37 * k * STEP + STEP * np.arange(-12, 13)
        on_wall, on_corner = np.abs(steps - wall) <= HALF, np.abs(steps - corner) <= HALF
        heard = np.flatnonzero(on_wall | on_corner)
        first, last = float(steps[heard[0]]), float(steps[heard[-1]])
        readings = tuple(range(len(axes), len(axes) + len(heard)))
        arcs.append(Arc(k, readings, first - STEP, first, last, last + STEP, 1.0, 0.0, True))
        axes += steps[heard].tolist()
        ranges += np.where(on_wall, 1.0, 1.0 + deeper)[heard].tolist()
        sonars += [k] * len(heard)
    noise = 0.004 * np.cos(2.4 * np.arange(len(axes)))
    count = len(axes)
    heard_all, centre = np.ones(count, dtype=bool), np.zeros((count, 2))
    return Beams(np.array(sonars), np.array(ranges) + noise, heard_all, centre, np.array(axes), HALF), arcs


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_wall_that_ends_in_a_corner_keeps_its_own_bearing(side: float) -> None:
    beams, arcs = beams_of(0.1, 0.1 + side * 9.0 * DEGREE, 0.02)
    edges = find_edges(arcs)
    assert abs(edges.middle - 0.1) >= 4.0 * DEGREE  # midway between wall and corner there is nothing
    found = nearer_side(edges, 2 * HALF, beams)
    assert found is not None
    bearing, readings = found
    assert abs(bearing - 0.1) <= 0.4 * DEGREE
    assert np.abs(beams.distance[readings] - 1.0).max() <= 0.005


def test_two_things_at_one_distance_stay_undecided() -> None:
    beams, arcs = beams_of(0.1, 0.1 + 9.0 * DEGREE, 0.0)
    assert nearer_side(find_edges(arcs), 2 * HALF, beams) is None
