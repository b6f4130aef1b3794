"""What came of one comparison among several: a report, held against a gate, or why there is no report.

Must not know: how runs are had, printing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sonarlog.diff.gate import Condition
from sonarlog.diff.report import Report


@dataclass(frozen=True)
class Outcome:
    """`report`, or why there is none (`failed`); with a gate, `reasons` are the conditions that it does not keep."""

    name: str
    report: Report | None
    failed: str = ""
    gated: bool = False
    reasons: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """`same`, `within` the tolerance, `changed` or `failed`."""
        return "failed" if self.report is None else self.report.verdict

    @property
    def bad(self) -> bool:
        """Whether the command must say no: by the gate if there is one, else by any difference."""
        if self.report is None:
            return True
        return bool(self.reasons) if self.gated else self.verdict == "changed"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        head = {"name": self.name, "verdict": self.verdict, "bad": self.bad, "reasons": list(self.reasons)}
        return {**head, "failed": self.failed, "report": self.report and self.report.as_dict()}


def judged(name: str, report: Report, gate: Sequence[Condition]) -> Outcome:
    """The report held against the gate. Raises BadCondition."""
    reasons = [condition.reason(report) for condition in gate]
    return Outcome(name, report, "", bool(gate), tuple(reason for reason in reasons if reason))


def summary(outcomes: Sequence[Outcome]) -> str:
    """`11 changed, 5 the same, 0 failed`."""
    verdicts = [outcome.verdict for outcome in outcomes]
    within = verdicts.count("within")
    near = f", {within} the same within the tolerance" if within else ""
    changed, same, failed = (verdicts.count(each) for each in ("changed", "same", "failed"))
    return f"{changed} changed, {same} the same{near}, {failed} failed"
