"""What an inspection shows of each step, as shapes by entity path, texts and numbers.

One naming scheme: `map/WHAT` is drawn in the map's frame, `plots/WHAT` are numbers over sweeps. Must not know: Rerun.
"""

from dataclasses import dataclass

import numpy as np

from slam.frontier import beside
from slam.geometry import ORIGIN, Pose
from slam.grid import Grid
from slam.pipeline import Step
from slam.reliability import ALONE, IN_RCD, NEAR_RCD
from sonarlog.digest import BLOCKS
from sonarlog.log import Floats, Odometry, Surfaces
from sonarlog.map_metrics import surfaces_in_map
from sonarlog.metrics import frame_between
from sonarlog.picture import BLUE, GREEN, ORANGE, PURPLE, VERMILLION, chain_colour, shades
from sonarlog.step_data import step_data
from sonarlog.viz.shapes import Colour, Dots, Raster, Shape, Strips
from sonarlog.words import block_lines

GREY: Colour = (110, 110, 110)
BLACK: Colour = (20, 20, 20)
AROUND_M = 2.5
NAMED_REGIONS = 5
"""So many of the largest frontier regions are marked."""
RAISED, LOWERED = (*BLUE, 150), (*ORANGE, 70)


@dataclass(frozen=True)
class Shown:
    """What one step adds: shapes by entity path, numbers by plot, and the blocks' decisions as Markdown."""

    shapes: dict[str, Shape]
    numbers: dict[str, float]
    text: str


class Scene:
    """Turns steps into what is shown of them; keeps the paths walked so far and where the truth lies.

    `radius_m` is the robot's, `surfaces` the true ones in the recording's frame, if they are known.
    """

    def __init__(self, radius_m: float, surfaces: Surfaces | None) -> None:
        self._radius_m = radius_m
        self._surfaces = surfaces
        self._odometry: list[Pose] = []
        self._corrected: list[Pose] = []
        self._true: list[Pose] = []
        self._odometry_frame = ORIGIN
        self._frame: Pose | None = None  # the map's origin in the frame of the truth

    def show(self, step: Step, truth: Pose | None = None) -> Shown:
        """What this step adds; `truth` is where the robot really was, in the recording's frame."""
        number = len(self._corrected)
        if number == 0:
            self._odometry_frame = frame_between(step.calibrated.odometry, step.pose)
            self._frame = frame_between(step.pose, truth) if truth else None
        self._corrected.append(step.pose)
        self._odometry.append(self._odometry_frame.compose(step.calibrated.odometry))
        shapes = _map(step) | _readings(step) | _chains(step) | _sweep(step) | _goal(step)
        shapes |= self._robots(step) | self._truth(truth)
        data = step_data(step, number)
        return Shown(shapes, self._numbers(step), _text(number, block_lines(data)))

    def _robots(self, step: Step) -> dict[str, Shape]:
        return {
            "map/odometry/path": Strips([_places(self._odometry)], [GREY], 1.5),
            "map/odometry/robot": _glyph(self._odometry[-1], self._radius_m, GREY, 1.5),
            "map/predicted/robot": _glyph(step.calibrated.predicted, self._radius_m, PURPLE, 1.5),
            "map/corrected/path": Strips([_places(self._corrected)], [GREEN], 2.5),
            "map/corrected/robot": _glyph(step.pose, self._radius_m, GREEN, 3.0),
        }

    def _truth(self, truth: Pose | None) -> dict[str, Shape]:
        if truth is None or self._frame is None:
            return {}
        into_map = frame_between(self._frame, ORIGIN)
        self._true.append(into_map.compose(truth))
        shapes: dict[str, Shape] = {
            "map/true/path": Strips([_places(self._true)], [VERMILLION], 1.0),
            "map/true/robot": _glyph(self._true[-1], self._radius_m, VERMILLION, 1.0),
        }
        if self._surfaces is not None and len(self._true) == 1:
            known = surfaces_in_map(self._surfaces, self._frame)
            rims = [_circle(x, y, radius) for x, y, radius in known.poles.tolist()]
            shapes["map/true/walls"] = Strips([*known.segments.reshape(-1, 2, 2), *rims], [VERMILLION], 1.0)
        return shapes

    def _numbers(self, step: Step) -> dict[str, float]:
        found = step.localisation
        numbers = {
            "plots/turn/turn_deg": found.turn_deg,
            "plots/shift/shift_cm": 100.0 * float(np.hypot(*found.shift)),
            "plots/d1/before_cm": 100.0 * found.d1_before,
            "plots/d1/after_cm": 100.0 * found.d1_after,
            "plots/calibration/rotation_scale_percent": 100.0 * step.calibrated.calibration.rotation_scale,
        }
        if self._true and len(self._true) == len(self._corrected):
            true = self._true[-1]
            for name, path in (("odometry", self._odometry), ("corrected", self._corrected)):
                off = true.step_to(path[-1])
                numbers[f"plots/error/{name}_cm"] = 100.0 * float(np.hypot(off.x, off.y))
                numbers[f"plots/heading_error/{name}_deg"] = float(np.degrees(off.theta))
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


def _map(step: Step) -> dict[str, Shape]:
    """The grid so far, and what this sweep added to it."""
    grid, patch = step.state.grid, step.patch
    left, bottom, cells = _known(grid)
    change = np.zeros((*patch.delta.shape, 4), dtype=np.uint8)
    change[patch.delta > 0], change[patch.delta < 0] = RAISED, LOWERED
    return {
        "map/grid": Raster(shades(grid, cells), left * grid.cell_m, bottom * grid.cell_m, grid.cell_m),
        "map/patch": Raster(change, patch.left * grid.cell_m, patch.bottom * grid.cell_m, grid.cell_m),
    }


def _known(grid: Grid) -> tuple[int, int, np.ndarray[tuple[int, ...], np.dtype[np.int16]]]:
    """The smallest rectangle with every cell of which anything is known."""
    cells, left, bottom = grid.dense()
    rows, columns = np.flatnonzero(cells.any(axis=1)), np.flatnonzero(cells.any(axis=0))
    if not len(rows):
        return 0, 0, np.zeros((1, 1), dtype=np.int16)
    part = cells[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return left + int(columns[0]), bottom + int(rows[0]), part


def _readings(step: Step) -> dict[str, Shape]:
    kinds = (("in_rcd", IN_RCD, BLUE, 2.5), ("near_rcd", NEAR_RCD, ORANGE, 2.0), ("alone", ALONE, PURPLE, 1.5))
    classes, echoes = step.reliability.reading_class, step.posed.echoes
    return {f"map/readings/{name}": Dots(echoes[classes == kind], colour, size) for name, kind, colour, size in kinds}


def _chains(step: Step) -> dict[str, Shape]:
    """All walls so far in the colour of their chain, the roots once more and thicker, and the chains' names."""
    chains = step.state.chains
    roots = [chains.root(chain) for chain in range(len(chains.roots))]
    names = tuple(f"chain {chain}" for chain in range(len(roots)))
    middles = np.array([root.middle for root in roots]).reshape(-1, 2)
    return {
        "map/chains/walls": Strips(
            [np.array([m.segment.start, m.segment.end]) for m in chains.members],
            [chain_colour(m.chain) for m in chains.members],
            3.0,
        ),
        "map/chains/roots": Strips(
            [np.array([root.start, root.end]) for root in roots], [chain_colour(c) for c in range(len(roots))], 7.0
        ),
        "map/chains/names": Dots(middles, BLACK, 1.0, names),
    }


def _sweep(step: Step) -> dict[str, Shape]:
    """What this sweep saw: RCDs, walls before and after localisation, links to the members joined, corners."""
    posed, association, chains = step.posed, step.association, step.state.chains
    strong = [rcd.strong for rcd in step.reliability.rcds]
    links = [
        np.array([posed.walls[link.wall].middle, chains.members[link.member].segment.middle])
        for link in association.links
    ]
    corners = np.array(posed.corners).reshape(-1, 2)
    return {
        "map/sweep/rcds": Strips(
            [np.array([s.start, s.end]) for s in posed.rcds], [BLUE if s else ORANGE for s in strong], 6.0
        ),
        "map/sweep/predicted_walls": Strips([np.array([w.start, w.end]) for w in association.predicted], [PURPLE], 1.5),
        "map/sweep/walls": Strips(
            [np.array([w.start, w.end]) for w in posed.walls],
            [BLACK],
            2.5,
            tuple(f"wall {k}" for k in range(len(posed.walls))),
        ),
        "map/sweep/links": Strips(links, [BLACK], 1.0),
        "map/sweep/corners": Dots(corners, VERMILLION, 5.0),
    }


def _goal(step: Step) -> dict[str, Shape]:
    grid, decision = step.state.grid, step.decision
    cells, left, bottom = grid.dense()
    free = grid.free(cells)
    rows, columns = np.nonzero(free & beside(~free & ~grid.occupied(cells)))
    centres = np.array([region.centre for region in decision.regions]).reshape(-1, 2)
    sizes = tuple(f"{region.cells} cells" for region in decision.regions[:NAMED_REGIONS])
    goal = [] if decision.chosen is None else [decision.chosen]
    return {
        "map/frontier/cells": Dots(
            np.column_stack([columns + left + 0.5, rows + bottom + 0.5]) * grid.cell_m, ORANGE, 0.7
        ),
        "map/frontier/regions": Dots(centres[:NAMED_REGIONS], ORANGE, 3.0, sizes),
        "map/goal/region": Dots(centres[goal], VERMILLION, 6.0, ("goal",) * len(goal)),
        "map/goal/path": Strips([decision.path] if len(decision.path) > 1 else [], [VERMILLION], 2.0),
    }


def _text(number: int, lines: dict[str, str]) -> str:
    rows = [f"**{letter}** *{BLOCKS[letter][0]}*: {line}" for letter, line in lines.items()]
    return f"### Sweep {number}\n\n" + "\n\n".join(rows)


def _places(poses: list[Pose]) -> Floats:
    return np.array([(pose.x, pose.y) for pose in poses])


def _glyph(pose: Pose, radius_m: float, colour: Colour, width: float) -> Strips:
    """The robot from above: its rim, and a line ahead."""
    ahead = pose.points(np.array([[0.0, 0.0], [2.5 * radius_m, 0.0]]))
    return Strips([_circle(pose.x, pose.y, radius_m), ahead], [colour], width)


def _circle(x: float, y: float, radius: float) -> Floats:
    angle = np.linspace(0.0, 2.0 * np.pi, 25)
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)])
