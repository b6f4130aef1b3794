"""What an inspection shows of each step, as shapes by entity path, texts and numbers; only what changed is shown again.

One naming scheme: `map/WHAT` is drawn in the map's frame, `map/LETTER_name` is what a block of Fig. 5 took and gave,
`plots/WHAT` are numbers over sweeps. Must not know: Rerun.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slam.association import POINT
from slam.geometry import ORIGIN, Pose
from slam.pipeline import Step
from slam.sweep import SonarRing
from sonarlog.digest import BLOCKS
from sonarlog.log import Floats, Odometry, Surfaces
from sonarlog.map_metrics import surfaces_in_map
from sonarlog.metrics import frame_between
from sonarlog.picture import BLUE, GREEN, PURPLE, VERMILLION, chain_colour
from sonarlog.step_data import step_data
from sonarlog.viz.blocks import BLOCK_PATHS, EXAGGERATED, block_shapes, robot
from sonarlog.viz.pieces import Pieces, Tiles, merged
from sonarlog.viz.shapes import GREY, WINE, Colour, Labels, Shape, Strips, arrow, circle, dashed, diamonds
from sonarlog.words import block_lines

AROUND_M = 2.5
GRID, FRONTIER = f"{BLOCK_PATHS['H']}/grid", f"{BLOCK_PATHS['I']}/frontier"

SERIES: dict[str, tuple[str, Colour]] = {
    "plots/turn/turn_deg": ("turn, °", BLUE),
    "plots/shift/shift_cm": ("shift, cm", VERMILLION),
    "plots/d1/before_cm": ("before, cm", GREY),
    "plots/d1/after_cm": ("after, cm", GREEN),
    "plots/calibration/rotation_scale_percent": ("rotation scale, %", PURPLE),
    "plots/walls/joined": ("joined a chain", GREEN),
    "plots/walls/new": ("began one", VERMILLION),
    "plots/error/odometry_cm": ("raw odometry, cm", GREY),
    "plots/error/corrected_cm": ("corrected, cm", GREEN),
    "plots/error/whole_path_cm": ("the whole path as it is known now, RMS, cm", BLUE),
    "plots/heading_error/odometry_deg": ("raw odometry, °", GREY),
    "plots/heading_error/corrected_deg": ("corrected, °", GREEN),
}
"""Names and colours of the numbers over sweeps."""


@dataclass(frozen=True)
class Shown:
    """What one step adds: shapes by entity path, numbers by plot, and the blocks' decisions as Markdown.

    `always` are shapes that stay as they are from the first sweep to the last.
    """

    shapes: dict[str, Shape]
    numbers: dict[str, float]
    text: str
    always: dict[str, Shape]


class Scene:
    """Turns steps into what is shown of them; keeps the paths walked so far and where the truth lies.

    `radius_m` is the robot's, `surfaces` the true ones in the recording's frame, if they are known.
    """

    def __init__(self, ring: SonarRing, radius_m: float, surfaces: Surfaces | None) -> None:
        self._ring, self._radius_m, self._surfaces = ring, radius_m, surfaces
        self._odometry: list[Pose] = []
        self._found: list[Pose] = []
        self._true: list[Pose] = []
        self._poses = np.zeros((0, 2))  # as they were known after the sweep before
        self._loops: dict[int, str] = {}
        self._odometry_frame = ORIGIN
        self._frame: Pose | None = None  # the map's origin in the frame of the truth
        self._grid = Tiles(GRID, FRONTIER)
        self._smoothed = Pieces("map/path/corrected", lambda _, rows: Strips([rows], [GREEN], 3.0), joined=True)
        self._as_found = Pieces("map/path/as_found", _broken, joined=True)
        self._raw = Pieces("map/path/odometry", lambda _, rows: Strips([rows], [GREY], 1.5), joined=True)
        self._truth = Pieces("map/path/true", lambda _, rows: Strips([rows], [VERMILLION], 1.0), joined=True)
        self._walls = Pieces("map/chains/walls", _coloured(3.0))
        self._roots = Pieces("map/chains/roots", _coloured(7.0))
        self._names = Pieces("map/chains/names", _chain_names)

    def show(self, step: Step, truth: Pose | None = None) -> Shown:
        """What this step adds; `truth` is where the robot really was, in the recording's frame."""
        number = len(self._found)
        if number == 0:
            self._odometry_frame = frame_between(step.calibrated.odometry, step.pose)
            self._frame = frame_between(step.pose, truth) if truth else None
        before = step.state.poses[-2] if len(step.state.poses) > 1 else None
        self._found.append(step.pose)
        self._odometry.append(self._odometry_frame.compose(step.calibrated.odometry))
        always = self._known() if number == 0 else {}
        shapes = merged(
            [
                self._grid.changed(step.state.grid),
                self._chains(step),
                self._loops_closed(step, number),
                self._paths(step, truth),
                self._robots(step),
                block_shapes(step, self._ring, self._radius_m, before),
            ]
        )
        data = step_data(step, number)
        return Shown(shapes, self._numbers(step), _text(number, block_lines(data)), always)

    def _known(self) -> dict[str, Shape]:
        """The true walls in the map, where they and the robot's true place are known."""
        if self._surfaces is None or self._frame is None:
            return {}
        known = surfaces_in_map(self._surfaces, self._frame)
        rims = [circle(x, y, radius) for x, y, radius in known.poles.tolist()]
        sides = [dash for side in known.segments.reshape(-1, 2, 2) for dash in dashed(side, 0.1)]
        return {"map/true/walls": Strips([*sides, *rims], [VERMILLION], 1.5)}

    def _paths(self, step: Step, truth: Pose | None) -> dict[str, Shape]:
        """All poses as they are known after this sweep, as each was found at its own, raw, and true."""
        poses, found = _places(list(step.state.poses)), _places(self._found)
        shapes = [self._smoothed.changed(poses), self._raw.changed(_places(self._odometry))]
        if poses.shape != found.shape or np.abs(poses - found).max() > 1e-9:
            shapes.append(self._as_found.changed(found))
        if truth is not None and self._frame is not None:
            self._true.append(frame_between(self._frame, ORIGIN).compose(truth))
            shapes.append(self._truth.changed(_places(self._true)))
        self._poses = poses
        return merged(shapes)

    def _loops_closed(self, step: Step, number: int) -> dict[str, Shape]:
        """Where the poses of earlier sweeps went (ten times as far), and every place where a loop was closed so far."""
        poses = _places(list(step.state.poses))
        moved = [k for k, _ in step.localisation.moved if k < len(self._poses)]
        ways = [(self._poses[k], self._poses[k] + EXAGGERATED * (poses[k] - self._poses[k])) for k in moved]
        if step.localisation.merged:
            pairs = " and ".join(f"chain {gone} is chain {kept}" for kept, gone in step.localisation.merged)
            self._loops[number] = f"sweep {number}: {pairs}"
        places = poses[list(self._loops)]
        return {
            f"{BLOCK_PATHS['F']}/moved_x10": Strips([part for way in ways for part in arrow(*way)], [WINE], 1.5),
            f"{BLOCK_PATHS['F']}/loops": Strips(diamonds(places, 0.25), [BLUE], 3.0),
            f"{BLOCK_PATHS['F']}/loop_names": Labels(places[-1:], tuple(self._loops.values())[-1:]),
        }

    def _robots(self, step: Step) -> dict[str, Shape]:
        shapes: dict[str, Shape] = {
            "map/robot/odometry": Strips(robot(self._odometry[-1], self._radius_m), [GREY], 1.5),
            "map/robot/corrected": Strips(robot(step.pose, self._radius_m), [GREEN], 3.0),
        }
        if self._true:
            shapes["map/robot/true"] = Strips(robot(self._true[-1], self._radius_m), [VERMILLION], 1.0)
        return shapes

    def _chains(self, step: Step) -> dict[str, Shape]:
        """All walls so far in the colours of their chains, points as ◇; the roots thicker, and their names."""
        chains = step.state.chains
        walls = _rows([(m.chain, m.nature, *m.segment.start, *m.segment.end) for m in chains.members])
        roots = walls[[root for root in chains.roots if root >= 0]]  # none where chains became one
        roots = roots[roots[:, 1] != POINT]
        return merged([self._walls.changed(walls), self._roots.changed(roots), self._names.changed(roots)])

    def _numbers(self, step: Step) -> dict[str, float]:
        found = step.localisation
        numbers = {
            "plots/turn/turn_deg": found.turn_deg,
            "plots/shift/shift_cm": 100.0 * float(np.hypot(*found.shift)),
            "plots/d1/before_cm": 100.0 * found.d1_before,
            "plots/d1/after_cm": 100.0 * found.d1_after,
            "plots/calibration/rotation_scale_percent": 100.0 * step.calibrated.calibration.rotation_scale,
            "plots/walls/joined": float(len(step.association.links)),
            "plots/walls/new": float(len(step.association.unlinked)),
        }
        if self._true and len(self._true) == len(self._found):
            true = self._true[-1]
            for name, path in (("odometry", self._odometry), ("corrected", self._found)):
                off = true.step_to(path[-1])
                numbers[f"plots/error/{name}_cm"] = 100.0 * float(np.hypot(off.x, off.y))
                numbers[f"plots/heading_error/{name}_deg"] = float(np.degrees(off.theta))
            off_now = np.hypot(*(_places(list(step.state.poses)) - _places(self._true)).T)
            numbers["plots/error/whole_path_cm"] = 100.0 * float(np.sqrt(np.mean(off_now**2)))
        return numbers


def extent(first: Step, odometry: Odometry, walls: Strips | None) -> tuple[Floats, Floats]:
    """Lower left and upper right corner (x, y) m of what will be shown: true walls, and the way as odometry has it.

    From the first sweep's place, along the axes of odometry. `walls` are the true ones in the map's frame.
    """
    start = first.calibrated.odometry
    path = np.column_stack([odometry.x_um * 1e-6 - start.x, odometry.y_um * 1e-6 - start.y])
    low, high = path.min(axis=0) - AROUND_M, path.max(axis=0) + AROUND_M
    if walls is None or not walls.lines:
        return low, high
    true = Pose(0.0, 0.0, start.theta).points(np.concatenate([*walls.lines]))
    return np.minimum(low, true.min(axis=0) - 0.5), np.maximum(high, true.max(axis=0) + 0.5)


def reach(first: Step) -> float:
    """How far around the robot a view of one sweep has to show, m: to the farthest surface of the first one."""
    far = max((rcd.distance for rcd in first.reliability.rcds), default=0.0)
    return float(np.clip(far + 0.8, 2.0, 4.0))


def _text(number: int, told: dict[str, str]) -> str:
    rows = [f"**{letter}** *{BLOCKS[letter][0]}*: {line}" for letter, line in told.items()]
    return f"### Sweep {number}\n\n" + "\n\n".join(rows)


def _broken(_number: int, rows: Floats) -> Strips:
    return Strips(dashed(rows) if len(rows) > 1 else [], [GREEN], 1.0)


def _coloured(width: float) -> Callable[[int, Floats], Shape]:
    def shape(_number: int, rows: Floats) -> Strips:
        ends = rows[:, 2:].reshape(-1, 2, 2)
        lines = [
            diamonds(line.mean(axis=0), 0.06)[0] if row[1] == POINT else line
            for row, line in zip(rows, ends, strict=True)
        ]
        return Strips(lines, [chain_colour(int(row[0])) for row in rows], width)

    return shape


def _chain_names(_number: int, rows: Floats) -> Labels:
    names = tuple(f"chain {int(row[0])}" for row in rows)
    return Labels(rows[:, 2:].reshape(-1, 2, 2).mean(axis=1), names)


def _rows(rows: list[tuple[float, ...]]) -> Floats:
    return np.array(rows, dtype=np.float64).reshape(-1, 6)


def _places(poses: list[Pose]) -> Floats:
    return np.array([(pose.x, pose.y) for pose in poses]).reshape(-1, 2)
