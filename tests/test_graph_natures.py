"""Wall or point: what two and more stations make of a line and of a point."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slam.association import OPEN, POINT, WALL
from slam.geometry import Pose
from slam.graph.config import GraphConfig
from slam.graph.natures import tell_natures
from slam.graph.problem import Graph
from tests.graphs import SIGMA, Line, Spot, graph_of

CONFIG = GraphConfig()
WALL_ABOVE, CORNER = Line(math.pi / 2, 1.0), Spot(0.0, 1.0)


def seen_from(thing: Line | Spot, *along: float) -> Graph:
    """Untold yet, from stations on the x axis."""
    return graph_of([Pose(x, 0.0, 0.0) for x in along], [thing], [(k, 0) for k in range(len(along))], told=False)


def told(graph: Graph, config: GraphConfig = CONFIG) -> Graph:
    return tell_natures(graph, np.arange(len(graph.nature)), config)


@pytest.mark.parametrize(("thing", "nature"), [(WALL_ABOVE, WALL), (CORNER, POINT)], ids=["wall", "point"])
def test_two_stations_tell_a_wall_from_a_point(thing: Line | Spot, nature: int) -> None:
    found = told(seen_from(thing, 0.0, 0.8))
    assert found.nature.tolist() == [nature]
    assert found.as_point.tolist() == [int(nature == POINT)]


def test_one_station_or_two_at_one_place_tell_nothing() -> None:
    """From one place a line and the point at its foot look alike."""
    for graph in (seen_from(CORNER, 0.0), seen_from(CORNER, 0.0, 0.0), seen_from(WALL_ABOVE, 0.3, 0.3)):
        assert told(graph).nature.tolist() == [OPEN]


def test_toward_a_wall_nothing_is_told() -> None:
    """Its foot point stays where it is, as that of a point does."""
    assert told(seen_from(Line(0.0, 4.0), 0.0, 0.8, 1.6)).nature.tolist() == [OPEN]
    assert told(seen_from(Spot(4.0, 0.0), 0.0, 0.8, 1.6)).nature.tolist() == [OPEN]


def test_a_nature_is_told_once_the_margin_is_reached() -> None:
    """The wrong kind costs more the farther the stations are apart: told at some baseline, and from there on."""
    natures = [told(seen_from(WALL_ABOVE, 0.0, step)).nature[0] for step in np.linspace(0.0, 0.3, 31)]
    first = natures.index(WALL)
    assert 0 < first < 30
    assert natures == [OPEN] * first + [WALL] * (31 - first)
    stricter = replace(CONFIG, nature_margin=10 * CONFIG.nature_margin)
    assert told(seen_from(WALL_ABOVE, 0.0, 0.01 * first), stricter).nature.tolist() == [OPEN]


def test_what_is_not_told_yet_is_taken_for_what_explains_it_better() -> None:
    loose = replace(CONFIG, nature_margin=1e6)
    assert told(seen_from(CORNER, 0.0, 0.8), loose).as_point.tolist() == [1]
    assert told(seen_from(WALL_ABOVE, 0.0, 0.8), loose).as_point.tolist() == [0]


def test_the_line_and_the_point_are_where_they_are() -> None:
    wall = told(seen_from(WALL_ABOVE, 0.0, 0.8))
    alpha, off = wall.line[0]
    assert (alpha, wall.anchor[0, 1] + off * math.sin(alpha)) == pytest.approx((math.pi / 2, 1.0), abs=1e-5)
    assert told(seen_from(CORNER, 0.0, 0.8)).point[0] == pytest.approx((0.0, 1.0, 0.0), abs=1e-5)


def test_a_post_is_as_thick_as_it_is() -> None:
    """Seen from all sides its rim is nearer than any point that the lines of sight meet in; from one side who knows."""
    around = [Pose(math.cos(turn), math.sin(turn), 0.0) for turn in (0.0, 0.8, 1.6, 2.4)]
    for radius in (0.05, 0.2, 0.4):
        graph = graph_of(around, [Spot(0.0, 0.0, radius)], [(k, 0) for k in range(4)], told=False)
        found = told(told(replace(graph, point=graph.point * (1.0, 1.0, 0.0))))
        assert found.nature.tolist() == [POINT]
        assert found.point[0] == pytest.approx((0.0, 0.0, radius), abs=2e-3)
    assert told(seen_from(Spot(3.0, 0.0, 0.2), 0.0, 0.8, 1.6)).point[0, 2] == 0.0


def test_noise_makes_no_corner_thick() -> None:
    around = [Pose(math.cos(turn), math.sin(turn), 0.0) for turn in np.linspace(0.0, 2.0, 6)]
    clean = graph_of(around, [Spot(0.0, 0.0)], [(k, 0) for k in range(6)], told=False)
    thick = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        bearing = clean.bearing + rng.normal(0.0, SIGMA, 6)
        distance = clean.distance + rng.normal(0.0, CONFIG.distance_sigma_m, 6)
        thick += bool(told(replace(clean, bearing=bearing, distance=distance)).point[0, 2] > 0.0)
    assert thick <= 1


def test_what_was_seen_often_keeps_its_radius() -> None:
    around = [Pose(math.cos(0.1 * k), math.sin(0.1 * k), 0.0) for k in range(41)]
    for often, radius in ((40, 0.2), (41, 0.0)):
        graph = graph_of(around[:often], [Spot(0.0, 0.0, 0.2)], [(k, 0) for k in range(often)])
        found = told(replace(graph, point=graph.point * (1.0, 1.0, 0.0)))
        assert found.point[0, 2] == pytest.approx(radius, abs=2e-2)


def test_what_was_seen_often_keeps_its_nature() -> None:
    many = seen_from(CORNER, *(0.1 * k for k in range(13)))
    assert told(replace(many, nature=np.array([WALL]))).nature.tolist() == [WALL]
    assert told(many).nature.tolist() == [POINT]
