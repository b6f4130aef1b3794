"""The pipeline while the robot drives: sweep after sweep into steps, and each decision as it is recorded.

Must not know: how the robot is driven, files.
"""

import json
from dataclasses import asdict, dataclass
from math import degrees, hypot
from typing import Any

from slam import pipeline
from slam.algorithms import Algorithm
from slam.config import settings
from slam.pipeline import Step
from slam.sweep import Sweep
from sonarlog.digest import RunDigest
from sonarlog.robot import Robot


@dataclass(frozen=True)
class Asked:
    """Who decided: the algorithm, its version and its settings."""

    algorithm: str
    algorithm_version: int
    config: dict[str, Any]

    @classmethod
    def of(cls, algorithm: Algorithm) -> "Asked":
        """The algorithm as it is set."""
        return cls(algorithm.name, algorithm.version, settings(algorithm.config))


class DecisionChain:
    """The digests of an exploration as it grows: those of a run but for the recording, which is not complete yet."""

    def __init__(self, asked: Asked) -> None:
        self._digest = RunDigest(asdict(asked))

    def add(self, step: Step) -> str:
        """Take a step in; the chain up to here, this step's decision included."""
        self._digest.add(step)
        return self._digest.chain


def described(step: Step) -> str:
    """What was seen, how far the pose was off, where to go and why."""
    decision = step.decision
    moved = step.calibrated.predicted.step_to(step.pose)
    seen = f"{len(step.features.walls)} walls, {len(step.association.links)} known"
    corrected = f"corrected by {100 * hypot(moved.x, moved.y):.0f} cm, {degrees(moved.theta):+.1f}°"
    if decision.chosen is None:
        return f"{seen}; {corrected}; nowhere to go"
    region = decision.regions[decision.chosen]
    x, y = region.centre
    why = f"{decision.gain_m2:.1f} m² to see for {decision.length_m:.1f} m"
    return f"{seen}; {corrected}; to the frontier at ({x:.1f}, {y:.1f}) m, {why}"


class Mapper:
    """Steps of one exploration; `step` is the last one."""

    def __init__(self, robot: Robot, algorithm: Algorithm) -> None:
        self.step: Step | None = None
        self.count = 0
        self._ring = robot.ring()
        self._algorithm = algorithm
        self._asked = Asked.of(algorithm)
        self._chain = DecisionChain(self._asked)
        self._state = pipeline.first_state(self._ring, algorithm)

    def take(self, sweep: Sweep) -> tuple[Step, str]:
        """The step that the sweep makes, and its decision as JSON."""
        step = pipeline.step(self._state, sweep, self._ring, self._algorithm)
        self._state, self.step = step.state, step
        text = self._told(step)
        self.count += 1
        return step, text

    def _told(self, step: Step) -> str:
        decision = step.decision
        told: dict[str, Any] = {
            "decision": self.count,
            "t_ns": int(step.sweep.t_ns[step.sweep.reference]),
            "pose": [step.pose.x, step.pose.y, step.pose.theta],
            "goal": None if decision.chosen is None else list(decision.regions[decision.chosen].centre),
            "regions": len(decision.regions),
            "path": decision.path.tolist(),
            "leg": decision.leg,
            "why": described(step),
            "chain": self._chain.add(step),
        }
        if self.count == 0:
            told["asked"] = asdict(self._asked)
        return json.dumps(told)
