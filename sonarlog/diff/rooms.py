"""Free space of two maps: how much of it, and which connected areas grew, appeared, were joined or parted.

Must not know: runs, how the maps were aligned.
"""

from dataclasses import dataclass

import numpy as np

from slam.components import label
from slam.geometry import Bools
from slam.sweep import Ints
from sonarlog.diff.cells import FREE, States, Window

SMALLEST_M2 = 0.5
"""Smaller areas are specks behind walls, not rooms."""
NOTICED_M2, NOTICED_PART = 0.25, 0.02
MIRRORED = {"bigger": "smaller", "appeared": "gone", "joined": "parted"}
MIRROR = MIRRORED | {b: a for a, b in MIRRORED.items()}


@dataclass(frozen=True)
class RoomChange:
    """What became of one connected free area, or of several that belong together; `kind` is "" for the same.

    `place` is a free cell's centre in A's map frame, metres.
    """

    kind: str
    a_m2: float
    b_m2: float
    place: tuple[float, float]

    @property
    def words(self) -> str:
        """`the free area at (1.0, 2.0) is 2.1 m² bigger`."""
        where, off = f"the free area at ({self.place[0]:.1f}, {self.place[1]:.1f})", self.b_m2 - self.a_m2
        return {
            "": f"{where} is the same",
            "bigger": f"{where} is {off:.1f} m² bigger",
            "smaller": f"{where} is {-off:.1f} m² smaller",
            "appeared": f"{where} appeared ({self.b_m2:.1f} m²)",
            "gone": f"{where} is gone ({self.a_m2:.1f} m²)",
            "joined": f"free areas are joined into {where.removeprefix('the free area ')} ({self.b_m2:.1f} m²)",
            "parted": f"{where} is parted",
        }[self.kind]

    def mirrored(self) -> "RoomChange":
        """From B to A."""
        return RoomChange(MIRROR.get(self.kind, self.kind), self.b_m2, self.a_m2, self.place)


@dataclass(frozen=True)
class RoomChanges:
    """Free space of A and B in m², the number of connected areas, and what became of each."""

    free_m2: tuple[float, float]
    rooms: tuple[int, int]
    changes: tuple[RoomChange, ...]

    def mirrored(self) -> "RoomChanges":
        """From B to A."""
        changes = tuple(change.mirrored() for change in self.changes)
        return RoomChanges((self.free_m2[1], self.free_m2[0]), (self.rooms[1], self.rooms[0]), changes)


def room_changes(window: Window) -> RoomChanges:
    """Hold the free space of two maps that lie on one another against each other."""
    cell_m2 = window.cell_m * window.cell_m
    mine, yours = _rooms(window.a, cell_m2), _rooms(window.b, cell_m2)
    free = (_free(window.a, cell_m2), _free(window.b, cell_m2))
    changes = [_change(window, *group) for group in _groups(mine, yours)]
    count = (len(np.unique(mine[mine > 0])), len(np.unique(yours[yours > 0])))
    return RoomChanges(free, count, tuple(changes))


def _free(states: States, cell_m2: float) -> float:
    return cell_m2 * int(np.count_nonzero(states == FREE))


def _rooms(states: States, cell_m2: float) -> Ints:
    """The connected free areas (h, w) by number from 1; 0 where there is none, or one too small."""
    labels = label(states == FREE) if states.size else np.zeros(states.shape, dtype=np.int64)
    sizes = np.bincount(labels.reshape(-1)) if labels.size else np.zeros(1, dtype=np.int64)
    big = sizes * cell_m2 >= SMALLEST_M2
    big[0] = False
    return np.asarray(np.where(big[labels], labels, 0))


Group = tuple[Bools, Bools, int, int]


def _groups(mine: Ints, yours: Ints) -> list[Group]:
    """Areas of A and B that lie on one another for a fifth of the smaller: masks (h, w), and how many of each."""
    size_a, size_b = np.bincount(mine.reshape(-1), minlength=1), np.bincount(yours.reshape(-1), minlength=1)
    shared = np.zeros((len(size_a), len(size_b)), dtype=np.int64)
    np.add.at(shared, (mine.reshape(-1), yours.reshape(-1)), 1)
    left_a, left_b = [k for k in range(1, len(size_a)) if size_a[k]], [k for k in range(1, len(size_b)) if size_b[k]]
    groups = []
    while left_a or left_b:
        rooms_a, rooms_b = ({left_a[0]}, set()) if left_a else (set(), {left_b[0]})
        while True:
            more_b = {j for j in left_b if any(5 * shared[i, j] >= min(size_a[i], size_b[j]) for i in rooms_a)}
            more_a = {i for i in left_a if any(5 * shared[i, j] >= min(size_a[i], size_b[j]) for j in rooms_b)}
            if more_b <= rooms_b and more_a <= rooms_a:
                break
            rooms_a, rooms_b = rooms_a | more_a, rooms_b | more_b
        left_a, left_b = [i for i in left_a if i not in rooms_a], [j for j in left_b if j not in rooms_b]
        groups.append((np.isin(mine, sorted(rooms_a)), np.isin(yours, sorted(rooms_b)), len(rooms_a), len(rooms_b)))
    return groups


def _change(
    window: Window,
    mine: Bools,
    yours: Bools,
    count_a: int,
    count_b: int,
) -> RoomChange:
    cell_m2 = window.cell_m * window.cell_m
    a_m2, b_m2 = cell_m2 * int(np.count_nonzero(mine)), cell_m2 * int(np.count_nonzero(yours))
    off, least = b_m2 - a_m2, max(NOTICED_M2, NOTICED_PART * max(a_m2, b_m2))
    if not count_a or not count_b:
        kind = "gone" if count_a else "appeared"
    elif count_a != count_b:
        kind = "joined" if count_a > count_b else "parted"
    else:
        kind = "bigger" if off >= least else "smaller" if off <= -least else ""
    rows, columns = np.nonzero(mine | yours)
    middle = len(rows) // 2
    x, y = (columns[middle] + window.left + 0.5) * window.cell_m, (rows[middle] + window.bottom + 0.5) * window.cell_m
    return RoomChange(kind, a_m2, b_m2, (float(x), float(y)))
