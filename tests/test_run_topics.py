"""What a run shows: wholes now and then and updates in between give the same as a whole every time."""

from itertools import accumulate
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.grid import TILE, Grid, Patch
from sonarlog import ros2
from sonarlog.cdr import decode
from sonarlog.mcap_file import McapReader
from sonarlog.ros2_maps import OccupancyGridUpdate
from sonarlog.ros2_markers import MarkerArray
from sonarlog.run_map import MapMessages
from sonarlog.runs import read_run

HEADER = ros2.Header(ros2.Time(), "map")
Shown = tuple[tuple[int, int], "np.ndarray[tuple[int, int], np.dtype[np.int8]]"]


def shown_by(before: Shown | None, message: object) -> Shown:
    """A viewer: the place of the first cell, and the cells."""
    if isinstance(message, ros2.OccupancyGrid):
        corner = message.info.origin.position
        place = round(corner.x / message.info.resolution), round(corner.y / message.info.resolution)
        return place, np.frombuffer(message.data, "i1").reshape(message.info.height, message.info.width).copy()
    assert isinstance(message, OccupancyGridUpdate)
    assert before is not None
    cells = before[1]
    window = cells[message.y : message.y + message.height, message.x : message.x + message.width]
    window[:] = np.frombuffer(message.data, "i1").reshape(message.height, message.width)
    return before


def known(shown: Shown) -> dict[tuple[int, int], int]:
    rows, columns = np.nonzero(shown[1] != -1)
    places = zip(rows.tolist(), columns.tolist(), shown[1][rows, columns].tolist(), strict=True)
    return {(c + shown[0][0], r + shown[0][1]): value for r, c, value in places}


CORNERS = st.integers(-6 * TILE, 6 * TILE)
PATCHES = st.builds(
    lambda left, bottom, size, value: Patch(left, bottom, np.full((size, size), value, np.int16)),
    CORNERS, CORNERS, st.integers(1, 2 * TILE), st.sampled_from([-20, 0, 30]),
)  # fmt: skip


@settings(max_examples=40, deadline=None)
@given(st.lists(PATCHES, max_size=12))
def test_a_viewer_that_follows_the_updates_sees_the_map(patches: list[Patch]) -> None:
    follower, other = MapMessages(), MapMessages()
    viewer: Shown | None = None
    for grid in accumulate(patches, Grid.extended, initial=Grid(0.05, 15, -6)):
        for _, message in follower.after(grid, HEADER):
            viewer = shown_by(viewer, message)
        expected = known(shown_by(None, other.whole(grid, HEADER)))
        assert (known(viewer) if viewer else {}) == expected


def test_wholes_become_rare_and_the_last_ones_are_complete(short_run: Path) -> None:
    run = read_run(short_run)
    messages = list(McapReader(short_run).stream())
    last = {message.topic: message.data for message in messages}
    assert len(decode(ros2.Path, last["/path"]).poses) == len(run.sweeps)
    ends = [len(marker.points) for marker in decode(MarkerArray, last["/walls"]).markers]
    assert sum(ends) == 2 * len(run.chains.members)
    assert decode(ros2.PointCloud2, last["/walls/points"]).width == 9 * len(run.chains.members)
    cells, left, bottom = run.grid.dense()
    shown = shown_by(None, decode(ros2.OccupancyGrid, last["/map"]))
    assert shown[0] == (left, bottom)
    assert np.array_equal(shown[1] == -1, cells == 0)
    new = [decode(MarkerArray, message.data).markers for message in messages if message.topic == "/walls/new"]
    assert sum(len(marker.points) for markers in new for marker in markers) == 2 * len(run.chains.members)


def test_a_map_that_is_large_already_is_not_written_whole_for_a_little_more() -> None:
    messages, grid = MapMessages(), Grid(0.05, 15, -6)
    topics = []
    for k in range(60):
        grid = grid.extended(Patch(k * TILE, 0, np.full((TILE, TILE), 20, np.int16)))
        topics += [topic for topic, _ in messages.after(grid, HEADER)]
    assert topics.count("/map") < 20
    assert topics[-1] == "/map_updates"
