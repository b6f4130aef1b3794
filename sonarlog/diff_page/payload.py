"""What the page's script draws, as plain values: cells, paths, walls, numbers over sweeps.

Must not know: HTML.
"""

import base64
from typing import Any

import numpy as np

from slam.geometry import ORIGIN, Pose
from sonarlog.diff import Report, Side, Wall, WallChange, Window
from sonarlog.diff.cells import OCCUPIED, together
from sonarlog.diff.paths import apart
from sonarlog.log import Floats
from sonarlog.map_metrics import surfaces_in_map
from sonarlog.metrics import frame_between, placed
from sonarlog.picture import level
from sonarlog.scores import raw_path_of

MM = 4  # decimals of metres and degrees that are kept: the page draws, the report decides


def payload(report: Report) -> dict[str, Any]:
    """Everything that is drawn. Positions are in each map's own frame; `lay` puts B's on A's, [x, y, θ]."""
    a, b = report.a, report.b
    laid, lay = report.window, report.alignment.pose
    as_is = laid if lay == ORIGIN else together(a.run.grid, b.run.grid)
    truth, surfaces = _truth(a)
    first = report.first
    return {
        "names": list(report.names),
        "same": report.same,
        "cell_m": laid.cell_m,
        "laid": _cells(laid),
        "asIs": _cells(as_is) if as_is is not laid else None,
        "lay": [round(lay.x, 6), round(lay.y, 6), round(lay.theta, 8)],
        "level": round(level_of(report), 6),
        "paths": [_rows(a.path), _rows(b.path)],
        "odometry": _rows(raw_path_of(a.run)),
        "truth": _rows(truth),
        "surfaces": _rows(surfaces),
        "walls": [_change(change) for change in report.walls],
        "first": None if first is None else first.sweep,
        "plots": _plots(report, truth),
    }


def _cells(window: Window) -> dict[str, Any]:
    """States 3·A + B, row by row from the bottom, run by run: a byte the state, then the length in sevens of bits."""
    states = (3 * window.a.astype(np.int64) + window.b).reshape(-1)
    borders = np.flatnonzero(np.diff(states)) + 1
    starts = np.concatenate([[0], borders]) if len(states) else borders
    lengths = np.diff(np.append(starts, len(states)))
    data = b"".join(_run(*run) for run in zip(states[starts].tolist(), lengths.tolist(), strict=True))
    height, width = window.a.shape
    runs = base64.b64encode(data).decode()
    return {"left": window.left, "bottom": window.bottom, "width": width, "height": height, "runs": runs}


def _run(state: int, length: int) -> bytes:
    sevens = [length >> shift & 127 for shift in range(0, max(1, length.bit_length()), 7)]
    return bytes([state, *(part | 128 for part in sevens[:-1]), sevens[-1]])


def _truth(side: Side) -> tuple[Floats, Floats]:
    """The true path (n, 2) and surfaces (m, 4) in this side's map, as far as they are known."""
    run = side.run
    if run.truth is None or not len(side.path):
        return np.zeros((0, 2)), np.zeros((0, 4))
    x, y, theta = run.truth.pose[0].tolist()
    frame = frame_between(Pose(*side.path[0].tolist()), Pose(x, y, theta))
    path = placed(run.truth.pose, frame.step_to(ORIGIN))
    if run.surfaces is None:
        return path, np.zeros((0, 4))
    return path, surfaces_in_map(run.surfaces, frame).segments.reshape(-1, 4)


def level_of(report: Report) -> float:
    """The direction in A's map that lies level in a drawing."""
    surfaces, window = _truth(report.a)[1], report.window
    rows, columns = np.nonzero((window.a == OCCUPIED) | (window.b == OCCUPIED))
    cells = np.column_stack([columns + window.left + 0.5, rows + window.bottom + 0.5]) * window.cell_m
    return level(surfaces.reshape(-1, 2) if len(surfaces) else cells, report.a.path[:, :2])


def _change(change: WallChange) -> dict[str, Any]:
    return {"kinds": list(change.kinds), "a": [_wall(w) for w in change.a], "b": [_wall(w) for w in change.b]}


def _wall(wall: Wall) -> dict[str, Any]:
    return {"n": wall.number, "ends": [round(float(v), MM) for v in (*wall.start, *wall.end)]}


def _plots(report: Report, truth: Floats) -> list[dict[str, Any]]:
    """Numbers over sweeps: `lines` are (name, style, values); styles `a`, `b`, `plain`, `faint`."""
    a, b = report.a, report.b
    count = min(len(a.path), len(b.path))
    mine, yours = a.path[:count], b.path[:count]
    off, turned = apart(mine, yours)
    laid, laid_turned = apart(mine, placed(yours, report.alignment.pose))
    plots = [
        _plot(
            "How far the paths are apart", "cm",
            [("as they lie", "faint", 100 * off), ("aligned", "plain", 100 * laid)],
        ),
        _plot(
            "How far the headings are apart", "°",
            [("as they lie", "faint", np.degrees(turned)), ("aligned", "plain", np.degrees(laid_turned))],
        ),
        _plot("Correction of the position", "cm", [("A", "a", _shift(a)), ("B", "b", _shift(b))]),
        _plot("Correction of the heading", "°", [("A", "a", _turn(a)), ("B", "b", _turn(b))]),
    ]  # fmt: skip
    if report.truth is not None and len(truth):
        raw = ("raw odometry", "faint", _off(raw_path_of(a.run), truth))
        others = _truth(b)[0]
        lines = [("A", "a", _off(a.path, truth)), ("B", "b", _off(b.path, others)), raw]
        plots.append(_plot("Distance from the truth", "cm", lines))
    return plots


def _plot(title: str, unit: str, lines: list[tuple[str, str, Floats]]) -> dict[str, Any]:
    rows = [{"name": name, "style": style, "values": np.round(values, 3).tolist()} for name, style, values in lines]
    return {"title": title, "unit": unit, "lines": rows}


def _shift(side: Side) -> Floats:
    """How far each sweep's pose was moved from where it was predicted, cm."""
    return np.array([100 * np.hypot(s.pose.x - s.predicted.x, s.pose.y - s.predicted.y) for s in side.run.sweeps])


def _turn(side: Side) -> Floats:
    """How far each sweep's pose was turned from how it was predicted, °."""
    return np.array([np.degrees(s.predicted.step_to(s.pose).theta) for s in side.run.sweeps])


def _off(path: Floats, truth: Floats) -> Floats:
    """cm, sweep by sweep."""
    count = min(len(path), len(truth))
    return np.asarray(100 * np.hypot(*(path[:count, :2] - truth[:count, :2]).T))


def _rows(values: Floats) -> list[list[float]]:
    return [[round(float(v), MM) for v in row] for row in values]
