"""Thresholds on the figures of a report: what is too much, and why. Must not know: how reports are made."""

import operator
import re
from dataclasses import dataclass

from sonarlog.diff.figures import Figure, figures
from sonarlog.diff.report import Report
from sonarlog.errors import SonarlogError

OPERATORS = {">": operator.gt, ">=": operator.ge, "<": operator.lt, "<=": operator.le}
_CONDITION = re.compile(r"\s*([a-z][a-zA-Z0-9_.]*)\s*([<>]=?)\s*([+-]?)([0-9]*\.?[0-9]+)\s*(%?)\s*")


class BadCondition(SonarlogError):
    """No threshold is written so, or there is no such figure."""


@dataclass(frozen=True)
class Condition:
    """A figure, and what it must not be: `cells.changed>1%`, `walls.gone>0`; with a sign how it changed: `ate>+5%`.

    A figure that each side has its own of is B's, unless a sign asks for its growth from A to B: by a part of A's (%),
    or in its own unit.
    """

    text: str
    name: str
    comparison: str
    number: float
    signed: bool
    percent: bool

    @classmethod
    def parse(cls, text: str) -> "Condition":
        """Raises BadCondition."""
        found = _CONDITION.fullmatch(text)
        if found is None:
            raise BadCondition(f"a condition is written as in 'ate>+5%' or 'walls.gone>0', not {text!r}")
        name, comparison, sign, number, percent = found.groups()
        return cls(text.strip(), name, comparison, float(sign + number), bool(sign), bool(percent))

    def reason(self, report: Report) -> str | None:
        """Why the report is too much; None if it is not. Raises BadCondition for a figure that it does not have."""
        known = figures(report)
        if self.name not in known:
            why = "" if report.truth is not None else "; without a truth there are no errors to judge"
            if self.name.startswith("time") and report.times is None:
                why = "; times must be kept in both runs, and older versions keep none"
            raise BadCondition(f"{self.text!r}: there is no figure {self.name!r}{why}; there are {', '.join(known)}")
        figure = known[self.name]
        value = self._judged(figure)
        return self._said(figure) if OPERATORS[self.comparison](value, self.number) else None

    def _judged(self, figure: Figure) -> float:
        if not self.signed:
            if self.percent and figure.unit != "%":
                raise BadCondition(f"{self.text!r}: {self.name} is no share; its growth is {self.name}>+5%")
            return figure.value
        if figure.sides is None:
            raise BadCondition(f"{self.text!r}: {self.name} is of both sides and has no growth: leave the sign")
        a, b = figure.sides
        if not self.percent or figure.unit == "%":
            return b - a
        growth = figure.growth
        return float("inf") if growth is None else 100 * growth

    def _said(self, figure: Figure) -> str:
        unit = f" {figure.unit}" if figure.unit else ""
        if figure.sides is None or not self.signed:
            return f"{self.text}: {self.name} is {figure.value:.4g}{unit}"
        a, b = figure.sides
        grown = "" if figure.growth is None else f" ({100 * figure.growth:+.1f} %)"
        return f"{self.text}: {self.name} went from {a:.4g} to {b:.4g}{unit}{grown}"


def is_condition(text: str) -> bool:
    """Whether a word of the command line is a condition rather than a file."""
    return _CONDITION.fullmatch(text) is not None
