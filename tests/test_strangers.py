"""The places of benchmarks.strangers: worlds that can be read, with a tour through them that meets no wall."""

import pytest

from benchmarks.strangers import PLACES, ROBOTS, Place
from slam.dmath import DEGREE, sincos
from sonarlog.bench.routes import actions
from sonarlog.route import Scan, Turn, parse_route
from sonarlog.sim.outline import Edge, from_edge, gap
from sonarlog.sim.world import parse_world

RADIUS_M = 0.2


@pytest.mark.parametrize(("name", "place"), {**PLACES, **ROBOTS}.items(), ids=str)
def test_the_tour_leads_through_the_place(name: str, place: Place) -> None:
    world = parse_world(name, place.toml())
    walls = [Edge((wall.x0, wall.y0), (wall.x1, wall.y1), "") for wall in world.walls]
    x, y, heading, scans = 0.0, 0.0, 0.0, 0
    for action in actions(parse_route(world.tour)):
        scans += isinstance(action, Scan)
        if isinstance(action, Turn):
            heading += action.degrees
        elif not isinstance(action, Scan):
            sine, cosine = sincos(heading * DEGREE)
            way = Edge((x, y), (x + action.metres * cosine, y + action.metres * sine), "")
            x, y = way.end
            assert min(gap(way, wall) for wall in walls) > RADIUS_M
            assert all(from_edge((pole.x, pole.y), way) - pole.radius > RADIUS_M for pole in world.poles)
    assert 10 < scans < 60
