"""Changes that were planted, each with a known answer that the diff must give: that, and nothing else."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from slam import self_calibration
from slam.geometry import Pose
from slam.sweep import Sweep
from sonarlog.diff import Report, diff_runs
from sonarlog.runs import Run
from tests.made_runs import made_run
from tests.synthetic import StraightWall, scan

STATIONS = [Pose(1.0 + 0.7 * k, 1.5, 0.0) for k in range(9)]
ROOM = {
    "west": StraightWall(0.0, 0.0, 0.0, 3.0),
    "east": StraightWall(8.0, 0.0, 8.0, 3.0),
    "south": StraightWall(0.0, 0.0, 8.0, 0.0),
    "north left": StraightWall(0.0, 2.6, 4.2, 2.6),
    "north right": StraightWall(4.2, 3.0, 8.0, 3.0),
}

NONE: Mapping[str, object] = MappingProxyType({})


def seen(
    walls: dict[str, StraightWall], odometry: Sequence[Pose] = STATIONS, stations: Sequence[Pose] = STATIONS
) -> list[Sweep]:
    """What a robot sees on its way through the room, with that odometry."""
    scans = [scan(list(walls.values()), true, raw) for true, raw in zip(stations, odometry, strict=True)]
    return [replace(sweep, t_ns=sweep.t_ns + 40_000_000_000 * k) for k, sweep in enumerate(scans)]


@pytest.fixture(scope="module")
def sweeps() -> list[Sweep]:
    return seen(ROOM)


@pytest.fixture(scope="module")
def before(sweeps: list[Sweep], tmp_path_factory: pytest.TempPathFactory) -> Run:
    return made(tmp_path_factory.mktemp("before") / "a.run.mcap", sweeps)


def made(
    path: Path, sweeps: list[Sweep], changes: Mapping[str, object] = NONE, recording: str = "one recording"
) -> Run:
    """A run without truth."""
    return made_run(path, "paper", sweeps, changes, recording=recording, truth=False, stations=STATIONS)


def slipped(at: int, aside_m: float, stations: Sequence[Pose] = STATIONS) -> list[Pose]:
    """Odometry that takes a step to the side before one station, which the robot did not."""
    return [replace(pose, y=pose.y + aside_m * (k >= at)) for k, pose in enumerate(stations)]


def reports(a: Run, b: Run) -> tuple[Report, Report]:
    """The difference there and back."""
    return diff_runs(a, b), diff_runs(b, a)


def kinds(report: Report) -> dict[str, int]:
    """How many walls changed in which way."""
    counts: dict[str, int] = {}
    for change in report.changed_walls:
        for kind in change.kinds:
            counts[kind] = counts.get(kind, 0) + 1
    return counts


def mirror(there: Report, back: Report) -> None:
    """Both say the same the other way round."""
    assert there.names == back.names[::-1]
    assert there.cells.mirrored() == back.cells
    assert there.aligned_cells.mirrored() == back.aligned_cells
    assert there.alignment.turned_deg == pytest.approx(-back.alignment.turned_deg)
    assert there.alignment.shifted_m == pytest.approx(back.alignment.shifted_m, abs=1e-9)
    mirrored = {(c.kinds, c.a, c.b): c for c in (change.mirrored() for change in there.walls)}
    assert set(mirrored) == {(c.kinds, c.a, c.b) for c in back.walls}
    for change in back.walls:
        assert mirrored[change.kinds, change.a, change.b].moved_m == pytest.approx(change.moved_m)
    assert there.rooms.free_m2 == back.rooms.free_m2[::-1]
    assert there.settings == {name: pair[::-1] for name, pair in back.settings.items()}
    if there.first is not None:
        assert back.first is not None
        assert (there.first.sweep, there.first.block) == (back.first.sweep, back.first.block)
        assert there.first.decisions == back.first.decisions[::-1] or not there.first.decisions[1]


@pytest.mark.parametrize(
    ("start", "words"),
    [(Pose(0.05, -0.12, np.radians(0.6)), "turned by +0.6° and shifted by 10 cm"),
     (Pose(1.5, 2.0, np.radians(25.0)), "turned by +25.0° and shifted by 341 cm")],
)  # fmt: skip
def test_a_shifted_map_is_one_sentence_and_no_wall(
    start: Pose, words: str, before: Run, sweeps: list[Sweep], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(self_calibration, "ORIGIN", start.quantised())
    report, back = reports(before, made(tmp_path / "b.run.mcap", sweeps))
    assert report.first is not None
    assert (report.first.sweep, report.first.block) == (0, "B")
    assert report.first.decisions[0] == "predicts (0.00, 0.00) m, 0.0°"
    assert report.alignment.turned_deg == pytest.approx(np.degrees(start.theta), abs=0.02)
    # Where the middle of A's path, 2.8 m on, went.
    x, y = start.points(np.array([[2.8, 0.0]]))[0]
    assert report.alignment.shift_m == pytest.approx((x - 2.8, y), abs=0.01)
    assert kinds(report) == {}
    assert report.path.aligned_largest_m < 0.02 < report.path.largest_m
    assert f"B's map is {words}; without that, the paths are" in report.headline
    assert f"all {len(report.walls)} walls are the same" in report.headline
    assert report.aligned_cells.changed < report.cells.changed
    mirror(report, back)


MOVES = [("south", (0.0, -0.07)), ("north right", (0.0, 0.07)), ("east", (0.07, 0.0))]


@pytest.mark.parametrize(("name", "off"), MOVES)
def test_a_wall_moved_by_7_cm_is_said_so_and_no_other(
    name: str, off: tuple[float, float], before: Run, tmp_path: Path
) -> None:
    wall, (dx, dy) = ROOM[name], off
    moved = StraightWall(wall.x0 + dx, wall.y0 + dy, wall.x1 + dx, wall.y1 + dy)
    report, back = reports(before, made(tmp_path / "b.run.mcap", seen({**ROOM, name: moved}), recording="edited"))
    assert report.alignment.none
    assert kinds(report) == {"moved": 1}
    (change,) = report.changed_walls
    assert change.moved_m == pytest.approx(0.07, abs=0.01)
    assert change.wall.name.startswith(name.split(maxsplit=1)[0])
    assert "moved by 7 cm away from the robot" in report.headline
    mirror(report, back)


def test_a_wall_removed_is_gone(before: Run, tmp_path: Path) -> None:
    fewer = seen({name: wall for name, wall in ROOM.items() if name != "east"})
    report, back = reports(before, made(tmp_path / "b.run.mcap", fewer, recording="edited"))
    assert kinds(report) == {"gone": 1}
    assert report.changed_walls[0].wall.name.startswith("east wall")
    assert kinds(back) == {"appeared": 1}
    assert "is gone" in report.headline
    mirror(report, back)


def test_a_wall_that_is_drawn_twice_is_doubled(tmp_path: Path) -> None:
    there_and_back = [*STATIONS[:5], *STATIONS[3::-1]]
    sweeps = seen(ROOM, slipped(5, 0.12, there_and_back), there_and_back)
    a, b = (made(tmp_path / f"{d1}.run.mcap", sweeps, {"association.d1_m": d1}) for d1 in (0.2, 0.05))
    report, back = reports(a, b)
    assert report.first is not None
    assert (report.first.sweep, report.first.block) == (5, "E")
    assert kinds(report) == {"doubled": 2}
    assert "is doubled" in report.headline
    assert kinds(back) == {"single": 2}
    mirror(report, back)


@pytest.mark.parametrize("at", [3, 6])
def test_a_lower_threshold_is_named_as_association_where_it_first_bites(at: int, tmp_path: Path) -> None:
    sweeps = seen(ROOM, slipped(at, 0.10))
    a, b = (made(tmp_path / f"{d1}.run.mcap", sweeps, {"association.d1_m": d1}) for d1 in (0.2, 0.05))
    report = diff_runs(a, b)
    assert report.first is not None
    assert (report.first.sweep, report.first.block) == (at, "E")
    assert "joins chain" in report.first.decisions[0]
    assert "starts chain" in report.first.decisions[1]
    assert report.headline.startswith(f"Same until sweep {at}; there feature association (block E) differs (A: wall ")
    assert report.settings == {"association.d1_m": (0.2, 0.05)}


def test_a_changed_weight_is_map_extension_and_the_path_is_untouched(
    before: Run, sweeps: list[Sweep], tmp_path: Path
) -> None:
    report, back = reports(before, made(tmp_path / "b.run.mcap", sweeps, {"map.wall": 3}))
    assert report.first is not None
    assert (report.first.sweep, report.first.block) == (0, "H")
    assert report.alignment.none
    assert report.path.largest_m == 0
    assert kinds(report) == {}
    assert report.cells.changed > 0
    mirror(report, back)


def test_a_reading_dropped_from_the_recording_is_sensing(before: Run, sweeps: list[Sweep], tmp_path: Path) -> None:
    kept = np.arange(len(sweeps[4])) != 7
    names = ("t_ns", "sonar", "range_mm", "x_um", "y_um", "heading")
    arrays = {name: getattr(sweeps[4], name)[kept] for name in names}
    fewer = [*sweeps[:4], replace(sweeps[4], reference=sweeps[4].reference - 1, **arrays), *sweeps[5:]]
    report, back = reports(before, made(tmp_path / "b.run.mcap", fewer, recording="edited"))
    assert report.first is not None
    assert (report.first.sweep, report.first.block, report.first.name) == (4, "A", "sensing")
    assert "alone that of sonar 7 at" in report.first.decisions[0]
    assert list(report.settings) == ["recording"]
    assert kinds(report) == {}
    mirror(report, back)
