"""What each block of Fig. 5 took and gave at one sweep, as shapes by entity path: `map/LETTER_name/WHAT`.

Must not know: Rerun, other sweeps.
"""

import numpy as np

from slam.geometry import ORIGIN, Pose, Segment
from slam.pipeline import Step
from slam.reliability import ALONE, IN_RCD, NEAR_RCD
from slam.sweep import TURN, SonarRing
from sonarlog.log import Floats
from sonarlog.picture import BLUE, GREEN, ORANGE, PURPLE, VERMILLION, chain_colour
from sonarlog.viz.shapes import (
    BLACK,
    GREY,
    WINE,
    Colour,
    Dots,
    Labels,
    Raster,
    Shape,
    Strips,
    arrow,
    circle,
    crosses,
    dashed,
    diamonds,
)  # fmt: skip

BLOCK_PATHS = {
    "A": "map/A_sensing", "B": "map/B_calibration", "C": "map/C_reliability", "D": "map/D_features",
    "E": "map/E_association", "F": "map/F_localisation", "G": "map/G_recomputed", "H": "map/H_extension",
    "I": "map/I_decision",
}  # fmt: skip
SONAR_COLOURS: tuple[Colour, ...] = (
    BLACK, ORANGE, (86, 180, 233), GREEN, (190, 175, 20), BLUE, VERMILLION, PURPLE,
)  # fmt: skip
RAISED, LOWERED = (*BLUE, 220), (*ORANGE, 200)
FAINT: Colour = (176, 176, 176)
NO_ECHO_M = 0.25
SONAR_NAMES_M = 0.9
"""So far from the robot stand its sonars' numbers."""
EXAGGERATED = 10.0
NAMED_REGIONS = 5
"""So many of the largest frontier regions are marked."""


def block_shapes(step: Step, ring: SonarRing, radius_m: float, before: Pose | None) -> dict[str, Shape]:
    """The shapes of every block; `before` is the pose of the sweep before, `radius_m` the robot's."""
    raw = _raw_echoes(step, ring)
    parts: dict[str, dict[str, Shape]] = {
        "A": _sensing(step, ring, raw, radius_m),
        "B": _calibration(step, raw, before, radius_m),
        "C": _reliability(step),
        "D": _features(step, radius_m),
        "E": _association(step),
        "F": _localisation(step, radius_m),
        "G": _recomputed(step, radius_m),
        "H": _extension(step),
        "I": _decision(step, radius_m),
    }
    return {f"{BLOCK_PATHS[letter]}/{name}": shape for letter, part in parts.items() for name, shape in part.items()}


def robot(pose: Pose, radius_m: float) -> list[Floats]:
    """The robot from above: its rim, and a line ahead."""
    ahead = pose.points(np.array([[0.0, 0.0], [2.5 * radius_m, 0.0]]))
    return [circle(pose.x, pose.y, radius_m), ahead]


def lines(segments: tuple[Segment, ...] | list[Segment]) -> list[Floats]:
    """Each segment as a line (2, 2)."""
    return [np.array([piece.start, piece.end]) for piece in segments]


def _raw_echoes(step: Step, ring: SonarRing) -> tuple[Floats, Floats]:
    """Where each beam starts and ends (n, 2) by raw odometry and the sonars' nominal mountings.

    Laid on the map at the pose that the sweep was predicted at. A reading without an echo ends a little off its start.
    """
    sweep, at = step.sweep, step.sweep.reference
    turn = (sweep.heading - sweep.heading[at]) * (2.0 * np.pi / TURN)
    heading = float(sweep.heading[at]) * (2.0 * np.pi / TURN)
    east, north = (sweep.x_um - sweep.x_um[at]) * 1e-6, (sweep.y_um - sweep.y_um[at]) * 1e-6
    x = np.cos(heading) * east + np.sin(heading) * north
    y = np.cos(heading) * north - np.sin(heading) * east
    mount = np.array([(m.x, m.y, m.heading) for m in ring.mountings])[sweep.sonar]
    start = np.column_stack(
        [
            x + np.cos(turn) * mount[:, 0] - np.sin(turn) * mount[:, 1],
            y + np.sin(turn) * mount[:, 0] + np.cos(turn) * mount[:, 1],
        ]
    )
    reach = np.where(step.calibrated.beams.echo, sweep.range_mm * 1e-3, NO_ECHO_M)[:, None]
    axis = turn + mount[:, 2]
    end = start + reach * np.column_stack([np.cos(axis), np.sin(axis)])
    predicted = step.calibrated.predicted
    return predicted.points(start), predicted.points(end)


def _sensing(step: Step, ring: SonarRing, raw: tuple[Floats, Floats], radius_m: float) -> dict[str, Shape]:
    start, end = raw
    echo, sonar = step.calibrated.beams.echo, step.sweep.sonar
    colours = [SONAR_COLOURS[k % len(SONAR_COLOURS)] for k in sonar[echo].tolist()]
    outwards = SONAR_NAMES_M * np.array([(np.cos(m.heading), np.sin(m.heading)) for m in ring.mountings])
    return {
        "no_echo": Strips(_pairs(start[~echo], end[~echo]), [FAINT], 0.7),
        "rays": Strips(_pairs(start[echo], end[echo]), [FAINT], 0.7),
        "echoes": Dots(end[echo], colours, 2.5),
        "robot": Strips(robot(step.calibrated.predicted, radius_m), [BLACK], 1.5),
        "sonars": Labels(step.calibrated.predicted.points(outwards), tuple(map(str, range(len(outwards))))),
    }


def _calibration(step: Step, raw: tuple[Floats, Floats], before: Pose | None, radius_m: float) -> dict[str, Shape]:
    calibrated = step.calibrated
    echo, predicted = calibrated.beams.echo, calibrated.predicted
    after = _echoes(step, predicted)
    origins = predicted.points(calibrated.beams.origin)
    moved = [] if before is None else [np.array([(before.x, before.y), (predicted.x, predicted.y)])]
    return {
        "raw": Dots(raw[1][echo], GREY, 2.0),
        "moved": Strips(_pairs(raw[1][echo], after[echo]), [GREY], 1.0),
        "beams": Strips(_pairs(origins[echo], after[echo]), [FAINT], 0.7),
        "calibrated": Dots(after[echo], BLUE, 2.5),
        "driven": Strips([dash for line in moved for dash in dashed(line)], [WINE], 2.0),
        "predicted": Strips(robot(predicted, radius_m), [WINE], 2.0),
    }


def _reliability(step: Step) -> dict[str, Shape]:
    """Told apart by shape too: dots are in an RCD, + near one, × in none."""
    classes, rcds = step.reliability.reading_class, step.reliability.rcds
    echoes = _echoes(step, step.calibrated.predicted)
    placed = _as_predicted(step, step.posed.rcds)
    words = tuple(
        f"RCD {k}: {rcd.sonars} sonars, {np.degrees(rcd.width):.0f}°" + ("" if rcd.strong else ", weak")
        for k, rcd in enumerate(rcds)
    )
    return {
        "alone": Strips(crosses(echoes[classes == ALONE], 0.05, upright=False), [WINE], 1.2),
        "near_rcd": Strips(crosses(echoes[classes == NEAR_RCD], 0.06, upright=True), [VERMILLION], 1.4),
        "in_rcd": Dots(echoes[classes == IN_RCD], BLUE, 2.5),
        "rcds": Strips(lines(placed), [BLUE if rcd.strong else ORANGE for rcd in rcds], 5.0),
        "names": Labels(_middles(placed), words),
    }


def _features(step: Step, radius_m: float) -> dict[str, Shape]:
    features, predicted = step.features, step.calibrated.predicted
    rcds = _as_predicted(step, step.posed.rcds)
    corners = predicted.points(np.array([corner.point for corner in features.corners]).reshape(-1, 2))
    sides = [
        np.array([rcds[side].middle, point])
        for corner, point in zip(features.corners, corners.tolist(), strict=True)
        for side in corner.sides
    ]
    walls, narrow = step.association.predicted, [rcds[k] for k in features.narrow]
    places = np.concatenate([_middles(walls), corners, _middles(narrow)])
    distances = [step.reliability.rcds[wall.rcd].distance for wall in features.walls]
    words = (
        [f"wall {k}: {distance:.2f} m" for k, distance in enumerate(distances)]
        + ["corner"] * len(corners)
        + ["narrow"] * len(narrow)
    )
    return {
        "robot": Strips(robot(predicted, radius_m), [BLACK], 1.5),
        "sides": Strips([dash for line in sides for dash in dashed(line, 0.05)], [VERMILLION], 1.0),
        "distances": Strips([np.array([(predicted.x, predicted.y), wall.middle]) for wall in walls], [GREY], 1.0),
        "walls": Strips(lines(walls), [BLACK], 5.0),
        "narrow": Strips(lines(narrow), [ORANGE], 2.0),
        "corners": Strips(diamonds(corners, 0.09), [VERMILLION], 2.5),
        "names": Labels(places, tuple(words)),
    }


def _association(step: Step) -> dict[str, Shape]:
    """Each wall where it was predicted, and a line to the member of the chain by which it joined, with words."""
    association, chains = step.association, step.state.chains
    walls = association.predicted
    members = [chains.members[link.member].segment for link in association.links]
    links = [np.array([walls[link.wall].middle, m.middle]) for link, m in zip(association.links, members, strict=True)]
    words = [
        f"wall {link.wall} → chain {link.chain}: d1 {100 * link.d1:.1f} cm, a1 {np.degrees(link.a1):.1f}°"
        for link in association.links
    ]
    ids = {member.chain for member in chains.members if member.sweep == len(step.state.poses) - 1}
    new = sorted(ids - {link.chain for link in association.links})
    words += [f"wall {k} → new chain {chain}" for k, chain in zip(association.unlinked, new, strict=False)]
    places = [walls[link.wall].middle for link in association.links] + [walls[k].middle for k in association.unlinked]
    return {
        "members": Strips(lines(members), [chain_colour(link.chain) for link in association.links], 8.0),
        "walls": Strips(lines(walls), [WINE], 3.0),
        "links": Strips([part for link in links for part in arrow(*link)], [BLACK], 1.5),
        "new": Strips([dash for k in association.unlinked for dash in dashed(lines([walls[k]])[0])], [BLACK], 6.0),
        "names": Labels(np.array(places).reshape(-1, 2), tuple(words)),
    }


def _localisation(step: Step, radius_m: float) -> dict[str, Shape]:
    """The pose and the walls before (dashed) and after, the roots they were laid on, and the correction ten times."""
    found, predicted = step.localisation, step.calibrated.predicted
    links, chains = step.association.links, step.state.chains
    shift = EXAGGERATED * np.array([found.pose.x - predicted.x, found.pose.y - predicted.y])
    start = np.array([predicted.x, predicted.y])
    turn = found.pose.theta - predicted.theta
    turn_deg = (np.degrees(turn) + 180.0) % 360.0 - 180.0
    length_cm = 100.0 * float(np.hypot(*shift)) / EXAGGERATED
    words = f"{length_cm:.1f} cm, {turn_deg:+.1f}°" if found.walls_used else "prediction kept"
    before = [*robot(predicted, radius_m), *lines(step.association.predicted)]
    roots = [chains.root(link.chain) for link in links]
    return {
        "roots": Strips(lines(roots), [chain_colour(link.chain) for link in links], 8.0),
        "after": Strips([*robot(found.pose, radius_m), *lines(step.posed.walls)], [GREEN], 3.0),
        "before": Strips([dash for line in before for dash in dashed(line, 0.05)], [WINE], 2.0),
        "correction_x10": Strips(arrow(start, start + shift), [VERMILLION], 3.0),
        "name": Labels(predicted.points(np.array([[-3.0 * radius_m, 0.0]])), (words,)),
    }


def _recomputed(step: Step, radius_m: float) -> dict[str, Shape]:
    echo = step.calibrated.beams.echo
    before, after = _echoes(step, step.calibrated.predicted)[echo], step.posed.echoes[echo]
    return {
        "before": Dots(before, GREY, 1.5),
        "moved": Strips(_pairs(before, after), [GREY], 1.0),
        "after": Dots(after, BLUE, 2.5),
        "walls": Strips(lines(step.posed.walls), [BLACK], 3.0),
        "robot": Strips(robot(step.pose, radius_m), [GREEN], 2.5),
    }


def _extension(step: Step) -> dict[str, Shape]:
    """What the sweep added to the map: raised cells filled, lowered ones in a chequered pattern."""
    patch, cell_m = step.patch, step.state.grid.cell_m
    height, width = patch.delta.shape
    change = np.zeros((height, width, 4), dtype=np.uint8)
    chequer = (np.add.outer(np.arange(height) + patch.bottom, np.arange(width) + patch.left) % 2) == 0
    change[patch.delta > 0] = RAISED
    change[(patch.delta < 0) & chequer] = LOWERED
    if not change.size:
        change = np.zeros((1, 1, 4), dtype=np.uint8)
    return {"patch": Raster(change, patch.left * cell_m, patch.bottom * cell_m, cell_m)}


def _decision(step: Step, radius_m: float) -> dict[str, Shape]:
    """The largest frontier regions, the chosen one (×, named) and the way to it."""
    decision = step.decision
    named = [k for k in range(min(NAMED_REGIONS, len(decision.regions))) if k != decision.chosen]
    named += [] if decision.chosen is None else [decision.chosen]
    centres = np.array([decision.regions[k].centre for k in named]).reshape(-1, 2)
    words = [
        f"{decision.regions[k].gain_m2:.1f} m² to see" + (", the goal" if k == decision.chosen else "") for k in named
    ]
    goal = centres[len(centres) - (decision.chosen is not None) :]
    return {
        "regions": Strips(diamonds(centres, 0.15), [ORANGE], 2.5),
        "goal": Strips(crosses(goal, 0.25, upright=False), [VERMILLION], 4.0),
        "leg": Strips(diamonds(decision.path[decision.leg : decision.leg + 1], 0.12), [VERMILLION], 3.0),
        "path": Strips([decision.path] if len(decision.path) > 1 else [], [VERMILLION], 2.5),
        "robot": Strips(robot(step.pose, radius_m), [GREEN], 2.5),
        "names": Labels(centres, tuple(words)),
    }


def _echoes(step: Step, pose: Pose) -> Floats:
    """Where the beams end on their axes (n, 2), from this pose."""
    beams = step.calibrated.beams
    reach = beams.origin + beams.distance[:, None] * np.column_stack([np.cos(beams.axis), np.sin(beams.axis)])
    return pose.points(reach)


def _as_predicted(step: Step, segments: tuple[Segment, ...]) -> list[Segment]:
    """Segments of the corrected pose as they lay at the predicted one."""
    back = step.calibrated.predicted.compose(step.posed.pose.step_to(ORIGIN))
    return [piece.moved(back) for piece in segments]


def _middles(segments: tuple[Segment, ...] | list[Segment]) -> Floats:
    return np.array([piece.middle for piece in segments]).reshape(-1, 2)


def _pairs(starts: Floats, ends: Floats) -> list[Floats]:
    return list(np.stack([starts, ends], axis=1))
