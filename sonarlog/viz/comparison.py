"""Two runs and what differs, as layers on one timeline: A, B laid on A, and the difference.

Must not know: Rerun, how differences are found.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slam.geometry import Pose
from sonarlog.changes import A, B, change_pixels
from sonarlog.diff import Report, Side, Wall, WallChange, Window
from sonarlog.diff_page.payload import level_of
from sonarlog.digest import BLOCKS
from sonarlog.log import Floats
from sonarlog.metrics import placed
from sonarlog.picture import FREE, OCCUPIED, UNKNOWN
from sonarlog.viz.blocks import robot
from sonarlog.viz.layout import Group, Layout, Page, Plane, Plot
from sonarlog.viz.pieces import Pieces, merged
from sonarlog.viz.rerun_door import Canvas, canvas
from sonarlog.viz.shapes import GREY, WINE, Colour, Labels, Raster, Shape, Strips, circle, dashed
from sonarlog.words import block_lines

if TYPE_CHECKING:
    from sonarlog.viz.native import Viewer

RADIUS_M, MARGIN_M = 0.15, 1.0
PATTERN_PX = 1 << 24
"""Up to so many pixels the cells that changed carry their patterns; larger maps have their colours only."""
NAMED, NAMES_M = 10, (3.0, 0.8)
"""So many changed walls are named, and none whose name would lie nearer than this to another's."""
SERIES: dict[str, tuple[str, Colour]] = {
    "plots/apart/as_they_lie_cm": ("as the maps lie, cm", GREY),
    "plots/apart/aligned_cm": ("B laid on A, cm", WINE),
    "plots/shift/a_cm": ("A, cm", A),
    "plots/shift/b_cm": ("B, cm", B),
    "plots/turn/a_deg": ("A, °", A),
    "plots/turn/b_deg": ("B, °", B),
}


def compare_live(report: Report, viewer: "Viewer | None" = None) -> None:
    """Show the comparison in a viewer (None: one in its own window), its cursor on the first difference.

    Raises NoViewer, CannotSave.
    """
    _show(report, canvas(_title(report), viewer=viewer, application="sonarlog_diff"))


def compare_to_file(report: Report, path: Path | str, *, force: bool = False) -> None:
    """Save the comparison to an .rrd file; the first difference is marked on its timeline. Raises CannotSave."""
    _show(report, canvas(_title(report), path, force=force, application="sonarlog_diff"))


def _title(report: Report) -> str:
    return f"A {report.names[0]} → B {report.names[1]}"


def _show(report: Report, shown: Canvas) -> None:
    first = report.first.sweep if report.first else None
    try:
        heading, layout = _layout(report)
        shown.name_numbers(SERIES)
        shown.lay_out(layout, heading)
        shown.draw(_always(report), always=True)
        shown.write("report", _report(report), always=True)
        sides = [_Walk(report.a, "a", Pose(0.0, 0.0, 0.0)), _Walk(report.b, "b", report.alignment.pose)]
        for sweep in range(max(report.sweeps)):
            shown.at(sweep=sweep)
            for side in sides:
                shown.draw(side.shapes(sweep))
            shown.numbers(_numbers(report, sides, sweep))
            shown.write("blocks", _sweep(report, sweep))
    except BaseException:
        shown.abandon()
        raise
    last = max(report.sweeps) - 1
    shown.finish(look_at=None if last < 0 else last if first is None else min(first, last))


class _Walk:
    """One side as it goes: its path so far, its robot, what it saw of walls at the sweep."""

    def __init__(self, side: Side, key: str, lay: Pose) -> None:
        self.side, self.lay, self.colour = side, lay, A if key == "a" else B
        self.path = placed(side.path, lay)
        self._name = f"map/{key.upper()}"
        self._drawn: Callable[[Floats], list[Floats]] = dashed if key == "a" else lambda rows: [rows]
        self._pieces = Pieces(f"{self._name}/path", self._piece, joined=True)

    def _piece(self, _first: int, rows: Floats) -> Strips:
        return Strips(self._drawn(rows) if len(rows) > 1 else [], [self.colour], 3.0)

    def shapes(self, sweep: int) -> dict[str, Shape]:
        """What is to be seen of it at a sweep; nothing once it has come to its end."""
        if sweep >= len(self.path):
            return {f"{self._name}/robot": Strips([], []), f"{self._name}/seen": Strips([], [])}
        x, y, theta = self.path[sweep].tolist()
        walls = [np.array([wall["start"], wall["end"]]) for wall in self.side.run.sweeps[sweep].data["walls"]]
        return merged(
            [
                self._pieces.changed(self.path[: sweep + 1, :2]),
                {
                    f"{self._name}/robot": Strips(robot(Pose(x, y, theta), RADIUS_M), [self.colour], 2.5),
                    f"{self._name}/seen": Strips([self.lay.points(wall) for wall in walls], [self.colour], 5.0),
                },
            ]
        )


def _always(report: Report) -> dict[str, Shape]:
    """Maps, walls and what differs between them; where the first difference arose."""
    window, lay = report.window, report.alignment.pose
    greys = np.array([UNKNOWN, FREE, OCCUPIED], dtype=np.uint8)
    x, y = window.left * window.cell_m, window.bottom * window.cell_m
    changed = report.changed_walls
    named = _apart([(change, _place(change, lay)) for change in changed])
    shapes: dict[str, Shape] = {
        "map/A/grid": Raster(greys[window.a], x, y, window.cell_m),
        "map/B/grid": Raster(greys[window.b], x, y, window.cell_m),
        "map/difference/grid": _difference(window, x, y),
        "map/A/walls": _lines([wall for change in report.walls for wall in change.a], A, dash=True),
        "map/B/walls": _lines([wall.moved(lay) for change in report.walls for wall in change.b], B),
        "map/difference/walls_a": _lines([wall for change in changed for wall in change.a], A, dash=True),
        "map/difference/walls_b": _lines([wall.moved(lay) for change in changed for wall in change.b], B),
        "map/difference/names": Labels(
            np.array([place for _, place in named]).reshape(-1, 2),
            tuple(f"{change.wall.name}: {', '.join(change.kinds)}" for change, _ in named),
        ),
    }
    if report.first and report.first.sweep < len(report.a.path):
        place = report.a.path[report.first.sweep, :2]
        said = f"first: sweep {report.first.sweep}, block {report.first.block}"
        shapes["map/first/ring"] = Strips([circle(float(place[0]), float(place[1]), 0.3)], [WINE], 4.0)
        shapes["map/first/name"] = Labels(place[None, :] + [[0.0, 0.45]], (said,))
    return shapes


def _difference(window: Window, x: float, y: float) -> Raster:
    states = 3 * window.a.astype(np.int64) + window.b
    fine = 4 if 16 * states.size <= PATTERN_PX else 1
    pixels = change_pixels(np.repeat(np.repeat(states, fine, axis=0), fine, axis=1))
    opaque = np.full((*pixels.shape[:2], 1), 255, dtype=np.uint8)
    return Raster(np.concatenate([pixels, opaque], axis=2), x, y, window.cell_m / fine)


def _lines(walls: list[Wall], colour: Colour, *, dash: bool = False) -> Strips:
    ends = [np.array([wall.start, wall.end]) for wall in walls]
    return Strips([part for line in ends for part in dashed(line, 0.12)] if dash else ends, [colour], 2.5)


def _place(change: WallChange, lay: Pose) -> tuple[float, float]:
    return change.a[0].middle if change.a else change.b[0].moved(lay).middle


def _apart(changes: list[tuple[WallChange, tuple[float, float]]]) -> list[tuple[WallChange, tuple[float, float]]]:
    """The first of them that are far enough from one another for their names to be read."""
    kept: list[tuple[WallChange, tuple[float, float]]] = []
    for change, (x, y) in changes:
        if len(kept) < NAMED and all(abs(x - u) > NAMES_M[0] or abs(y - v) > NAMES_M[1] for _, (u, v) in kept):
            kept.append((change, (x, y)))
    return kept


def _numbers(report: Report, sides: "list[_Walk]", sweep: int) -> dict[str, float]:
    """How far apart the paths are at a sweep, and what each corrected."""
    numbers = {}
    for walk, key in zip(sides, "ab", strict=True):
        if sweep < len(walk.path):
            found = walk.side.run.sweeps[sweep]
            step = found.predicted.step_to(found.pose)
            numbers[f"plots/shift/{key}_cm"] = 100.0 * float(np.hypot(step.x, step.y))
            numbers[f"plots/turn/{key}_deg"] = float(np.degrees(step.theta))
    if sweep < min(report.sweeps):
        for name, a, b in (("as_they_lie", report.a.path, report.b.path), ("aligned", sides[0].path, sides[1].path)):
            numbers[f"plots/apart/{name}_cm"] = 100.0 * float(np.hypot(*(a[sweep, :2] - b[sweep, :2])))
    return numbers


def _sweep(report: Report, sweep: int) -> str:
    """Every block's decision on both sides, as Markdown; once where it is the same."""
    if sweep >= min(report.sweeps):
        return f"### Sweep {sweep}\n\nOnly {'A' if report.sweeps[0] > sweep else 'B'} has it."
    a, b = report.a.run.sweeps[sweep], report.b.run.sweeps[sweep]
    mine, yours = block_lines(a.data), block_lines(b.data)
    parts = [f"### Sweep {sweep}"]
    for letter, (name, _) in BLOCKS.items():
        same = a.digests[letter] == b.digests[letter]
        first = report.first is not None and (report.first.sweep, report.first.block) == (sweep, letter)
        mark = " — **the first difference**" if first else " — the same" if same else " — differs"
        told = mine[letter] if mine[letter] == yours[letter] else f"\n- A: {mine[letter]}\n- B: {yours[letter]}"
        parts.append(f"**{letter}** *{name}*{mark}: {told}")
    return "\n\n".join(parts)


def _report(report: Report) -> str:
    walls = "\n".join(f"- {change.words}" for change in report.changed_walls) or "- all are the same"
    return f"{report.headline}\n\n**Walls**\n\n{walls}"


def _layout(report: Report) -> tuple[float, Layout]:
    """Which way lies level, and the layout: three planes, the words, the plots."""
    window = report.window
    rows, columns = np.nonzero(window.a + window.b)
    cells = np.column_stack([columns + window.left + 0.5, rows + window.bottom + 0.5]) * window.cell_m
    angle = level_of(report)
    turned = Pose(0.0, 0.0, -angle).points(cells if len(cells) else np.zeros((1, 2)))
    low, high = turned.min(axis=0) - MARGIN_M, turned.max(axis=0) + MARGIN_M
    corners = (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))
    first = ("/map/first/ring",)
    planes = [
        Plane(f"A · {report.names[0]} · dashed", ("/map/A/**", *first), "", *corners),
        Plane(f"B · {report.names[1]} · laid on A", ("/map/B/**", *first), "", *corners),
        Plane(
            "Difference · blue: only in B, orange: only in A; hatched occupied, dotted and dashed free",
            ("/map/**", "- /map/A/grid", "- /map/B/grid", "- /map/A/walls", "- /map/B/walls"), "", *corners,
        ),
    ]  # fmt: skip
    if high[0] - low[0] > 2 * (high[1] - low[1]):
        maps = Group("column", planes)
    else:
        maps = Group("column", (Group("row", planes[:2]), planes[2]), (2, 3))
    plots = [
        Plot("How far the paths are apart", "plots/apart"),
        Plot("F: shift found", "plots/shift"),
        Plot("F: turn found", "plots/turn"),
    ]
    words = Group("tabs", (Page("Block by block, A and B", "blocks"), Page("The whole difference", "report")))
    side = Group("column", (words, *plots), (4, 1, 1, 1))
    whole = Group("row", (maps, side), (3, 2))
    mark = None if report.first is None else (report.first.sweep, max(report.sweeps) - 1)
    return -angle, Layout(whole, "sweep", selection=mark)
