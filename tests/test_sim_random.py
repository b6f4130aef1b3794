"""Places that a number makes."""

import numpy as np
import pytest

from sonarlog.canonical import canonical
from sonarlog.digest import digest_of
from sonarlog.route import parse_route
from sonarlog.sim.outline import Edge, Leg, closed, gap, is_simple, laid, niche, ring, room, strip
from sonarlog.sim.world import FREE, BadWorld, is_ours, load_world

SOME = range(1, 41)


@pytest.mark.parametrize("number", SOME)
def test_a_random_place_is_closed_and_has_a_tour_that_keeps_off_its_walls(number: int) -> None:
    place = load_world(f"random:{number}")
    raster = place.raster(0.1)
    assert raster.cells[-raster.bottom, -raster.left] == FREE
    assert not np.concatenate([raster.cells[[0, -1]].ravel(), raster.cells[:, [0, -1]].ravel()]).any()
    assert parse_route(place.tour)
    assert 8 <= place.tour.count("scan") <= 80
    assert place.about


def test_same_number_same_place_on_every_machine() -> None:
    """A change of this digest is a change of the places that algorithms are judged in."""
    surfaces = [load_world(f"random:{number}").surfaces().segments for number in SOME]
    assert digest_of(canonical(surfaces)) == "2f0bca2942b02cc22c77b37f7bb9ea05"


def test_random_places_differ_and_have_glass_and_pillars_among_them() -> None:
    places = [load_world(f"random:{number}") for number in SOME]
    assert len({place.tour for place in places}) == len(places)
    materials = [{wall.material for wall in place.walls} for place in places]
    for kind in (lambda m: m.echo == 0, lambda m: 0 < m.echo < 0.6, lambda m: m.half_beam_deg <= 6):
        assert sum(any(map(kind, each)) for each in materials) > len(places) / 10
    assert any(place.poles for place in places)


@pytest.mark.parametrize("name", ["random:", "random:x", "random:-1", "random:1.5", "random:12345678901"])
def test_a_random_place_needs_a_number(name: str) -> None:
    assert not is_ours(name)
    with pytest.raises(BadWorld, match="has a number, such as random:7"):
        load_world(name)


def test_a_strip_with_a_bend_and_a_step() -> None:
    legs = [Leg(2.0, 1.0, 1.0, 90.0), Leg(2.0, 1.0, 1.0), Leg(1.0, 0.5, 2.0)]
    points = [edge.start for edge in strip(laid(legs, 0.0), "m")]
    assert np.round(points, 9).tolist() == [
        [0, -1], [3, -1], [3, 2], [4, 2], [4, 3], [1.5, 3], [1.5, 2], [1, 2], [1, 1], [0, 1],
    ]  # fmt: skip


def test_a_ring_is_as_wide_as_it_says() -> None:
    legs = [Leg(4.0, 0.5, 0.5, 60.0), Leg(3.0, 0.5, 0.5, 120.0)] * 2
    without, within = ring(laid(legs, 1.0), "m")
    assert is_simple(without, 0.1)
    assert min(gap(a, b) for a in without for b in within) == pytest.approx(1.0)


def test_niches_and_rooms_lie_behind_their_wall() -> None:
    wall = Edge((0.0, 0.0), (6.0, 0.0), "m")  # free space above it
    assert [edge.end for edge in niche(wall, 1.0, 2.0, 0.5, "door")] == [(1, 0), (1, -0.5), (3, -0.5), (3, 0), (6, 0)]
    piece = room(wall, 2.0, 1.0, 0.2, (0.5, 0.7, 2.0))
    assert np.round([edge.end for edge in piece], 9).tolist() == [
        [2, 0], [2, -0.2], [1.5, -0.2], [1.5, -2.2], [3.7, -2.2], [3.7, -0.2], [3, -0.2], [3, 0], [6, 0],
    ]  # fmt: skip


def test_gaps() -> None:
    square = closed([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)], "m")
    assert gap(square[0], square[2]) == 1.0
    assert gap(Edge((1.0, -1.0), (1.0, 3.0), "m"), square[0]) == 0.0
    assert is_simple(square, 0.9)
    assert not is_simple(closed([(0.0, 0.0), (2.0, 0.0), (0.0, 1.0), (2.0, 1.0)], "m"), 0.1)
