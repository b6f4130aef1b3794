from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.association import POINT, Chains, Member
from slam.geometry import ORIGIN, Pose, through
from slam.grid import Cells, Grid, Patch
from sonarlog.log import Surfaces
from sonarlog.map_metrics import distance_to_surfaces, map_quality, surfaces_in_map
from sonarlog.metrics import (
    NotComparable,
    best_frame,
    chain_straightness,
    frame_between,
    path_errors,
    placed,
    relative_errors,
    rigid_alignment,
    straightness,
)

LINE = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)])
SOMEWHERE = Pose(3.0, -2.0, 2.5)
small = st.floats(-10, 10)


def test_a_path_is_held_against_the_truth_at_its_first_pose_wherever_its_frame_lies() -> None:
    off = LINE + np.array([(0.0, 0.0, 0.0), (0.0, 0.3, 0.1), (0.0, 0.4, 0.1)])
    errors = path_errors(off, placed(LINE, SOMEWHERE))
    assert errors.ate_m == pytest.approx(np.sqrt((0.09 + 0.16) / 3))
    assert errors.end_m == pytest.approx(0.4)
    assert errors.heading_rmse_deg == pytest.approx(np.degrees(np.sqrt(0.02 / 3)))


def test_a_bend_is_an_error_that_alignment_lessens_and_a_turn_one_that_it_takes_away() -> None:
    turned = np.column_stack([Pose(0, 0, 0.1).points(LINE[:, :2]), LINE[:, 2]])
    errors = path_errors(turned, LINE)
    assert errors.ate_m > 0.1
    assert errors.ate_aligned_m == pytest.approx(0.0, abs=1e-12)


def test_ratio_to_a_path_without_error_is_unknown() -> None:
    exact, off = path_errors(LINE, LINE), path_errors(LINE * 1.1, LINE)
    assert exact.ratio(off)["ate_m"] == 0.0
    assert off.ratio(exact)["ate_m"] is None


@pytest.mark.parametrize("truth", [LINE[:2], LINE[:0]])
def test_paths_of_other_lengths_are_refused(truth: np.ndarray) -> None:
    with pytest.raises(NotComparable, match="3 poses cannot be held against"):
        path_errors(LINE, truth)


def test_relative_errors_are_what_a_piece_of_path_adds_whatever_came_before() -> None:
    truth = np.array([(k, 0.0, 0.0) for k in range(7)], dtype=np.float64)
    longer = placed(truth * 1.1, SOMEWHERE)
    assert relative_errors(longer, truth, 1.0) == pytest.approx((0.1, 0.0))
    assert relative_errors(longer, truth, 5.0) == pytest.approx((0.5, 0.0))
    once = truth.copy()
    once[4:] += (0.0, 0.6, 0.0)  # one jump of six in all: at one piece of 1 m, at two of the two of 5 m
    assert relative_errors(once, truth, 1.0) == pytest.approx((0.6 / np.sqrt(6), 0.0))
    assert relative_errors(once, truth, 5.0) == pytest.approx((0.6, 0.0))
    turning = np.column_stack([truth[:, :2], np.radians(2.0 * truth[:, 0])])
    over = relative_errors(turning, truth, 5.0)
    assert over is not None
    assert over[1] == pytest.approx(10.0)
    assert relative_errors(truth, truth, 6.5) is None


@given(small, small, st.floats(-3, 3))
def test_rigid_alignment_finds_the_motion_that_was_made(x: float, y: float, theta: float) -> None:
    points = np.array([(0.0, 0.0), (4.0, 1.0), (2.0, 5.0)])
    moved = Pose(x, y, theta).points(points)
    assert rigid_alignment(points, moved).points(points) == pytest.approx(moved, abs=1e-9)


def chain(*pieces: tuple[float, float, float, float]) -> Chains:
    """One chain, a piece a sweep, each seen from y = 0."""
    members = [
        Member(0, sweep, through((x0, y0), (x1, y1), (x0, 0.0))) for sweep, (x0, y0, x1, y1) in enumerate(pieces)
    ]
    return Chains(tuple(members), (0,))


def test_a_bent_wall_deviates_from_its_best_line_by_half_its_sagitta() -> None:
    pieces = [(0.0, 1.0, 1.0, 1.0), (2.0, 1.2, 3.0, 1.2), (4.0, 1.0, 5.0, 1.0)]
    (mapped,) = chain_straightness(chain(*pieces))
    assert mapped.pieces == 3
    assert mapped.length_m == pytest.approx(5.0)
    assert mapped.deviation_m == pytest.approx(0.2 - 0.4 / 6)


def test_a_wall_is_known_by_the_true_pose_it_was_seen_from_and_its_doors_are_part_of_it() -> None:
    walls = np.array([(0.0, 1.0, 4.0, 1.0), (4.0, 1.0, 8.0, 1.0), (0.0, -1.0, 3.0, -1.0)])
    truth = np.array([(1.0, 0.0, 0.0), (6.0, 0.0, 0.0)])
    poses = truth + np.array([(0.0, 0.0, 0.0), (0.0, -2.0, 0.0)])  # the second sweep lies where the other wall is
    (mapped,) = straightness(chain((0.5, 1.0, 1.5, 1.0), (5.5, -1.0, 6.5, -1.0)), poses, truth, walls)
    assert (mapped.wall, mapped.pieces) == (0, 2)
    assert mapped.deviation_m > 0.2


def test_neither_the_back_of_a_recess_nor_a_point_is_a_piece_of_the_wall() -> None:
    walls = np.array([(0.0, 1.0, 3.0, 1.0), (3.0, 1.12, 4.0, 1.12), (4.0, 1.0, 8.0, 1.0)])
    seen = chain((0.5, 1.0, 1.5, 1.0), (3.2, 1.12, 3.8, 1.12), (5.5, 1.0, 6.5, 1.0), (7.0, 1.0, 7.5, 1.2))
    members = (*seen.members[:3], replace(seen.members[3], nature=POINT))
    (mapped,) = straightness(replace(seen, members=members), np.zeros((4, 3)), np.zeros((4, 3)), walls)
    assert (mapped.wall, mapped.pieces) == (0, 2)
    assert mapped.deviation_m == pytest.approx(0.0, abs=1e-9)


def test_the_best_frame_takes_a_false_first_heading_out_and_a_robot_that_stood_still_keeps_its_own() -> None:
    path = placed(LINE, Pose(0.0, 0.0, 0.1))
    assert (best_frame(path, LINE).theta, path_errors(path, LINE).ate_aligned_m) == pytest.approx((-0.1, 0.0))
    still = np.array([(0.0, 0.0, 1.0), (0.01, 0.0, 1.0)])
    assert best_frame(still, still * (-1.0, 1.0, 1.0)).theta == pytest.approx(0.0)


def box(size: float) -> Surfaces:
    """A square room around the origin."""
    corners = [(-size, -size), (size, -size), (size, size), (-size, size)]
    sides = [(*a, *b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    return Surfaces("box", np.array(sides), np.zeros((0, 3)))


def room(half: int, wall: int) -> Grid:
    """Free up to `half` cells from the origin, occupied in the ring of cells number `wall`."""
    cells: Cells = np.zeros((101, 101), dtype=np.int16)
    cells[50 - half : 50 + half, 50 - half : 50 + half] = -20
    for k in (50 - wall - 1, 50 + wall):
        cells[k, 50 - wall - 1 : 50 + wall + 1] = cells[50 - wall - 1 : 50 + wall + 1, k] = 40
    return Grid(0.05, 15, -6).extended(Patch(-50, -50, cells))


@pytest.mark.parametrize(
    ("half", "wall", "occupied", "mapped", "free"),
    [
        (20, 20, 1.0, 1.0, 1.0),  # a true map
        (20, 30, 0.0, 0.0, 1.0),  # its walls half a metre out
        (40, 45, 0.0, 0.0, (40 * 40) / (80 * 80 - 4 * 2 * 41)),  # free far beyond the walls
    ],
)
def test_map_quality_of_a_square_room(half: int, wall: int, occupied: float, mapped: float, free: float) -> None:
    for frame in (ORIGIN, Pose(0.3, 0.2, np.pi / 2)):
        surfaces = surfaces_in_map(box(1.0), frame_between(frame, ORIGIN))
        quality = map_quality(room(half, wall), surfaces, frame, np.array([(frame.x, frame.y)]))
        assert quality.occupied_true == pytest.approx(occupied)
        assert quality.surface_mapped == pytest.approx(mapped)
        assert quality.free_true == pytest.approx(free, abs=0.03)


def test_nothing_mapped_nothing_judged() -> None:
    quality = map_quality(Grid(0.05, 15, -6), box(1.0), ORIGIN, np.array([(0.0, 0.0)]))
    assert (quality.occupied_true, quality.surface_mapped, quality.free_true) == (None, 0.0, None)


def test_what_no_station_sees_need_not_be_mapped() -> None:
    behind = Surfaces("two walls", np.array([(1.0, -9.0, 1.0, 9.0), (2.0, -0.2, 2.0, 0.2)]), np.zeros((0, 3)))
    near = map_quality(room(20, 20), behind, ORIGIN, np.array([(0.0, 0.0)])).surface_mapped
    assert near == pytest.approx(2.2 / (2 * np.sqrt(9 - 1)), abs=0.03)


def test_distance_to_walls_and_poles() -> None:
    surfaces = Surfaces("one of each", np.array([(0.0, 0.0, 2.0, 0.0)]), np.array([(5.0, 0.0, 0.5)]))
    points = np.array([(1.0, 0.3), (-0.3, 0.4), (5.0, 0.1)])
    assert distance_to_surfaces(points, surfaces) == pytest.approx([0.3, 0.5, 0.4])
