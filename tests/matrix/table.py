"""The matrix: every configuration's outcome against the first one's, and the tables that say so."""

import json
import os
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from sonarlog.digest import digest
from tests.matrix.configurations import Configuration

SAME, DIFFERS, IDLE, SKIPPED, FAILED = "same", "DIFFERS", "TESTS NOTHING", "skipped", "FAILED"


@dataclass(frozen=True)
class Outcome:
    """What a configuration came to. `changed` are the canaries that differ from the first configuration's."""

    name: str
    verdict: str
    facts: dict[str, str] = field(default_factory=dict)
    changed: tuple[str, ...] = ()
    results: dict[str, str] = field(default_factory=dict)
    why: str = ""

    @property
    def well(self) -> bool:
        """Whether it proves something, or could not be had."""
        return self.verdict in {SAME, SKIPPED}


def outcomes(configurations: list[Configuration], arguments: list[str], slow: list[str]) -> Iterator[Outcome]:
    """Run the probe in every configuration; the slow ones get their own arguments, a part of the work."""
    first: dict[str, dict[str, str]] | None = None
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        # The slow ones begin first, and are told in their turn.
        order = sorted(configurations, key=lambda each: not each.slow)
        jobs = {each.name: pool.submit(_probed, each, slow if each.slow else arguments) for each in order}
        for each in configurations:
            made = jobs[each.name].result()
            if isinstance(made, str):
                yield Outcome(each.name, SKIPPED if each.skipped else FAILED, why=made)
            else:
                first = first or made
                yield _judged(each, made, first)


def _probed(each: Configuration, arguments: list[str]) -> dict[str, dict[str, str]] | str:
    """What the probe says, or why it says nothing."""
    if each.skipped:
        return each.skipped
    try:
        made: dict[str, dict[str, str]] = json.loads(each.run(arguments))
    except subprocess.CalledProcessError as error:
        lines = error.stderr.strip().splitlines()
        return lines[-1] if lines else "no output"
    return made


def _judged(each: Configuration, made: dict[str, dict[str, str]], first: dict[str, dict[str, str]]) -> Outcome:
    changed = tuple(name for name, value in made["canaries"].items() if value != first["canaries"][name])
    idle = [name for name in each.claims if name not in changed]
    off = [name for name, value in made["results"].items() if value != first["results"][name]]
    verdict, why = SAME, ""
    if off:
        verdict, why = DIFFERS, "; ".join(off)
    elif idle:
        verdict, why = IDLE, f"the canaries {', '.join(idle)} did not change"
    return Outcome(each.name, verdict, made["facts"], changed, made["results"], why)


def page(found: list[Outcome]) -> str:
    """Both tables as Markdown: configurations and verdicts, then what was computed with its digest."""
    base = found[0].results
    lines = [
        "| configuration | Python | numpy | machine | arithmetic that changed | results | digest of all |",
        "|---|---|---|---|---|---|---|",
    ]
    for each in found:
        told = f"{each.verdict}: {each.why}" if each.why else each.verdict
        count = f"{len(each.results)} of {len(base)}, " if 0 < len(each.results) < len(base) else ""
        facts = [each.facts.get(name, "") for name in ("python", "numpy", "machine")]
        # A part of the work is compared with the same part of the first's: its digest stands for the whole.
        whole = {**base, **each.results} if each.results else {}
        cells = [each.name, *facts, ", ".join(each.changed), count + told, f"`{digest(whole)}`" if whole else ""]
        lines.append(f"| {' | '.join(cells)} |")
    lines += ["", "| computed | digest |", "|---|---|"]
    lines += [f"| {name} | `{made}` |" for name, made in base.items()]
    return "\n".join(lines)
