"""Block H: what is drawn, what is left undrawn, and that a map drawn anew is the map drawn from there at once."""

from dataclasses import replace

import numpy as np
import pytest

from slam import pipeline
from slam.algorithms import algorithm
from slam.association import OPEN, POINT, WALL, Chains, Member
from slam.disc import BINS, RAYS, depths, disc_around
from slam.dmath import DEGREE, sincos
from slam.evidence import Evidence, Layer, cropped, patch_between
from slam.geometry import ORIGIN, Pose, Segment, through
from slam.grid import LIMIT, Grid
from slam.links import EndConfig, Spots, chain_gaps, end_gaps, ended_by, heard_through
from slam.map_extension import Map, Painted, _Drawing, extend_map
from slam.pieces import Pieces
from slam.pipeline import Step
from slam.reach import Witnesses, trimmed
from slam.seams import SeamConfig, seams
from slam.shapes import clipped, cut
from slam.silence import DIRECTIONS
from tests.synthetic import RING, StraightWall, corridor, scan

PAPER = algorithm("paper")
CONFIG = PAPER.config.map
EMPTY = Grid(CONFIG.cell_m, CONFIG.occupied_from, CONFIG.free_from)
STATIONS = [Pose(0.8 * k, 0.0, 0.0) for k in range(5)]
AWAY = Pose(0.3, 1.2, 7.0 * DEGREE)
"""Where a loop that closes may move everything to."""


def line(x0: float, y0: float, x1: float, y1: float) -> Segment:
    return through((x0, y0), (x1, y1), (0.0, 0.0))


def pieces(*members: Member) -> Pieces:
    return Pieces.none().renewed((), members)


def spot(x: float, y: float, bearing_deg: float) -> Spots:
    sine, cosine = sincos(bearing_deg * DEGREE)
    return Spots(np.array([[x, y]]), np.array([[cosine, sine]]), np.array([0]))


@pytest.fixture(scope="module")
def steps() -> list[Step]:
    return list(pipeline.run([scan(corridor(), pose) for pose in STATIONS], RING, PAPER))


def moved(steps: list[Step], by: Pose, upto: int) -> tuple[Chains, tuple[Pose, ...]]:
    chains, poses = steps[upto].state.chains, steps[upto].state.poses
    members = tuple(replace(member, segment=member.segment.moved(by)) for member in chains.members)
    return replace(chains, members=members), tuple(by.compose(pose) for pose in poses)


def drawn(steps: list[Step], by: list[Pose]) -> Map:
    grown = Map(EMPTY)
    for k, step in enumerate(steps):
        chains, poses = moved(steps, by[k], k)
        before = grown
        grown, patch = extend_map(before, step.calibrated, step.reliability, step.features, chains, poses, CONFIG)
        added = before.grid.extended(patch)
        assert all(np.array_equal(tile, added.tiles[place]) for place, tile in grown.grid.tiles.items())
    return grown


def doorway() -> list[StraightWall]:
    """A corridor with a doorway in one of its walls, 1 m wide."""
    far = 40.0
    return [*corridor(length=far)[1:], StraightWall(-far, 1.0, 1.1, 1.0), StraightWall(2.1, 1.0, far, 1.0)]


def test_a_doorway_seen_last_stays_open_in_a_map_that_is_drawn_anew() -> None:
    before_it_last = [STATIONS[k] for k in (0, 1, 3, 2, 4)]
    steps = list(pipeline.run([scan(doorway(), pose) for pose in before_it_last], RING, PAPER))
    for last in (ORIGIN, AWAY):
        late, back = drawn(steps, [*[ORIGIN] * 4, last]), last.step_to(ORIGIN)
        middles = [back.compose(Pose((a[0] + a[2]) / 2, (a[1] + a[3]) / 2, 0.0)) for p in late.painted for a in p.gaps]
        assert middles
        assert not [middle for middle in middles if 1.3 < middle.x < 1.9 and middle.y > 0.8]


def test_a_doorway_that_was_driven_through_once_is_open_from_jamb_to_jamb() -> None:
    """From 2 m both jambs are heard half a metre into it. The robot goes through 15 cm beside one of them."""
    far = 40.0
    walls = [StraightWall(-far, 2.0, 1.1, 2.0), StraightWall(2.1, 2.0, far, 2.0), StraightWall(-far, -0.6, far, -0.6)]
    places = [Pose(x, y, 0.0) for x, y in ((0.4, 0.0), (1.0, 0.0), (1.25, 1.3), (1.25, 2.7), (1.25, 1.3), (2.2, 0.0))]
    steps = list(pipeline.run([scan(walls, pose) for pose in places], RING, PAPER))
    filled = [gap for sweep in steps[-1].state.map.painted for gap in sweep.gaps.tolist()]
    assert not [
        gap for gap in filled if abs(gap[1] - 2.0) < 0.1 and max(gap[0], gap[2]) > 1.2 and min(gap[0], gap[2]) < 2.0
    ]


def test_what_one_sweep_stirs_is_drawn_with_all_others_on_the_map() -> None:
    """Those that fill a gap and those that refute it may be stirred together; one without the other would fill it."""
    steps = list(pipeline.run([scan(doorway(), STATIONS[k]) for k in (0, 1, 3, 2, 4)], RING, PAPER))
    late = drawn(steps, [ORIGIN] * 5)
    chains, poses = moved(steps, ORIGIN, 4)
    drawing = _Drawing(late, poses, chains.members, CONFIG)
    shown: list[int] = []
    paint = drawing._paint

    def counted(k: int) -> Painted:
        shown.append(int(drawing._shown.sum()))
        return paint(k)

    drawing._paint = counted  # type: ignore[method-assign]
    drawing._stirred = lambda newest: [k for k in range(5) if k != newest]  # type: ignore[method-assign]
    drawing.renew([4])
    assert shown == [4] * 5


def test_a_map_drawn_anew_is_the_one_drawn_there_at_once(steps: list[Step]) -> None:
    late = drawn(steps, [*[ORIGIN] * 4, AWAY])
    at_once = drawn(steps, [AWAY] * 5)
    cells, left, bottom = late.grid.dense()
    assert np.array_equal(cells, at_once.grid.window(left, bottom, cells.shape[1], cells.shape[0]))
    assert bool(late.grid.occupied(cells).any())


def test_what_moves_less_than_is_seen_is_not_drawn_again(steps: list[Step]) -> None:
    here = drawn(steps, [ORIGIN] * 5)
    nudged = drawn(steps, [*[ORIGIN] * 4, Pose(0.4 * CONFIG.repaint_m, 0.0, 0.0)])
    assert all(a.layer.delta is not None and np.array_equal(a.layer.delta, b.layer.delta)
               for a, b in zip(here.painted[:4], nudged.painted[:4], strict=True))  # fmt: skip


def test_a_wall_that_turns_out_to_be_a_point_is_drawn_as_one(steps: list[Step]) -> None:
    chains, poses = moved(steps, ORIGIN, 1)
    first = drawn(steps[:1], [ORIGIN])
    pointed = replace(chains, members=tuple(replace(member, nature=POINT) for member in chains.members))
    step = steps[1]
    after, _ = extend_map(first, step.calibrated, step.reliability, step.features, pointed, poses, CONFIG)
    assert len(first.painted[0].walls) == len(first.painted[0].strokes) > 0
    assert len(after.painted[0].walls) == len(after.painted[0].strokes) == 0


def test_between_the_walls_it_is_free_and_behind_them_unknown(steps: list[Step]) -> None:
    grid = steps[-1].state.grid
    column = grid.window(int(0.8 / CONFIG.cell_m), int(-2.0 / CONFIG.cell_m), 1, 80)[:, 0]
    occupied = np.flatnonzero(grid.occupied(column)) * CONFIG.cell_m - 2.0
    assert np.abs(np.abs(occupied) - 1.0).max() <= 0.1
    inside = column[int(1.2 / CONFIG.cell_m) : int(2.8 / CONFIG.cell_m)]
    assert bool(grid.free(inside).all())
    assert not grid.free(column[: int(0.9 / CONFIG.cell_m)]).any()


def test_a_plain_cone_frees_what_lies_behind_the_edges_of_a_wall() -> None:
    wall = [StraightWall(1.5, -0.2, 1.5, 0.2)]
    plain = PAPER.configured({"map.plain_cone": True})
    ours, theirs = (list(pipeline.run([scan(wall, ORIGIN)], RING, which))[-1].state.grid for which in (PAPER, plain))
    occupied = [int(np.count_nonzero(grid.occupied(grid.dense()[0]))) for grid in (ours, theirs)]
    assert 0 < occupied[0] < occupied[1]


def test_evidence_taken_back_leaves_nothing() -> None:
    wall = Layer(60, -3, np.full((8, 9), 100, dtype=np.int8))
    twice, places = Evidence().changed([], [wall, wall])
    grid = twice.shown(EMPTY, places)
    patch = patch_between(EMPTY, grid, places)
    assert int(patch.delta.max()) == LIMIT
    assert (patch.left, patch.bottom, patch.delta.shape) == (60, -3, (8, 9))
    once, places = twice.changed([wall], [])
    back = once.shown(grid, places)
    assert int(patch_between(grid, back, places).delta.min()) == 100 - LIMIT
    none, places = twice.changed([wall, wall], [])
    gone = none.shown(grid, places)
    assert not any(tile.any() for tile in gone.tiles.values())
    assert back.window(60, -3, 9, 8).max() == 100
    assert patch_between(grid, grid, places).delta.tolist() == [[0]]


def test_a_layer_has_no_empty_borders() -> None:
    delta = np.zeros((5, 7), dtype=np.int16)
    delta[2, 3:5] = -9
    layer = cropped(10, 20, delta)
    assert (layer.left, layer.bottom, layer.delta.tolist()) == (13, 22, [[-9, -9]])


def test_depths_are_where_rays_meet_segments() -> None:
    far = depths(np.array([[2.0, 1.0, 2.0, -1.0], [-1.0, -3.0, -1.0, -2.0]]), 1.0, 0.0)
    sine, cosine = RAYS
    ahead = (np.abs(sine) <= cosine) & (cosine > 0.0)
    np.testing.assert_allclose(far[0], np.where(ahead, 1.0 / cosine, 0.0))
    assert not (far[1] > 0.0)[ahead].any()
    assert far[1].max() == pytest.approx(13.0**0.5, abs=0.02)


def test_a_disc_tells_direction_and_distance_of_its_cells() -> None:
    disc = disc_around(1.01, -1.99, np.array([[2.6, -2.0]]), 0.05)
    row, column = int(-2.0 / 0.05) - disc.bottom, int(2.0 / 0.05) - disc.left
    assert disc.ranges[row, column] == pytest.approx(1.0)
    assert abs(int(disc.bins[row, column]) - BINS // 2) <= 1
    assert disc.left * 0.05 <= 1.01 - 0.4
    assert (disc.left + disc.bins.shape[1]) * 0.05 >= 2.6


def test_gaps_of_a_chain_are_those_to_its_nearest_neighbours() -> None:
    chain = pieces(*(Member(0, k, line(x, 1.0, x + 0.4, 1.0), WALL) for k, x in enumerate((0.0, 0.9, 2.0))))
    newest = Member(0, 3, line(1.5, 1.0, 1.7, 1.0), WALL)
    found = chain_gaps(pieces(newest), chain, 1.2, 40)
    length = np.abs(found.ends[:, 0] - found.ends[:, 2]).round(3)
    assert sorted(length.tolist()) == [0.2, 0.3]
    assert len(chain_gaps(pieces(replace(newest, chain=1)), chain, 1.2, 40).ends) == 0


@pytest.mark.parametrize(
    ("end", "ends"),
    [
        (spot(2.0, 1.02, 40.0), True),
        (spot(2.0, 1.15, 40.0), False),  # beside the line
        (spot(4.2, 1.0, 40.0), False),  # too far
        (spot(2.0, 1.0, 88.0), False),  # a piece of the wall itself
        (spot(0.5, 1.0, 40.0), False),  # before the wall, not at its end
    ],
)
def test_a_wall_goes_on_to_the_corner_in_line_with_it(end: Spots, ends: bool) -> None:
    wall = pieces(Member(0, 0, line(0.0, 1.0, 1.0, 1.0), WALL))
    found = end_gaps(wall, end, 0, EndConfig(), 40)
    assert found.ends.tolist() == [[1.0, 1.0, *end.point[0].tolist()]] * ends


def test_a_corner_ends_the_last_piece_of_a_wall_only() -> None:
    walls = pieces(Member(0, 0, line(0.0, 1.0, 0.5, 1.0), WALL), Member(0, 0, line(0.6, 1.0, 1.0, 1.0), WALL))
    found = end_gaps(walls, spot(1.5, 1.0, 40.0), 0, EndConfig(), 40)
    assert found.ends[:, :2].tolist() == [[1.0, 1.0]]


def test_walls_are_drawn_as_far_as_the_walls_that_cross_them() -> None:
    both = pieces(Member(0, 0, line(-1.0, 1.0, 1.0, 1.0)), Member(1, 0, line(0.6, -1.0, 0.6, 2.0)))
    foot, ends, number = np.array([[0.0, 1.0]]), np.array([[-1.0, 1.0, 1.0, 1.0]]), np.array([0])
    np.testing.assert_allclose(clipped(foot, ends, number, both, np.array([0, 1])), [[-1.0, 1.0, 0.6, 1.0]])
    crossing = np.array([[0.6, 0.5, 0.6, 2.0], [-0.5, 3.0, -0.5, 4.0]])
    np.testing.assert_allclose(cut(foot, ends, crossing), [[-1.0, 1.0, 0.6, 1.0]])


def test_a_nature_told_by_one_member_holds_for_its_chain_when_it_was_seen_often_enough() -> None:
    wall, other = line(0, 1, 1, 1), line(0, 2, 1, 2)
    members = (
        Member(0, 0, wall), Member(1, 0, other), Member(0, 1, wall, WALL), Member(0, 2, wall), Member(0, 3, wall)
    )  # fmt: skip
    before = Pieces.none().renewed((), members[:4])
    assert before.nature.tolist() == [OPEN] * 4
    after = before.renewed(members[:4], members)
    assert after.nature.tolist() == [WALL, OPEN, WALL, WALL, WALL]
    assert after.of_sweep(0) == slice(0, 2)
    assert after.of_sweeps(np.array([1])).tolist() == [2]


@pytest.mark.parametrize(
    ("path", "heard"),
    [
        ((0.5, 0.0, 0.5, 2.0), True),
        ((0.5, 0.0, 0.5, 1.1), False),  # what answered may be the wall in the gap itself
        ((0.05, 0.0, 0.05, 2.0), False),  # by its end
        ((-1.0, 0.9, 2.0, 1.1), False),  # along it
        ((1.5, 0.0, 1.5, 2.0), False),
    ],
)
def test_where_a_wall_was_heard_through_a_gap_there_is_none(
    path: tuple[float, float, float, float], heard: bool
) -> None:
    gap = np.array([[0.0, 1.0, 1.0, 1.0]])
    assert heard_through(gap, np.array([path])).tolist() == [heard]


def test_a_corner_in_a_gap_ends_the_wall_there() -> None:
    gap, config = np.array([[0.0, 1.0, 2.0, 1.0]]), EndConfig()
    before = np.array([[1.0, 0.0]])
    for bearing_deg, place, ended in ((40.0, 1.0, True), (90.0, 1.0, False), (40.0, 1.95, False), (-40.0, 1.0, False)):
        sine, cosine = sincos(bearing_deg * DEGREE)
        assert ended_by(gap, before, np.array([[place, 1.03, cosine, sine]]), config).tolist() == [ended]


@pytest.mark.parametrize(
    ("others", "known", "found"),
    [
        ([(1.0, 1.02, 90.0)], [False, False], True),  # both answered square on, in line
        ([(1.0, 1.02, 90.0)], [True, True], False),  # two walls: their chain's business
        ([(1.0, 1.2, 90.0)], [False, False], False),
        ([(1.0, 1.0, 70.0)], [False, False], False),
        ([(1.5, 1.0, 90.0)], [False, False], False),
        ([(1.0, 1.0, 90.0), (1.05, 1.0, 130.0)], [False] * 3, False),  # a pole: heard from aside too
    ],
)
def test_what_answers_square_on_and_in_line_is_one_wall(
    others: list[tuple[float, float, float]], known: list[bool], *, found: bool
) -> None:
    all_ = [spot(0.0, 1.0, 90.0), *(spot(*each) for each in others)]
    point, normal = (np.concatenate([getattr(each, name) for each in all_]) for name in ("point", "normal"))
    spots = Spots(point, normal, np.array([1] + [0] * len(others)))
    gaps = seams(spots, np.array(known), 1, SeamConfig(), 25)
    assert gaps.ends.tolist() == ([[0.0, 1.0, *others[0][:2]]] if found else [])


NOBODY = Witnesses(np.zeros((0, 3)), np.zeros((0, DIRECTIONS)), *(np.zeros((0, 4)) for _ in range(3)))
AFAR = np.full((1, DIRECTIONS), 3.0)


@pytest.mark.parametrize(
    ("against", "end"),
    [
        (NOBODY, 1.0),
        (replace(NOBODY, spots=np.array([[0.6, 1.03, 0.9, 0.4]])), 0.6),  # heard from aside: an edge
        (replace(NOBODY, spots=np.array([[0.6, 1.03, 0.1, 1.0]])), 1.0),  # the wall itself
        (replace(NOBODY, spots=np.array([[-0.02, 1.0, 0.9, 0.4]])), 0.1),  # a jamb: on which side nobody knows
        (replace(NOBODY, spots=np.array([[-0.05, 1.0, 0.9, 0.4]])), 1.0),  # on the other side
        (replace(NOBODY, ways=np.array([[0.7, 0.0, 0.7, 2.0]])), 0.5),  # as wide as a robot,
        (replace(NOBODY, ways=np.array([[0.05, 0.0, 0.05, 2.0]])), 1.0),  # it answered there
        (replace(NOBODY, ways=np.array([[-0.4, 0.0, -0.4, 2.0]])), 1.0),  # on the other side
        (replace(NOBODY, stations=np.array([[0.8, 0.0, 0.0]]), profiles=AFAR), 0.6),
        (replace(NOBODY, stations=np.array([[0.8, 0.0, 0.0]]), profiles=AFAR / 4.0), 1.0),
        (replace(NOBODY, stations=np.array([[0.8, 0.0, 0.0]]), profiles=AFAR,
                 strokes=np.array([[0.0, 0.5, 2.0, 0.5]])), 1.0),
    ],
)  # fmt: skip
def test_a_wall_reaches_to_what_speaks_against_it(against: Witnesses, end: float) -> None:
    foot, ends = np.array([[0.0, 1.0]]), np.array([[-0.3, 1.0, 1.0, 1.0]])
    np.testing.assert_allclose(trimmed(foot, ends, against, EndConfig())[:, 2:], [[end, 1.0]], atol=1e-9)


def test_a_short_wall_goes_on_less_far() -> None:
    far = spot(3.6, 1.0, 40.0)
    for length, found in ((0.5, 0), (1.5, 1)):
        wall = pieces(Member(0, 0, line(1.5 - length, 1.0, 1.5, 1.0), WALL))
        assert len(end_gaps(wall, far, 0, EndConfig(), 40).ends) == found
