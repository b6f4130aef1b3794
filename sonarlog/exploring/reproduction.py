"""Whether a replay takes the decisions that a recorded exploration took, one by one and to the bit.

Must not know: how a replay is made, printing.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from slam.algorithms import Algorithm
from slam.pipeline import Step
from sonarlog.exploring.mapper import Asked, DecisionChain


@dataclass(frozen=True)
class Reproduced:
    """How many decisions are recorded, and which algorithm took them; `other` is the first that came out otherwise.

    `same_asked`: the replay was asked for the very same; only then must every decision come out the same.
    """

    decisions: int
    algorithm: str
    same_asked: bool
    other: int | None = None
    words: str = ""

    @property
    def same(self) -> bool:
        """Whether nothing speaks against it: decisions of another algorithm need not be reproduced."""
        return self.other is None or not self.same_asked

    def told(self) -> str:
        """In a sentence."""
        if self.other is None:
            return f"all {self.decisions} decisions of {self.algorithm} are reproduced"
        rest = f"; the {self.other} before are reproduced" if self.other else ""
        if self.same_asked:
            return f"decision {self.other}: {self.words}{rest}"
        return f"taken by {self.algorithm}; decision {self.other} would have been another: {self.words}{rest}"


class Reproduction:
    """Give it the steps of a replay in order, then ask for the result."""

    def __init__(self, decisions: Sequence[str], algorithm: Algorithm) -> None:
        self._told: list[dict[str, Any]] = [json.loads(text) for text in decisions]
        self._asked = Asked.of(algorithm)
        taken = self._told[0].get("asked") if self._told else None
        self._taken = f"{taken['algorithm']} {taken['algorithm_version']}" if taken else "an unknown algorithm"
        self._same = taken == json.loads(json.dumps(asdict(self._asked)))
        self._chain = DecisionChain(self._asked)
        self._count = 0
        self._other: int | None = None
        self._words = ""

    def add(self, step: Step) -> None:
        """The next step of the replay."""
        number, self._count = self._count, self._count + 1
        if self._other is not None or number >= len(self._told):
            return
        told = self._told[number]
        words = _apart(told, step)
        if self._same and self._chain.add(step) != told["chain"] and not words:
            words = "the same goal and way, but not from the same poses and map"
        if words:
            self._other, self._words = number, words

    def result(self) -> Reproduced | None:
        """None where no decision is recorded."""
        if not self._told:
            return None
        if self._other is None and self._count < len(self._told):
            self._other, self._words = self._count, "its sweep is not in the replay"
        return Reproduced(len(self._told), self._taken, self._same, self._other, self._words)


def _apart(told: dict[str, Any], step: Step) -> str:
    """In which way the decision is another one."""
    decision = step.decision
    goal = None if decision.chosen is None else list(decision.regions[decision.chosen].centre)
    if goal != told["goal"]:
        return f"it was to go {_to(told['goal'])}, and now is to go {_to(goal)}"
    if decision.path.tolist() != told["path"] or decision.leg != told["leg"]:
        return f"it was to go {_to(goal)} by another way"
    return ""


def _to(goal: list[float] | None) -> str:
    return "nowhere" if goal is None else f"to the frontier at ({goal[0]:.2f}, {goal[1]:.2f}) m"
