"""What is left behind and how to get back to it: windows, places that go with their scans, roads between scans."""

import numpy as np
import pytest

from slam.boards import board, stride_of
from slam.dmath import Floats
from slam.frontier import next_goal
from slam.frontier_config import FrontierConfig
from slam.geometry import Pose
from slam.grid import TILE, Grid, Patch
from slam.intent import Intent
from slam.planning import Ground
from slam.prospects import Left, Prospects
from slam.roads import Journeys, Roads
from slam.window import Window, changed_about, in_sight_of

CONFIG = FrontierConfig()


def one(x: float, y: float) -> Prospects:
    place, two = np.array([[x, y]]), np.array([2])
    return Prospects(place, place + np.array([1.0, 0.0]), two, two * 1.0, two, two * 1.0)


@pytest.mark.parametrize(("x", "y"), [(0.1, 0.1), (3.1, 3.1), (-0.1, -3.1)])
def test_a_scan_changes_nothing_outside_of_its_window(x: float, y: float) -> None:
    window = changed_about(x, y, 0.05)
    assert window.left * 0.05 <= x - 3.2 + 1e-9
    assert window.right * 0.05 >= x + 3.2 - 1e-9
    assert window.bottom * 0.05 <= y - 3.2 + 1e-9
    assert window.top * 0.05 >= y + 3.2 - 1e-9
    assert in_sight_of(window, 0.05) == window.grown(1)


@pytest.mark.parametrize(
    ("moved", "rest"),
    [((1, 0), (0, 0, 1, 3)), ((-1, 0), (2, 0, 3, 3)), ((0, 1), (0, 0, 3, 1)), ((0, -2), (0, 1, 3, 3)),
     ((1, 1), (0, 0, 3, 3)), ((5, 0), (0, 0, 3, 3))],
)  # fmt: skip
def test_what_a_window_leaves_behind(moved: tuple[int, int], rest: tuple[int, int, int, int]) -> None:
    dx, dy = (TILE * k for k in moved)
    before = Window(0, 0, 3 * TILE, 3 * TILE)
    after = Window(dx, dy, dx + 3 * TILE, dy + 3 * TILE)
    assert before.without(after) == Window(*(TILE * k for k in rest))


def test_what_was_left_goes_with_the_scan_next_to_it() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    left = Left().and_(one(5.5, 1.0), poses).and_(one(0.5, 0.0), poses)
    assert left.scans.tolist() == [1, 0]
    assert left.now(poses).places.tolist() == [[5.5, 1.0], [0.5, 0.0]]
    poses[1] = (5.0, 2.0, np.pi / 2)  # a loop was closed
    moved = left.now(poses)
    assert moved.places == pytest.approx(np.array([[4.0, 2.5], [0.5, 0.0]]), abs=1e-9)
    assert moved.regions == pytest.approx(np.array([[4.0, 3.5], [1.5, 0.0]]), abs=1e-9)


def floor(size: int, wall: slice) -> Ground:
    """A square about the origin, cells of 10 cm, with a wall of cells along x = 0."""
    mask = np.ones((size, size), dtype=np.bool_)
    mask[wall, size // 2] = False
    stride = stride_of(size, 1)
    return Ground(board(mask, stride), stride, mask.shape, -size // 2, -size // 2, 0.10)


def roads_of(scans: Floats, ground: Ground) -> Roads:
    roads = Roads()
    for k in range(len(scans)):
        roads = roads.joined(scans[: k + 1], ground)
    return roads


def gone(journeys: Journeys, within_m: float = np.inf) -> Journeys:
    assert journeys.go_on(within_m) == (within_m < np.inf)
    return journeys


def test_scans_are_joined_where_the_robot_drove_and_where_nothing_stands_between() -> None:
    scans = np.array([[-0.5, 0.0], [-0.5, 1.5], [0.5, 1.5], [0.5, 0.0]])  # about the end of a wall
    walled, open_ = floor(60, slice(0, 40)), floor(60, slice(0, 0))
    assert roads_of(scans, walled).pairs.tolist() == [[0, 1], [1, 2], [2, 3]]
    assert roads_of(scans, open_).pairs.tolist() == [[0, 1], [1, 2], [0, 3], [2, 3]]
    metres = [gone(Journeys(roads_of(scans, ground), scans, {3: 0.0})).metres[0] for ground in (walled, open_)]
    assert metres == [4.0, 1.0]


def test_a_way_along_roads_begins_at_the_scan_that_makes_it_shortest() -> None:
    scans = np.array([[float(k), 0.0] for k in range(6)])
    roads = Roads(np.array([[k, k + 1] for k in range(5)]))
    journeys = gone(Journeys(roads, scans, {5: 0.0, 3: 2.5}), 4.0)
    assert journeys.metres.tolist() == [np.inf, np.inf, 3.5, 2.5, 1.0, 0.0]
    gone(journeys)
    assert journeys.metres.tolist() == [5.5, 4.5, 3.5, 2.5, 1.0, 0.0]
    entry, points = journeys.road(0)
    assert entry == 3
    assert points[[0, -1]] == pytest.approx(np.array([[2.9, 0.0], [0.0, 0.0]]))
    blocked = roads.without(scans, np.array([[1.5, 0.2]]), 0.3)
    assert np.isinf(gone(Journeys(blocked, scans, {5: 0.0})).metres[:2]).all()


def test_a_doorway_left_behind_is_gone_back_to() -> None:
    """A corridor with a doorway at its beginning; the robot has gone to its end, where nothing is left."""
    y, x = ((np.indices((120, 640)) - [[[60]], [[100]]]) + 0.5) * 0.05
    free = (np.abs(y) < 0.9) & (x > -1.0) & (x < 26.0)
    doorway = (x > 0.4) & (x < 1.8)
    walls = (np.abs(y) < 1.0) & (x > -1.1) & (x < 26.1) & ~free & ~(doorway & (y > 0))
    grid = Grid(0.05, 15, -6).extended(Patch(-100, -60, np.where(walls, 40, np.where(free, -40, 0)).astype(np.int16)))
    known, poses = Intent(), tuple(Pose(k * 0.8, 0.0, 0.0) for k in range(33))
    goals = []
    for k in range(1, len(poses) + 1):
        decision, known = next_goal(grid, poses[:k], known, CONFIG, 0.9)
        goals.append(decision.chosen)
    assert None not in goals
    assert decision.regions[decision.chosen or 0].centre == pytest.approx((1.1, 0.9), abs=0.3)
    assert decision.left > 0
    assert decision.length_m == pytest.approx(25.0, abs=1.5)
    steps = np.hypot(*np.diff(decision.path, axis=0).T)
    assert steps.max() < 0.2
    assert np.abs(decision.path[:, 1]).max() < 0.9
