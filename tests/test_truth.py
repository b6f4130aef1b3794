"""True poses by time, TUM files and maps of map_server."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from PIL import Image

from slam.geometry import Pose
from sonarlog.exports.tum import tum_lines
from sonarlog.log import Truth
from sonarlog.true_map import BadTrueMap, TrueMap, read_true_map
from sonarlog.truth import BadTum, poses_at, read_tum

S = 1_000_000_000


def test_a_moment_between_two_true_poses_lies_on_the_line_between_them_the_short_way_round() -> None:
    truth = Truth(np.array([0, S]), np.array([(0.0, 0.0, 3.0), (1.0, 2.0, -3.0)]))
    poses, known = poses_at(truth, np.array([0, S // 4, S]))
    assert known.all()
    turned = 3.0 + (2 * np.pi - 6.0) / 4
    assert poses == pytest.approx(np.array([(0.0, 0.0, 3.0), (0.25, 0.5, turned), (1.0, 2.0, -3.0)]), abs=1e-12)


@pytest.mark.parametrize(
    ("at_s", "known", "x"),
    [(-0.5, False, 0), (-0.01, True, 1), (0.5, True, 1.5), (1.01, True, 2), (2.5, False, 0), (4.02, True, 3)],
)
def test_what_is_known_between_in_a_gap_and_outside(at_s: float, known: bool, x: float) -> None:
    truth = Truth(np.array([0, S, 4 * S]), np.array([(1.0, 0, 0), (2.0, 0, 0), (3.0, 0, 0)]))
    poses, found = poses_at(truth, np.array([round(at_s * S)]))
    assert (bool(found[0]), poses[0, 0]) == (known, pytest.approx(x))


places = arrays.arrays(np.float64, (5, 3), elements=st.floats(-3, 3))


@settings(deadline=None, max_examples=50)
@given(st.lists(st.integers(0, 2**60), min_size=5, max_size=5, unique=True), places)
def test_tum_lines_read_back(tmp_path_factory: pytest.TempPathFactory, times: list[int], poses: np.ndarray) -> None:
    path = tmp_path_factory.getbasetemp() / "back.tum"
    path.write_text("# a comment\n\n" + "\n".join(tum_lines(np.array(sorted(times)), poses)), encoding="utf-8")
    back = read_tum(path)
    assert back.t_ns.tolist() == sorted(times)
    assert back.pose == pytest.approx(poses, abs=2e-6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "holds no pose"),
        ("1 2 3\n", r":1: 3 words where 8 belong; a TUM line is"),
        ("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 one\n", ":2: .* are no numbers"),
        ("nan 0 0 0 0 0 0 1", "are no numbers"),
        ("0 inf 0 0 0 0 0 1", "out of all bounds"),
        ("0 0 0 0 0 0 0 0", "no unit quaternion"),
    ],
)
def test_what_is_no_tum_file_is_refused_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bad.tum"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadTum, match=said):
        read_tum(path)


def square_room() -> TrueMap:
    """5 × 5 cells of 1 m, origin at (−2.5, −2.5): walls all round, free inside, a corner unknown."""
    occupied = np.ones((5, 5), dtype=bool)
    occupied[1:4, 1:4] = False
    free = ~occupied
    free[1, 1] = False
    return TrueMap(1.0, Pose(-2.5, -2.5, 0.0), occupied, free)


def test_a_true_map_says_how_far_surfaces_are_what_is_seen_and_what_is_free() -> None:
    room, middle = square_room(), np.array([(0.0, 0.0)])
    assert room.distance(np.array([(0.0, 0.0), (2.0, 0.4), (1.5, 0.0)])) == pytest.approx([2.0, 0.4, 0.5])
    assert len(room.in_sight(middle)) == 12  # but for the corners, which have no side to the room
    free = room.is_free(np.array([(0.0, 0.0), (-1.0, -1.0), (2.0, 0.0), (9.0, 0.0)]), middle, 0.05)
    assert free.tolist() == [True, False]  # a wall's own cell and what the map does not show are not judged


def test_a_pillar_hides_the_wall_behind_it_and_a_turned_map_is_the_same_map() -> None:
    room = square_room()
    occupied = room.occupied.copy()
    occupied[2, 2] = True
    station = np.array([(-1.0, 0.0)])
    turned = TrueMap(1.0, Pose(2.5, -2.5, np.pi / 2), occupied, room.free)
    seen = TrueMap(1.0, room.origin, occupied, room.free).in_sight(station)
    assert (2.0, 0.0) not in {tuple(point) for point in np.round(seen, 6)}
    quarter = Pose(0.0, 0.0, np.pi / 2)
    assert len(turned.in_sight(quarter.points(station))) == len(seen)


@pytest.mark.parametrize("suffix", ["pgm", "png"])
@pytest.mark.parametrize("negate", [0, 1])
def test_a_sheet_and_its_image_are_read_as_map_server_reads_them(tmp_path: Path, suffix: str, negate: int) -> None:
    grey = np.array([[0, 254, 205], [254, 254, 100]], dtype=np.uint8)
    Image.fromarray(255 - grey if negate else grey).save(tmp_path / f"m.{suffix}")
    sheet = tmp_path / "m.yaml"
    sheet.write_text(
        f"image: m.{suffix}\nresolution: 0.05\norigin:\n- -1.0\n- 2.0\n- 0.0\nnegate: {negate}\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )
    read = read_true_map(sheet)
    assert (read.cell_m, read.origin) == (0.05, Pose(-1.0, 2.0, 0.0))
    assert read.occupied.tolist() == [[False, False, False], [True, False, False]]  # the lowest row first
    assert read.free.tolist() == [[True, True, False], [False, True, False]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("image: gone.pgm\nresolution: 0.05", "cannot read the image .*gone.pgm, which .*m.yaml names: No such file"),
        ("image: m.yaml\nresolution: 0.05", "m.yaml, which .* names, is no image"),
        ("resolution: 0.05", "names no image"),
        ("image: white.png", "resolution: a number is needed, not None"),
        ("image: white.png\nresolution: -1", "no size of a cell"),
        ("image: white.png\nresolution: 0.05\norigin: [0, 0]", r"origin: \[x, y, yaw\] is needed"),
        ("image: white.png\nresolution: 0.05", "no cell of its image is occupied"),
        ("a: b: c", "is no YAML"),
    ],
)
def test_what_is_no_map_is_refused(tmp_path: Path, text: str, said: str) -> None:
    Image.fromarray(np.full((2, 2), 254, dtype=np.uint8)).save(tmp_path / "white.png")
    sheet = tmp_path / "m.yaml"
    sheet.write_text(text, encoding="utf-8")
    with pytest.raises(BadTrueMap, match=said):
        read_true_map(sheet)
