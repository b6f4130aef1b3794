"""Which landmark a wall of the sweep is: one pair at a time, and whole sweeps of a made-up place."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from slam.arcs import Beams
from slam.association import WALL, Association, Chains
from slam.config import Config
from slam.dmath import DEGREE
from slam.features import Wall
from slam.geometry import ORIGIN, Pose, segment
from slam.graph.matching import _matched, match
from slam.graph.problem import Graph
from slam.motion import Motion, Wheels
from slam.self_calibration import Calibrated, Calibration
from slam.track import Track
from tests.graphs import Line, Spot, graph_of

INF = math.inf


@pytest.mark.parametrize(
    ("chi", "pairs", "postponed"),
    [
        ([[1.0]], {0: 0}, ()),
        ([[16.1]], {}, ()),  # beyond the gate: something new
        ([[]], {}, ()),
        ([[1.0, 40.0]], {0: 0}, ()),
        ([[1.0, 6.9]], {}, (0,)),  # could be either
        ([[1.0, 7.1]], {0: 0}, ()),  # worse by more than the margin
        ([[1.0, INF]], {0: 0}, ()),
        ([[15.9, 17.0]], {}, (0,)),  # the other one lies beyond the gate, but hardly
        ([[15.0, 20.0], [1.0, INF]], {1: 0}, (0,)),
        ([[1.0], [9.0]], {0: 0}, (1,)),  # two walls for one landmark: the better one, and the other waits
        ([[1.0], [3.0]], {}, (0, 1)),  # or neither
        ([[1.0, 30.0], [30.0, 2.0]], {0: 0, 1: 1}, ()),
    ],
)
def test_pairs_that_leave_no_doubt(chi: list[list[float]], pairs: dict[int, int], postponed: tuple[int, ...]) -> None:
    assert _matched(np.array(chi), 16.0, 6.0) == (pairs, postponed)


# whole sweeps ----------------------------------------------------------------------------------------------------

STATIONS = [Pose(0.8 * k, 0.0, 0.0) for k in range(3)]
CORRIDOR = [Line(math.pi / 2, 1.0), Line(-math.pi / 2, 1.0)]


def track_of(things: Sequence[Line | Spot], seen: Sequence[tuple[int, int]] | None = None) -> Track:
    """What the graph would know after a walk past these things; chains in the order of the sightings."""
    seen = seen or [(s, t) for s in range(len(STATIONS)) for t in range(len(things))]
    graph: Graph = graph_of(STATIONS, things, seen)
    chains = Chains()
    begun: dict[int, int] = {}
    for k, (sweep, thing) in enumerate(seen):
        piece = segment(float(graph.bearing[k]), float(graph.distance[k]), -0.2, 0.2).moved(STATIONS[sweep])
        chains = chains.joined([(begun.get(thing), int(graph.nature[thing]), piece)], sweep)
        begun.setdefault(thing, len(begun))
    return Track(tuple(STATIONS), chains, graph)


def arrived(predicted: Pose, joined: bool = True) -> Calibrated:
    """A sweep whose readings do not matter, 0.8 m on by odometry."""
    none = np.zeros(0)
    beams = Beams(none.astype(np.int64), none, none.astype(bool), np.zeros((0, 2)), none, 0.2)
    motion = Motion(0.8, 0.0, math.pi, 0.0, math.pi) if joined else None
    return Calibrated("scan", beams, none, Wheels(predicted, 0, 0, 0), motion, predicted, Calibration.unknown(8), 0)


def wall(alpha: float, distance: float) -> Wall:
    return Wall(
        0, segment(alpha, distance, -0.22 * distance, 0.22 * distance), 0.5 * DEGREE, -0.22 * distance, 0.22 * distance
    )


def matched(track: Track, predicted: Pose, *walls: Wall, joined: bool = True) -> Association:
    return match(arrived(predicted, joined), tuple(walls), track, Config())


HERE = Pose(2.4, 0.0, 0.0)
UP, DOWN = math.pi / 2, -math.pi / 2


def chains(found: Association) -> dict[int, int]:
    return {link.wall: link.chain for link in found.links}


def test_both_sides_of_a_corridor_are_found_and_the_pose_follows() -> None:
    found = matched(track_of(CORRIDOR), HERE, wall(UP - 0.02, 0.98), wall(DOWN - 0.02, 1.02))
    assert chains(found) == {0: 0, 1: 1}
    assert found.pose is not None
    # Two walls good to 1.2 cm against odometry good to 1.8 cm: 82 % of what the walls say.
    assert found.pose.y == pytest.approx(0.82 * 0.02, abs=0.001)
    assert 0.005 < found.pose.theta < 0.01  # a third of it: bearings here are no better than odometry
    assert [link.nature for link in found.links] == [WALL, WALL]


def test_something_new_begins_a_chain() -> None:
    found = matched(track_of(CORRIDOR), HERE, wall(UP, 1.0), wall(DOWN, 1.0), wall(0.0, 2.0))
    assert (chains(found), found.unlinked, found.postponed) == ({0: 0, 1: 1}, (2,), ())


def test_of_two_walls_close_to_one_another_what_could_be_either_is_postponed() -> None:
    """A wall and a recess 4 cm deeper, with odometry good to centimetres: what lies between is neither's."""
    track = track_of([*CORRIDOR, Line(math.pi / 2, 1.04)])
    found = matched(track, HERE, wall(UP, 1.02), wall(DOWN, 1.0))
    assert (chains(found), found.postponed, found.unlinked) == ({1: 1}, (0,), (0,))
    for distance, chain in ((1.0, 0), (1.04, 2)):
        found = matched(track, HERE, wall(UP, distance), wall(DOWN, 1.0))
        assert chains(found) == {0: chain, 1: 1}


def test_the_two_faces_of_a_thin_wall_never_meet() -> None:
    front = track_of([Line(math.pi / 2, 1.0)])
    beyond = Pose(2.4, 2.02, 0.0)
    found = matched(front, beyond, wall(DOWN, 1.0))
    assert (found.links, found.unlinked) == ((), (0,))


@pytest.mark.parametrize(("gap", "same"), [(2.9, True), (3.1, False)])
def test_pieces_of_one_wall_may_be_three_metres_apart(gap: float, same: bool) -> None:
    """The last piece ends at 1.6 + 0.2, the new one begins 0.22 before the robot."""
    here = Pose(1.8 + gap + 0.22, 0.0, 0.0)
    found = matched(track_of([Line(math.pi / 2, 1.0)]), here, wall(UP, 1.0))
    assert bool(found.links) == same
    if same:
        assert found.links[0].gap == pytest.approx(gap, abs=1e-6)


def test_a_point_is_found_again_and_is_no_wall() -> None:
    track = track_of([*CORRIDOR, Spot(3.4, 0.8)])
    bearing, distance = math.atan2(0.8, 1.0), math.hypot(0.8, 1.0)
    found = matched(track, HERE, wall(UP, 1.0), wall(DOWN, 1.0), wall(bearing, distance))
    assert chains(found) == {0: 0, 1: 1, 2: 2}


def test_a_robot_that_was_shoved_is_found_by_the_coarse_search() -> None:
    place = track_of([*CORRIDOR, Line(0.0, 6.0)])
    shoved = [wall(UP + 0.03, 0.8), wall(DOWN + 0.03, 1.2), wall(0.03, 3.6)]
    found = matched(place, HERE, *shoved)
    assert chains(found) == {0: 0, 1: 1, 2: 2}
    assert found.pose is not None
    assert (found.pose.y, found.pose.theta) == pytest.approx((0.2, -0.03), abs=0.01)


def test_without_odometry_the_place_is_looked_for_further_out() -> None:
    found = matched(track_of(CORRIDOR), HERE, wall(UP - 0.05, 0.9), wall(DOWN - 0.05, 1.1), joined=False)
    assert chains(found) == {0: 0, 1: 1}


ROOM: list[Line | Spot] = [Line(0.0, 3.0), Line(math.pi / 2, 1.6), Line(math.pi, 1.7), Line(-2.0, 1.3), Spot(1.9, 0.7)]


def seen_from(place: Pose, *things: Line | Spot) -> list[Wall]:
    walls = []
    for thing in things:
        if isinstance(thing, Spot):
            dx, dy = thing.x - place.x, thing.y - place.y
            walls.append(wall(math.atan2(dy, dx) - place.theta, math.hypot(dx, dy)))
        else:
            off = thing.rho - (math.cos(thing.alpha) * place.x + math.sin(thing.alpha) * place.y)
            walls.append(wall(thing.alpha - place.theta, off))
    return walls


@pytest.mark.parametrize(("x", "y", "degrees"), [(0.9, -0.3, 0.0), (0.4, 0.3, -12.0), (1.6, 0.2, 15.0)])
def test_after_a_long_silence_the_place_that_explains_all_walls_is_found(x: float, y: float, degrees: float) -> None:
    there = Pose(x, y, degrees * DEGREE)
    found = matched(track_of(ROOM), Pose(0.9, 0.2, 0.0), *seen_from(there, *ROOM), joined=False)
    assert chains(found) == {k: k for k in range(len(ROOM))}
    assert found.pose is not None
    assert (found.pose.x, found.pose.y, found.pose.theta) == pytest.approx((x, y, there.theta), abs=2e-3)


def test_one_wall_is_no_reason_to_believe_that_the_robot_was_carried_off() -> None:
    track = track_of([Line(math.pi / 2, 1.0), Line(0.0, 4.0)])
    found = matched(track, Pose(0.8, 0.0, 0.0), wall(math.pi / 2, 1.17))
    assert found.unlinked == (0,)
    assert found.pose == Pose(0.8, 0.0, 0.0).quantised()


@pytest.mark.parametrize(("walls", "believed"), [(2, False), (5, True)])
def test_a_turn_that_many_walls_agree_on_is_believed_at_once(walls: int, believed: bool) -> None:
    """Each by itself is a little wild from where odometry stands."""
    there = Pose(1.6, 0.0, 2.4 * DEGREE)
    found = matched(track_of(ROOM), Pose(1.6, 0.0, 0.0), *seen_from(there, *ROOM[:walls]))
    assert found.pose is not None
    assert (found.pose.theta > 2.0 * DEGREE) is believed


def test_nothing_seen_and_nothing_known() -> None:
    empty = matched(track_of(CORRIDOR), HERE)
    assert (empty.links, empty.unlinked, empty.pose) == ((), (), HERE.quantised())
    first = match(arrived(ORIGIN, joined=False), (wall(UP, 1.0),), Track(), Config())
    assert (first.links, first.unlinked) == ((), (0,))
