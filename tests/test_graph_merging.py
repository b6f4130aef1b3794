"""Loop closure: two chains of one wall become one, two walls stay two."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slam.geometry import Pose
from slam.graph.config import GraphConfig
from slam.graph.merging import _tried, merged
from slam.graph.problem import Graph
from tests.graphs import Line, Spot, graph_of

CONFIG = GraphConfig()
STATIONS = [Pose(0.8 * k, 0.0, 0.0) for k in range(10)]
ABOVE, BELOW = Line(math.pi / 2, 1.0), Line(-math.pi / 2, 1.0)
EARLY, LATE = [(k, 0) for k in range(4)], [(k, 2) for k in range(6, 10)]
ALWAYS = [(k, 1) for k in range(10)]


def seen_again(other: Line | Spot, first: Line | Spot = ABOVE, drifted: float = 0.0) -> Graph:
    """A wall seen from the first stations, something seen from the last ones, and one wall all along.

    `drifted`: by so many metres the later poses, and what only they saw, lie to the side.
    """
    graph = graph_of(STATIONS, [first, BELOW, other], [*EARLY, *ALWAYS, *LATE])
    poses, anchor, point = graph.poses.copy(), graph.anchor.copy(), graph.point.copy()
    poses[6:, 1] += drifted
    anchor[2, 1] += drifted
    point[2, 1] += drifted
    return replace(graph, poses=poses, anchor=anchor, point=point)


def joined(graph: Graph, config: GraphConfig = CONFIG) -> tuple[Graph, tuple[tuple[int, int], ...]]:
    return merged(graph, np.array([1, 2]), 1, config)


def test_two_chains_of_one_wall_become_one() -> None:
    graph, pairs = joined(seen_again(ABOVE))
    assert pairs == ((0, 2),)
    assert graph.alive.tolist() == [1, 1, 0]
    assert graph.counts().tolist() == [8, 10, 0]
    assert graph.seen.tolist()[0] == 9
    assert np.abs(graph.poses[:, 1]).max() < 1e-5


def test_what_drifted_since_is_put_right() -> None:
    """Odometry says 3 cm to the side at one step, the wall below agrees with nobody: the two chains say which."""
    graph, pairs = joined(seen_again(ABOVE, drifted=0.03))
    assert pairs == ((0, 2),)
    assert np.abs(graph.poses[:, 1]).max() < 0.001


@pytest.mark.parametrize("deeper", [0.10, -0.10, 0.20])
def test_a_recess_stays_a_wall_of_its_own(deeper: float) -> None:
    graph, pairs = joined(seen_again(Line(math.pi / 2, 1.0 + deeper)))
    assert pairs == ()
    assert graph.alive.tolist() == [1, 1, 1]


def test_a_wall_that_stands_askew_stays_one_of_its_own() -> None:
    """3° about the point of the old one that lies nearest."""
    tilt, x = math.radians(3), 4.0
    askew = Line(math.pi / 2 + tilt, x * math.cos(math.pi / 2 + tilt) + math.sin(math.pi / 2 + tilt))
    assert joined(seen_again(askew))[1] == ()


def test_the_other_face_of_a_thin_wall_stays_one_of_its_own() -> None:
    assert joined(seen_again(Line(-math.pi / 2, -1.0)))[1] == ()


def test_a_point_and_a_wall_stay_two() -> None:
    assert joined(seen_again(Spot(2.4, 1.0)))[1] == ()


def test_two_chains_of_one_point_become_one() -> None:
    graph, pairs = joined(seen_again(Spot(4.0, 1.2), first=Spot(4.0, 1.2)))
    assert pairs == ((0, 2),)
    assert graph.counts().tolist() == [8, 10, 0]


def test_a_gap_of_more_than_it_may_be_keeps_them_apart() -> None:
    """From 2.4 + 0.2 to 4.8 − 0.2 m."""
    assert joined(seen_again(ABOVE), replace(CONFIG, gap_m=2.1))[1] == ((0, 2),)
    assert joined(seen_again(ABOVE), replace(CONFIG, gap_m=1.9))[1] == ()


def test_a_merge_that_failed_is_not_tried_again_until_more_is_seen() -> None:
    strict = replace(CONFIG, merge_margin=-1.0)
    graph, pairs = joined(seen_again(ABOVE), strict)
    assert pairs == ()
    assert graph.tried.tolist() == [[-1, -1, -1], [-1, -1, -1], [0, 4, 4]]
    assert (graph.poses == seen_again(ABOVE).poses).all()
    assert joined(graph)[1] == ()  # even where it would be kept


@pytest.mark.parametrize(("first", "second", "again"), [(4, 4, False), (2, 2, False), (2, 1, True), (1, 2, True)])
def test_a_merge_is_tried_again_when_more_is_known_of_both(first: int, second: int, again: bool) -> None:
    graph = seen_again(ABOVE)
    then = replace(graph, tried=np.array([[-1, -1, -1], [-1, -1, -1], [0, first, second]]))
    assert joined(then)[1] == (((0, 2),) if again else ())


def test_a_merge_is_not_tried_again_for_what_is_seen_of_the_long_wall_alone() -> None:
    count = np.array([75, 20, 2])
    graph = replace(seen_again(ABOVE), tried=np.array([[-1, -1, -1], [-1, -1, -1], [0, 70, 2]]))
    assert _tried(graph, 0, count).tolist() == [False, False, True]
    assert _tried(graph, 2, count).tolist() == [True, False, False]
    assert not _tried(graph, 2, np.array([74, 20, 3])).any()
    assert not _tried(graph, 2, np.array([106, 20, 2])).any()


def test_nothing_is_merged_that_was_seen_once() -> None:
    graph = graph_of(STATIONS, [ABOVE, BELOW, ABOVE], [*EARLY, *ALWAYS, (9, 2)])
    assert joined(graph)[1] == ()
