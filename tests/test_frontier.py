"""Block I against worked answers: what can be driven about a scan, what sees walls squarely, what is tried again."""

from dataclasses import replace

import numpy as np
import pytest

from slam.choice import Bar
from slam.frontier import next_goal
from slam.frontier_config import FrontierConfig
from slam.geometry import ORIGIN, Bools, Pose
from slam.grid import Grid, Patch
from slam.intent import PATIENCE, Intent
from slam.prospects import Prospects
from slam.regions import Ranks, ranks_of
from slam.terrain import ground_of, heard_cells, heard_from, room_to_stand, spare_cells
from slam.views import views_of

CONFIG = FrontierConfig()
AT_ORIGIN = np.zeros((1, 3))


def grid_of(free: Bools, occupied: Bools) -> Grid:
    """About the origin, cells of 5 cm."""
    height, width = free.shape
    log_odds = np.where(occupied, 40, np.where(free, -40, 0)).astype(np.int16)
    return Grid(0.05, 15, -6).extended(Patch(-width // 2, -height // 2, log_odds))


def corridor(half_m: float, from_m: float, to_m: float, size: int = 120) -> Grid:
    """Along x, its walls known from x to x and free between."""
    y, x = ((np.indices((size, size)) - size // 2) + 0.5) * 0.05
    known = (x > from_m) & (x < to_m)
    wall = known & (np.abs(y) > half_m) & (np.abs(y) < half_m + 0.1)
    return grid_of(known & (np.abs(y) < half_m), wall)


def seen(grid: Grid) -> Ranks:
    ranks = ranks_of(grid, CONFIG.chink_cells, spare_cells(CONFIG, grid.cell_m))
    assert ranks is not None
    return ranks


@pytest.mark.parametrize(("half_m", "cells"), [(0.5, 10), (0.75, 15), (2.0, 16)])
def test_nothing_stands_about_a_scan_up_to_the_nearest_thing_known(half_m: float, cells: int) -> None:
    assert heard_from(seen(corridor(half_m, -1.0, 0.3)), ORIGIN, np.inf, CONFIG) == pytest.approx(cells, abs=1)


def test_what_answered_counts_though_the_map_does_not_show_it_yet() -> None:
    assert heard_from(seen(corridor(2.0, -1.0, 0.3)), ORIGIN, 0.4, CONFIG) == pytest.approx(8, abs=1)
    assert heard_from(seen(corridor(2.0, -1.0, 0.3)), ORIGIN, 0.0, CONFIG) == 0


def test_the_robot_stands_nowhere_beside_what_was_never_seen() -> None:
    grid = corridor(2.0, -1.0, 1.0)
    ranks = seen(grid)
    room = room_to_stand(ranks, 0, CONFIG)
    row = -ranks.bottom
    free = np.flatnonzero(room[row]) + ranks.left
    edge = 1.0 - CONFIG.unseen_m
    assert (free.min() * 0.05, free.max() * 0.05) == pytest.approx((-edge, edge), abs=0.06)


def test_a_corridor_is_gone_on_along_though_nothing_ahead_was_seen() -> None:
    """Seen up to 0.2 m ahead, no end in sight: without the circle there is hardly a step to be made."""
    grid = corridor(1.0, -2.0, 0.2)
    ranks = seen(grid)
    circle = np.array([heard_from(ranks, ORIGIN, 1.0, CONFIG)])
    ahead = [ground_of(ranks, heard_cells(ranks, AT_ORIGIN, some), AT_ORIGIN, Intent(), CONFIG)
             for some in (circle[:0], circle)]  # fmt: skip
    farthest = [max(k for k in range(30) if g.passable >> ((g.cell(0.05 * k, 0.0)[0]) * g.stride
                + g.cell(0.05 * k, 0.0)[1]) & 1) * 0.05 for g in ahead]  # fmt: skip
    assert farthest[0] <= 0.2
    assert 0.6 <= farthest[1] <= 0.8
    decision, _ = next_goal(grid, (Pose(-1.0, 0.0, 0.0), ORIGIN), Intent(), CONFIG, 1.0)
    assert decision.chosen is not None
    assert decision.path[-1, 0] > 0.4
    assert abs(decision.path[-1, 1]) < 0.5


def test_walls_are_seen_squarely_from_no_way_from_one_and_from_two() -> None:
    y, x = ((np.indices((200, 200)) - 100) + 0.5) * 0.05
    free = (np.abs(x) < 4.0) & (np.abs(y) < 4.0)
    one = free & (x > 1.0) & (x < 1.1)
    two = one | (free & (y > 1.0) & (y < 1.1))
    found = []
    for occupied in (np.zeros_like(free), one, two):
        ranks = seen(grid_of(free & ~occupied, occupied))
        place = (np.array([-ranks.bottom]), np.array([-ranks.left]))
        views = views_of(ranks, place, place, np.zeros((0, 2)), 0.3)
        found.append(int(views.square[0]))
    assert found == [0, 1, 2]


@pytest.mark.parametrize(
    ("width_m", "behind_m", "least", "most"),
    [(1.0, 9.0, 0.7, 1.6), (1.0, 0.6, 0.1, 0.35), (0.4, 9.0, 0.0, 0.3)],
    ids=["door", "niche", "slit"],
)
def test_a_door_leads_somewhere_and_a_niche_and_a_slit_do_not(
    width_m: float, behind_m: float, least: float, most: float
) -> None:
    y, x = ((np.indices((200, 200)) - 100) + 0.5) * 0.05
    front = (x > 0.5) & (x < 0.6) & (np.abs(y) > width_m / 2)
    back = (x > 0.5 + behind_m) & (x < 0.7 + behind_m)
    sides = (x > 0.5) & (x < 0.7 + behind_m) & (np.abs(np.abs(y) - width_m / 2 - 0.05) < 0.05)
    occupied = front | back | (sides & (behind_m < 2.0))
    ranks = seen(grid_of((x < 0.5) & ~occupied, occupied))
    place = (np.array([-ranks.bottom]), np.array([-ranks.left]))
    views = views_of(ranks, place, (place[0], place[1] + 10), np.zeros((0, 2)), 0.3)
    assert least <= float(views.gains[0]) <= most


def test_what_stands_in_the_way_is_counted_though_it_was_forgiven() -> None:
    leg = np.column_stack([np.linspace(0.0, 1.0, 21), np.zeros(21)])
    known = Intent()
    for sweep in range(PATIENCE):
        poses = (ORIGIN,) * (sweep + 1) + (Pose(0.3, 0.0, 0.0),)
        known = replace(known, goal=(2.0, 0.0), leg=leg).after(poses, 12)
        assert [block.times for block in known.blocks] == [sweep + 1]
        known = known.forgiving()
    assert known.blocks


def test_in_the_end_a_long_way_must_show_more_than_a_short_one_but_less_early() -> None:
    lengths = np.array([1.0, 2.0, 12.0])
    early, middle, late = (Bar(CONFIG, Intent(), scans, last=True).least(lengths) for scans in (10, 36, 90))
    for scans, least in ((10, early), (36, middle), (90, late)):
        assert (np.diff(least) > 0.0).all()
        assert least[0] < 0.4
        assert (least < Bar(CONFIG, Intent(), scans).least(lengths)).all()
    assert (early <= middle).all()
    assert CONFIG.far_enough_m2 < late[2] < CONFIG.far_most_m2
    assert middle[2] > 1.0  # half of what it has driven so far


def test_in_the_end_what_is_wide_counts_half_a_metre_off_a_scan_and_what_is_not_a_metre_off() -> None:
    gains, away = np.array([1.0, 0.4, 0.4, 1.0]), np.array([0.9, 0.9, 1.0, 0.4])
    whole = np.full(4, 2)
    prospects = Prospects(np.full((4, 2), 3.0), np.zeros((4, 2)), whole, gains, whole, away)
    worth = Bar(CONFIG, Intent(), 40, last=True).worth(prospects)
    assert worth.tolist() == [CONFIG.far_enough_m2, 0.0, 0.4, 0.0]
    late = Bar(CONFIG, Intent(), 90, last=True)
    assert late.worth(prospects)[0] == late.enough > CONFIG.far_enough_m2
