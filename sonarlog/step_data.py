"""A step in plain values: what a run keeps of it for people and other programs, and how walls come back from it.

Positions in metres, angles in radians, all in the map frame unless a key says otherwise.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from slam.association import Chains, Member
from slam.frontier import Decision
from slam.geometry import Pose, Segment
from slam.pipeline import State, Step
from slam.reliability import ALONE, IN_RCD, NEAR_RCD, NO_ECHO

CLASSES = {"no_echo": NO_ECHO, "in_rcd": IN_RCD, "near_rcd": NEAR_RCD, "alone": ALONE}


def step_data(step: Step, index: int) -> dict[str, Any]:
    """Plain values of one step, ready for JSON; the inverse for walls is `chains_of`."""
    reliability, localisation = step.reliability, step.localisation
    return {
        "sweep": index,
        "kind": step.sweep.kind,
        "t_ns": int(step.sweep.t_ns[step.sweep.reference]),
        "readings": {
            "all": len(step.sweep),
            **{name: int(np.count_nonzero(reliability.reading_class == c)) for name, c in CLASSES.items()},
            "too_near": step.calibrated.too_near,
        },
        "odometry": pose_data(step.calibrated.odometry),
        "predicted": pose_data(step.calibrated.predicted),
        "pose": pose_data(step.pose),
        "calibration": {
            "rotation_scale": step.calibrated.calibration.rotation_scale,
            "mounting": list(step.calibrated.calibration.mounting),
            "distance_scale": step.state.calibration.distance_scale,
            "drift": step.state.calibration.drift,
            "ring_bearing": step.state.calibration.ring_bearing,
        },
        "rcds": [
            {
                "bearing": rcd.bearing,
                "distance": rcd.distance,
                "width": rcd.width,
                "spread": rcd.spread,
                "sonars": rcd.sonars,
                "strong": rcd.strong,
            }
            for rcd in reliability.rcds
        ],
        "walls": _walls(step),
        "corners": [list(point) for point in step.posed.corners],
        "narrow": list(step.features.narrow),
        "localisation": {
            "turn_deg": localisation.turn_deg,
            "shift": list(localisation.shift),
            "mean_turn_deg": localisation.mean_turn_deg,
            "d1_before": localisation.d1_before,
            "d1_after": localisation.d1_after,
            "walls_used": localisation.walls_used,
            "moved": [[sweep, *pose_data(pose)] for sweep, pose in localisation.moved],
            "merged": [list(pair) for pair in localisation.merged],
        },
        "map": {
            "cells_raised": int(np.count_nonzero(step.patch.delta > 0)),
            "cells_lowered": int(np.count_nonzero(step.patch.delta < 0)),
        },
        "decision": _decision(step.decision),
    }


def pose_data(pose: Pose) -> list[float]:
    """[x, y, θ]."""
    return [pose.x, pose.y, pose.theta]


def pose_of(data: Sequence[float]) -> Pose:
    """The pose in [x, y, θ]."""
    x, y, theta = data
    return Pose(x, y, theta)


def _walls(step: Step) -> list[dict[str, Any]]:
    """This sweep's walls as they were chained: those of the last sweep in the chains, in order."""
    links = {link.wall: link for link in step.association.links}
    chains = step.state.chains
    members = chains.members[len(chains.members) - len(step.posed.walls) :]
    rows = []
    for k, (member, feature) in enumerate(zip(members, step.features.walls, strict=True)):
        link = links.get(k)
        rows.append(
            {
                "rcd": feature.rcd,
                "chain": member.chain,
                "joined": None if link is None else link.member,
                "d1": None if link is None else link.d1,
                "a1": None if link is None else link.a1,
                "gap": None if link is None else link.gap,
                "alpha": member.segment.alpha,
                "rho": member.segment.rho,
                "start": list(member.segment.start),
                "end": list(member.segment.end),
            }
        )
    return rows


def _decision(decision: Decision) -> dict[str, Any]:
    return {
        "frontier_cells": decision.frontier_cells,
        "regions": [
            {"cells": region.cells, "centre": list(region.centre), "gain_m2": region.gain_m2}
            for region in decision.regions
        ],
        "chosen": decision.chosen,
        "path": decision.path.tolist(),
        "leg": decision.leg,
        "length_m": decision.length_m,
        "blocks": [[block.x, block.y, block.times] for block in decision.blocks],
        "left": decision.left,
    }


def final_data(state: State) -> dict[str, Any]:
    """All poses and walls as they are known at the end, in plain values; the inverse is `final_of`."""
    walls = [
        {
            "chain": member.chain,
            "sweep": member.sweep,
            "nature": member.nature,
            "alpha": member.segment.alpha,
            "rho": member.segment.rho,
            "start": list(member.segment.start),
            "end": list(member.segment.end),
        }
        for member in state.chains.members
    ]
    return {"poses": [pose_data(pose) for pose in state.poses], "walls": walls, "roots": list(state.chains.roots)}


def final_of(data: Mapping[str, Any]) -> tuple[tuple[Pose, ...], Chains]:
    """The poses and chains in what `final_data` made."""
    members = [Member(wall["chain"], wall["sweep"], _segment(wall), wall["nature"]) for wall in data["walls"]]
    return tuple(pose_of(pose) for pose in data["poses"]), Chains(tuple(members), tuple(data["roots"]))


def _segment(wall: Mapping[str, Any]) -> Segment:
    (x0, y0), (x1, y1) = wall["start"], wall["end"]
    return Segment(wall["alpha"], wall["rho"], (x0, y0), (x1, y1))


def chains_of(steps: Sequence[Mapping[str, Any]]) -> Chains:
    """The chains that the walls of these steps make, in the order in which they joined."""
    members: list[Member] = []
    roots: list[int] = []
    for step in steps:
        for wall in step["walls"]:
            if wall["chain"] == len(roots):
                roots.append(len(members))
            members.append(Member(wall["chain"], step["sweep"], _segment(wall)))
    return Chains(tuple(members), tuple(roots))
