"""What each block made of a sweep, in a line that a person can read.

Works on the plain values of a step (`sonarlog.step_data`), so that viewers and diffs say the same of steps and of runs
read back. Must not know: viewers, files.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

StepData = Mapping[str, Any]


def block_lines(data: StepData) -> dict[str, str]:
    """One line for each block of Fig. 5, by its letter."""
    return {
        "A": _sensing(data),
        "B": _calibration(data),
        "C": _reliability(data),
        "D": _features(data),
        "E": _association(data),
        "F": _localisation(data),
        "G": f"readings and walls recomputed from {pose(data['pose'])}",
        "H": f"{data['map']['cells_raised']} cells towards occupied, {data['map']['cells_lowered']} towards free",
        "I": _decision(data),
    }


def pose(values: list[float]) -> str:
    """A pose [x, y, θ] in metres and degrees."""
    x, y, theta = values
    return f"({x:.2f}, {y:.2f}) m, {np.degrees(theta):.1f}°"


def counted(number: int, noun: str) -> str:
    """`1 wall`, `2 walls`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def wall_line(number: int, wall: Mapping[str, Any]) -> str:
    """Where a wall of the sweep went: `wall 2 joins chain 5 (d1 4.1 cm, a1 0.8°)`."""
    if wall["joined"] is None:
        return f"wall {number} starts chain {wall['chain']}"
    gap = f", {100 * wall['gap']:.0f} cm further on" if wall["gap"] > 0 else ""
    a1 = np.degrees(wall["a1"])
    return f"wall {number} joins chain {wall['chain']} (d1 {100 * wall['d1']:.1f} cm, a1 {a1:.1f}°{gap})"


def _sensing(data: StepData) -> str:
    readings = data["readings"]
    near = f", {readings['too_near']} too near" if readings["too_near"] else ""
    return f"{readings['all']} readings of a {data['kind']} sweep, {readings['no_echo']} without an echo{near}"


def _calibration(data: StepData) -> str:
    mounting = np.degrees(data["calibration"]["mounting"])
    scale = f"rotation scale {100 * data['calibration']['rotation_scale']:+.2f} %"
    if not mounting.size or not mounting.any():
        return f"{scale}; predicted at {pose(data['predicted'])}"
    worst = int(np.argmax(np.abs(mounting)))
    return f"{scale}, sonar {worst} mounted {mounting[worst]:+.1f}° off; predicted at {pose(data['predicted'])}"


def _reliability(data: StepData) -> str:
    readings, rcds = data["readings"], data["rcds"]
    strong = sum(1 for rcd in rcds if rcd["strong"])
    return (
        f"{counted(len(rcds), 'RCD')} ({strong} strong) of {readings['in_rcd']} readings; "
        f"{readings['near_rcd']} near one, {readings['alone']} alone"
    )


def _features(data: StepData) -> str:
    walls, corners, narrow = len(data["walls"]), len(data["corners"]), len(data["narrow"])
    return f"{counted(walls, 'wall')}, {counted(corners, 'corner')}, {counted(narrow, 'narrow thing')}"


def _association(data: StepData) -> str:
    if not data["walls"]:
        return "no wall to associate"
    return "; ".join(wall_line(k, wall) for k, wall in enumerate(data["walls"]))


def _localisation(data: StepData) -> str:
    found = data["localisation"]
    if not found["walls_used"]:
        linked = any(wall["joined"] is not None for wall in data["walls"])
        return f"the prediction stands: {'odometry is taken as it is' if linked else 'nothing to correct it by'}"
    dx, dy = (100 * value for value in found["shift"])
    return (
        f"turned {found['turn_deg']:+.0f}°, shifted ({dx:+.0f}, {dy:+.0f}) cm; d1 to the roots "
        f"{100 * found['d1_before']:.1f} → {100 * found['d1_after']:.1f} cm over {counted(found['walls_used'], 'wall')}"
    )


def _decision(data: StepData) -> str:
    decision = data["decision"]
    regions = counted(len(decision["regions"]), "frontier region")
    if decision["chosen"] is None:
        return f"{regions}, none to be reached: nowhere to go"
    goal = decision["regions"][decision["chosen"]]
    path = np.array(decision["path"]).reshape(-1, 2)
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    x, y = goal["centre"]
    return f"{regions}; to the one of {goal['cells']} cells at ({x:.2f}, {y:.2f}) m, {length:.1f} m to go"
