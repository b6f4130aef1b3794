"""The bench as a whole: from a plan to results and pictures, doing only what no earlier bench has done.

Must not know: terminals, how results are shown.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from sonarlog.bench import pool
from sonarlog.bench.page import Picture
from sonarlog.bench.plan import Case, Plan
from sonarlog.bench.results import Group, Results, results_of
from sonarlog.bench.work import Folder, Job, Outcome, draw, known, work

Advance = Callable[[int, int], None]


class Bench:
    """A plan, the folder in which its recordings and results are kept, and how many processes work on it."""

    def __init__(self, plan: Plan, folder: Path, processes: int) -> None:
        self._plan = plan
        self._folder = Folder(folder)
        self._processes = processes
        self._names: dict[Case, str] = {}

    def results(self, advance: Advance, *, only_known: bool = False) -> Results:
        """Do what is missing (with `only_known` nothing) and give all results. `advance` hears of every replay done."""
        self._folder.make()
        self._names = {case: case.recipe().name() for case in self._plan.cases()}
        # Cases that come to one recording, such as usual noise by another name, are one job.
        jobs = {name: Job(self._folder, name, case, self._plan.contenders) for case, name in self._names.items()}
        found = {name: known(job) for name, job in jobs.items()}
        missing = [] if only_known else [job for name, job in jobs.items() if len(found[name]) < len(job.contenders)]
        total = len(jobs) * len(self._plan.contenders)
        done = sum(map(len, found.values()))
        advance(done, total)
        todo = [_rest(job, found[job.name]) for job in missing]
        for job, outcome in pool.run(work, todo, self._processes):
            found[job.name] = [*found[job.name], *_each(job, outcome)]
            done += len(job.contenders)
            advance(done, total)
        return results_of(self._plan, ((case, found[name]) for case, name in self._names.items()))

    def pictures(self, results: Results, advance: Advance) -> list[Picture]:
        """Of every place the run nearest to the median and the worst one, of every other condition the worst."""
        chosen = _worth_seeing(results)
        jobs = {case: Job(self._folder, self._names[case], case, self._plan.contenders) for case, _ in chosen}
        drawn: dict[str, Path | Exception] = {}
        for job, path in pool.run(draw, list(jobs.values()), self._processes):
            drawn[job.name] = path
            advance(len(drawn), len(jobs))
        return [Picture(title, drawn[self._names[case]]) for case, title in chosen]


def _rest(job: Job, outcomes: Sequence[Outcome]) -> Job:
    """The job without those contenders who are known."""
    labels = {outcome.label for outcome in outcomes}
    return replace(job, contenders=tuple(each for each in job.contenders if each.label not in labels))


def _each(job: Job, outcome: list[Outcome] | Exception) -> list[Outcome]:
    """Of every contender; a process that died says nothing of them one by one."""
    if isinstance(outcome, Exception):
        return [Outcome(each.label, error=f"its process died: {outcome}") for each in job.contenders]
    return outcome


def _worth_seeing(results: Results) -> list[tuple[Case, str]]:
    """Cases with what to write over them, judged by the last contender of the plan."""
    first, *others = results.plan.conditions
    label = results.labels[-1]
    chosen: list[tuple[Case, str]] = []
    for place in results.places:
        group = results.group(place, first, label)
        if group is not None and "ate_m_ratio" in group.spreads:
            middle, worst = _median_case(group), group.spreads["ate_m_ratio"].worst_case
            chosen.append((middle, f"{_name(middle)}: the median run of {label}"))
            if worst != middle:
                chosen.append((worst, f"{_name(worst)}: the worst run of {label}"))
    for condition in others:
        groups = [results.group(place, condition, label) for place in results.places]
        known = [group.spreads["ate_m"] for group in groups if group is not None and "ate_m" in group.spreads]
        if known:
            case = max(known, key=lambda spread: spread.worst).worst_case
            chosen.append((case, f"{_name(case)}: {condition}, the worst run of {label}"))
    return chosen


def _median_case(group: Group) -> Case:
    middle = group.spreads["ate_m_ratio"].median
    rows = [row for row in group.rows if row.measures and "ate_m_ratio" in row.measures]
    return min(rows, key=lambda row: abs((row.measures or {})["ate_m_ratio"] - middle)).case


def _name(case: Case) -> str:
    return f"{case.world}, seed {case.seed}"
