"""What differs between two runs, all levels of it: the report that the command line, pages and viewers show.

Swapping the sides gives the mirrored report. Must not know: files' formats, printing, drawing.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from slam.geometry import ORIGIN
from sonarlog.diff.alignment import Alignment, align
from sonarlog.diff.calibration import CalibrationChange, calibration_changes
from sonarlog.diff.cells import CellChanges, Window, cell_changes, together
from sonarlog.diff.comparable import check_comparable
from sonarlog.diff.first import Chaining, FirstDifference, first_chaining, first_difference
from sonarlog.diff.goals import OtherGoal, first_goal
from sonarlog.diff.matching import WallChange, match, same
from sonarlog.diff.paths import PathChanges, path_changes
from sonarlog.diff.rooms import RoomChange, RoomChanges, room_changes
from sonarlog.diff.times import TimeChanges, time_changes
from sonarlog.diff.tolerance import Tolerance
from sonarlog.diff.truth import Truth, truth_of
from sonarlog.diff.walls import Wall, walls_of
from sonarlog.log import Floats
from sonarlog.runs import Run
from sonarlog.scores import path_of

LENGTHS = {"longer", "shorter"}


@dataclass(frozen=True)
class Side:
    """One of the two: a run, `name` that tells it from the other, `asked` what the user wrote (may be empty).

    `now` says that it was replayed for this comparison.
    """

    run: Run
    name: str
    asked: str = ""
    now: bool = False

    @cached_property
    def path(self) -> Floats:
        """The run's poses (n, 3): x m, y m, θ rad, in its own map's frame."""
        return path_of(self.run)

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """The run's walls, in its own map's frame."""
        return walls_of(self.run.chains)


@dataclass(frozen=True)
class Maps:
    """What the maps differ in: how B's lies on A's, and cells, walls and free areas once it is laid there."""

    alignment: Alignment
    cells: CellChanges
    walls: tuple[WallChange, ...]
    rooms: RoomChanges


@dataclass(frozen=True)
class Report:
    """All levels of the difference between A and B; `first` is None if their results are the same to the bit.

    `chaining` is where walls begin to be put to other chains, at that sweep or later; None if they never do. `goal` is
    the first decision of an exploration that would have led elsewhere.
    `settings` holds by name what was asked differently (algorithm, code, recording, settings), in A and in B. `cells`
    are as the maps lie, `aligned_cells`, `walls` and `rooms` as `alignment` lays B's on A's. `times` are None unless
    both runs keep them. With a `tolerance`, what differs within it counts as the same.
    """

    a: Side
    b: Side
    settings: dict[str, tuple[Any, Any]]
    first: FirstDifference | None
    chaining: Chaining | None
    goal: OtherGoal | None
    alignment: Alignment
    cells: CellChanges
    aligned_cells: CellChanges
    walls: tuple[WallChange, ...]
    rooms: RoomChanges
    path: PathChanges
    calibration: tuple[CalibrationChange, ...]
    times: TimeChanges | None = None
    tolerance: Tolerance | None = None

    @property
    def names(self) -> tuple[str, str]:
        """What tells the sides apart."""
        return self.a.name, self.b.name

    @property
    def sweeps(self) -> tuple[int, int]:
        """How many sweeps each has."""
        return len(self.a.run.sweeps), len(self.b.run.sweeps)

    @property
    def same(self) -> bool:
        """Whether every block of every sweep, and the map, came out the same to the bit."""
        return self.first is None

    @property
    def changed_walls(self) -> tuple[WallChange, ...]:
        """The walls that are not the same, what matters most first."""
        changed = [change for change in self.walls if change.kinds]
        return tuple(sorted(changed, key=lambda change: -_weight(change)))

    @property
    def within(self) -> bool:
        """Whether what differs is within the tolerance."""
        given = self.tolerance
        if given is None or self.sweeps[0] != self.sweeps[1]:
            return False
        return (
            1000 * self.path.largest_m <= given.mm
            and self.path.largest_heading_deg <= given.deg
            and self.cells.cells <= given.cells
            and all(_within(change, given) for change in self.walls)
        )

    @property
    def verdict(self) -> str:
        """`same`, `within` the tolerance, or `changed`."""
        return "same" if self.same else "within" if self.within else "changed"

    @property
    def headline(self) -> str:
        """The whole in a few sentences that a person can act on."""
        from sonarlog.diff.headline import headline

        return headline(self)

    @cached_property
    def truth(self) -> Truth | None:
        """Both sides against the truth; None where none is known. Found when it is asked for: it takes its time."""
        return truth_of(self.a.run, self.b.run)

    @cached_property
    def window(self) -> Window:
        """Both maps' cells in one rectangle of A's frame, B's where the alignment lays them: for drawing."""
        return together(self.a.run.grid, self.b.run.grid, self.alignment.pose)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON, as docs/diff.md lists them."""
        from sonarlog.diff.plain import report_data

        return report_data(self)


def _within(change: WallChange, given: Tolerance) -> bool:
    """Whether it is one wall on both sides, and what is told of it is within the tolerance."""
    far = max(abs(change.moved_m) * ("moved" in change.kinds), abs(change.longer_m) * bool({*change.kinds} & LENGTHS))
    turned = abs(change.turned_deg) * ("turned" in change.kinds)
    return len(change.a) == len(change.b) == 1 and 1000 * far <= given.mm and turned <= given.deg


def _weight(change: WallChange) -> float:
    """How much a change of a wall matters: walls that come and go, then by length and move; seen once says little."""
    seen = min(3, *(len(wall.pieces) for wall in (*change.a, *change.b))) / 3
    whole = 10.0 if {"gone", "appeared", "doubled", "single"} & set(change.kinds) else 0.0
    return seen * (whole + change.wall.length_m * (1.0 + 10.0 * abs(change.moved_m)) + abs(change.longer_m))


def diff_runs(
    a: Run,
    b: Run,
    *,
    names: tuple[str, str] | None = None,
    asked: tuple[str, str] = ("", ""),
    now: tuple[bool, bool] = (False, False),
    tolerance: Tolerance | None = None,
) -> Report:
    """Hold two runs against one another; `names` tell them apart (None: their algorithms, or files).

    `now` says which of them were replayed for this, on this machine, and are not kept from earlier. Raises
    NotComparable if they are of recordings of different drives, or if their cells have different sizes, and BadRun for
    values that do not have their digests.
    """
    check_comparable(a, b)
    here, there = (Side(*each) for each in zip((a, b), names or _names(a, b), asked, now, strict=True))
    first = first_difference(a, b)
    maps = _same_maps(here, there) if first is None else _maps(here, there)
    return Report(
        a=here,
        b=there,
        settings=_settings(a, b),
        first=first,
        chaining=None if first is None else first_chaining(a, b),
        goal=None if first is None else first_goal(a, b),
        alignment=maps.alignment,
        cells=cell_changes(a.grid, b.grid),
        aligned_cells=maps.cells,
        walls=maps.walls,
        rooms=maps.rooms,
        path=path_changes(here.path, there.path, maps.alignment.pose),
        calibration=calibration_changes(_calibration(a), _calibration(b)),
        times=time_changes(a, b, now),
        tolerance=tolerance,
    )


def _same_maps(a: Side, b: Side) -> Maps:
    """Nothing has to be looked for where nothing differs."""
    rooms = room_changes(together(a.run.grid, b.run.grid))
    return Maps(Alignment(ORIGIN, (0.0, 0.0)), cell_changes(a.run.grid, b.run.grid), same(a.walls), rooms)


def _maps(a: Side, b: Side) -> Maps:
    """Always computed from the run with the smaller digest to the other, so that A and B swapped mirror one another."""
    if a.run.digest > b.run.digest:
        return _mirrored(_maps_in_order(b, a))
    return _maps_in_order(a, b)


def _maps_in_order(a: Side, b: Side) -> Maps:
    alignment = align(a, b, min(len(a.path), len(b.path)))
    laid = [wall.moved(alignment.pose) for wall in b.walls]
    return Maps(
        alignment=alignment,
        cells=cell_changes(a.run.grid, b.run.grid, alignment.pose),
        walls=match(a.walls, b.walls, laid),
        rooms=room_changes(together(a.run.grid, b.run.grid, alignment.pose)),
    )


def _mirrored(maps: Maps) -> Maps:
    back = maps.alignment.inverted()
    walls = sorted(
        (change.mirrored() for change in maps.walls),
        key=lambda change: (0, change.a[0].number) if change.a else (1, change.b[0].number),
    )
    rooms = maps.rooms.mirrored()
    changes = [RoomChange(room.kind, room.a_m2, room.b_m2, _moved(room.place, back)) for room in rooms.changes]
    return Maps(back, maps.cells.mirrored(), tuple(walls), RoomChanges(rooms.free_m2, rooms.rooms, tuple(changes)))


def _moved(place: tuple[float, float], alignment: Alignment) -> tuple[float, float]:
    x, y = alignment.pose.points(np.array([place]))[0].tolist()
    return float(x), float(y)


def _names(a: Run, b: Run) -> tuple[str, str]:
    """What tells the runs apart: their algorithms, else their files."""
    if a.identity.algorithm != b.identity.algorithm:
        return a.identity.algorithm, b.identity.algorithm
    return a.path.name, b.path.name


def _settings(a: Run, b: Run) -> dict[str, tuple[Any, Any]]:
    """What of the runs' identities differs: recording, algorithm, code, and each setting by its full name."""
    mine, yours = _identity(a), _identity(b)
    return {key: (mine.get(key), yours.get(key)) for key in (mine | yours) if mine.get(key) != yours.get(key)}


def _identity(run: Run) -> dict[str, Any]:
    identity = run.identity
    return {
        "recording": identity.recording_digest,
        "algorithm": f"{identity.algorithm} {identity.algorithm_version}",
        "code": identity.code_digest,
        **({} if identity.robot is None else {"robot": identity.robot}),
        **identity.config,
    }


def _calibration(run: Run) -> dict[str, Any]:
    """What the run thinks of the robot after its last sweep."""
    return dict(run.sweeps[-1].data.get("calibration") or {}) if run.sweeps else {}
