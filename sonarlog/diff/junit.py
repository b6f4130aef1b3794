"""Outcomes as JUnit XML, which every CI server shows. Must not know: how outcomes came about."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from sonarlog.diff.outcome import Outcome
from sonarlog.errors import SonarlogError


class CannotReport(SonarlogError):
    """The report's file cannot be written."""


def junit(outcomes: Sequence[Outcome]) -> bytes:
    """One test case an outcome: a failure where it is bad, an error where nothing could be compared."""
    bad = sum(outcome.bad and outcome.report is not None for outcome in outcomes)
    counts = {"tests": len(outcomes), "failures": bad, "errors": sum(outcome.report is None for outcome in outcomes)}
    root = ElementTree.Element("testsuites")
    numbers = {name: str(count) for name, count in counts.items()}
    suite = ElementTree.SubElement(root, "testsuite", {"name": "sonarlog diff", **numbers})
    for outcome in outcomes:
        case = ElementTree.SubElement(suite, "testcase", classname="sonarlog.diff", name=outcome.name)
        if outcome.report is None:
            ElementTree.SubElement(case, "error", message=_clean(outcome.failed))
            continue
        if outcome.bad:
            why = "; ".join(outcome.reasons) or outcome.verdict
            ElementTree.SubElement(case, "failure", message=_clean(why)).text = _clean(outcome.report.headline)
        ElementTree.SubElement(case, "system-out").text = _clean(outcome.report.headline)
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"


def write_junit(outcomes: Sequence[Outcome], path: Path) -> None:
    """Write it, over what is there: CI makes it anew each time. Raises CannotReport."""
    try:
        path.write_bytes(junit(outcomes))
    except OSError as error:
        raise CannotReport(f"cannot write {path}: {error.strerror or error}") from None


def _clean(text: str) -> str:
    """Without the control characters that XML cannot hold."""
    return "".join(letter for letter in text if letter.isprintable() or letter == "\n")
