from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from slam.geometry import Pose
from slam.grid import Cells, Grid, Patch
from sonarlog.changes import CHANGES, change_pixels, swatch
from sonarlog.legend import Sign, in_rows
from sonarlog.log import Surfaces
from sonarlog.picture import GREEN, VERMILLION, CannotDraw, Panel, draw_maps


def corridor_grid(turn: bool = False) -> Grid:
    """10 m × 2 m of free space between two walls; `turn`: along y instead of x."""
    cells: Cells = np.zeros((44, 200), dtype=np.int16)
    cells[2:42] = -20
    cells[1], cells[42] = 40, 40
    return Grid(0.05, 15, -6).extended(Patch(0, -22, cells) if not turn else Patch(-22, 0, cells.T.copy()))


def panel(title: str = "corridor", turn: bool = False) -> Panel:
    path = np.array([(1.0, 0.0), (9.0, 0.0)])
    walls = np.array([(0.0, 1.0, 10.0, 1.0), (0.0, -1.0, 10.0, -1.0)])
    if turn:
        path, walls = path[:, ::-1], walls[:, [1, 0, 3, 2]]
    return Panel(title, corridor_grid(turn), path, surfaces=Surfaces("w", walls, np.array([(5.0, 0.0, 0.2)])))


def pixels_of(path: Path, colour: tuple[int, int, int]) -> int:
    """How many pixels are of about that colour."""
    image = np.asarray(Image.open(path).convert("RGB")).astype(int)
    return int(np.count_nonzero(np.abs(image - np.array(colour)).max(axis=2) <= 8))


@pytest.mark.parametrize("colour", [(205, 205, 205), (255, 255, 255), (0, 0, 0), GREEN, VERMILLION])
def test_unknown_free_occupied_path_and_truth_are_all_there(tmp_path: Path, colour: tuple[int, int, int]) -> None:
    draw_maps([panel()], tmp_path / "map.png")
    assert pixels_of(tmp_path / "map.png", colour) > 50


@pytest.mark.parametrize("turn", [False, True])
def test_two_long_corridors_lie_level_one_above_the_other(tmp_path: Path, turn: bool) -> None:
    one = draw_maps([panel(turn=turn)], tmp_path / "one.png")
    two = draw_maps([panel("a", turn), panel("b", turn)], tmp_path / "two.png")
    assert one[0] > 2 * one[1]
    assert two[0] == one[0]
    assert two[1] > 1.7 * one[1]


def test_square_maps_stand_side_by_side(tmp_path: Path) -> None:
    cells: Cells = np.full((60, 60), -20, dtype=np.int16)
    square = Panel("square", Grid(0.05, 15, -6).extended(Patch(0, 0, cells)))
    width, height = draw_maps([square, square], tmp_path / "two.png")
    assert width > 1.7 * height


def test_the_path_leads_to_the_right(tmp_path: Path) -> None:
    back = Panel("back", corridor_grid(), np.array([(9.0, 0.0), (1.0, 0.0)]))
    draw_maps([back], tmp_path / "map.png")
    image = np.asarray(Image.open(tmp_path / "map.png").convert("RGB"))[:-40]  # without the legend
    thickness = (image == GREEN).all(axis=2).sum(axis=0)
    assert int(np.argmax(thickness)) < image.shape[1] / 2  # the start's dot


@pytest.mark.parametrize(
    ("panels", "why"), [([], "no map"), ([Panel("empty", Grid(0.05, 15, -6))], "empty: there is nothing to draw")]
)
def test_nothing_to_draw_is_said(tmp_path: Path, panels: list[Panel], why: str) -> None:
    with pytest.raises(CannotDraw, match=why):
        draw_maps(panels, tmp_path / "map.png")


def test_a_picture_is_not_overwritten_unasked(tmp_path: Path) -> None:
    (tmp_path / "map.png").write_bytes(b"mine")
    with pytest.raises(CannotDraw, match="exists and is not overwritten"):
        draw_maps([panel()], tmp_path / "map.png")
    assert (tmp_path / "map.png").read_bytes() == b"mine"
    with pytest.raises(CannotDraw, match="cannot write the picture"):
        draw_maps([panel()], tmp_path / "no folder" / "map.png")


def test_a_single_wall_at_an_angle_is_drawn_level(tmp_path: Path) -> None:
    ends = Pose(1.0, 2.0, 0.5).points(np.array([(0.0, 0.0), (10.0, 0.0)]))
    wall = Surfaces("slant", ends.reshape(1, 4), np.zeros((0, 3)))
    width, height = draw_maps([Panel("slant", Grid(0.05, 15, -6), ends, surfaces=wall)], tmp_path / "map.png")
    assert width > 5 * height


def test_what_changed_is_drawn_in_colours_and_in_patterns(tmp_path: Path) -> None:
    before = panel("before")
    moved = Panel("after", corridor_grid(), np.array([(1.0, 0.0), (9.0, 0.0)]), lay=Pose(1.0, 0.0, 0.0))
    draw_maps([before, replace(moved, title="difference", before=before)], tmp_path / "map.png")
    for change in CHANGES:
        assert pixels_of(tmp_path / "map.png", change.ground) > 20
        assert pixels_of(tmp_path / "map.png", change.mark) > 20
    assert change_pixels(np.array([[0, 4, 8]])).tolist() == [[[205] * 3, [255] * 3, [74, 76, 80]]]


def test_the_four_changes_are_told_apart_without_colour() -> None:
    grey = [np.asarray(Image.fromarray(swatch(change, 16, 16)).convert("L")) for change in CHANGES]
    for k, mine in enumerate(grey):
        for other in grey[k + 1 :]:
            assert np.count_nonzero(np.abs(mine.astype(int) - other) > 60) > 30


def test_a_legend_goes_on_in_a_second_row() -> None:
    signs = [Sign("a sign of some length", (0, 0, 0))] * 5
    assert [len(row) for row in in_rows(signs, 500)] == [2, 2, 1]
    assert in_rows([], 100) == [[]]
