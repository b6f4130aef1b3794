"""The numbers of a report by name: what gates and bisections put a threshold on. Must not know: thresholds."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sonarlog.diff.matching import KINDS

if TYPE_CHECKING:
    from sonarlog.diff.report import Report


@dataclass(frozen=True)
class Figure:
    """A number of the difference; `sides` are A's and B's where each has one of its own, and then `value` is B's."""

    name: str
    unit: str
    value: float
    sides: tuple[float, float] | None = None

    @property
    def growth(self) -> float | None:
        """By which part of A's the number of B is larger (0.05: 5 %); None where A has none, or 0 and B has not."""
        if self.sides is None:
            return None
        a, b = self.sides
        return (b - a) / abs(a) if a else (0.0 if b == a else None)


def figures(report: "Report") -> dict[str, Figure]:
    """Every number of the report by name, in the order in which docs/diff.md lists them."""
    path, rooms = report.path, report.rooms
    counts = [(f"walls.{kind}", sum(kind in change.kinds for change in report.walls)) for kind in KINDS]
    mine, yours = (sum(wall.length_m for wall in side.walls) for side in (report.a, report.b))
    rows = [
        Figure("sweeps", "", report.sweeps[1], (report.sweeps[0], report.sweeps[1])),
        Figure("cells.changed", "%", 100 * report.cells.changed),
        Figure("cells.changed.aligned", "%", 100 * report.aligned_cells.changed),
        Figure("cells", "", report.cells.cells),
        Figure("alignment.shift", "m", report.alignment.shifted_m),
        Figure("alignment.turn", "°", abs(report.alignment.turned_deg)),
        Figure("walls", "", len(report.b.walls), (len(report.a.walls), len(report.b.walls))),
        Figure("walls.length", "m", yours, (mine, yours)),
        Figure("walls.changed", "", len(report.changed_walls)),
        *(Figure(name, "", count) for name, count in counts),
        Figure("walls.largest_move", "m", max((abs(change.moved_m) for change in report.walls), default=0.0)),
        Figure("rooms", "", rooms.rooms[1], rooms.rooms),
        Figure("free", "m²", rooms.free_m2[1], rooms.free_m2),
        Figure("path.largest", "m", path.largest_m),
        Figure("path.mean", "m", path.mean_m),
        Figure("path.heading", "°", path.largest_heading_deg),
        Figure("path.largest.aligned", "m", path.aligned_largest_m),
    ]
    if report.truth is not None:
        rows += [Figure(m.name, m.unit, m.b, (m.a, m.b)) for m in report.truth.metrics]
    if report.times is not None:
        for row in report.times.rows:
            name = f"time.{row.block}" if row.block else "time"
            rows.append(Figure(name, "ms", row.b_ms, (row.a_ms, row.b_ms)))
    return {row.name: row for row in rows}
