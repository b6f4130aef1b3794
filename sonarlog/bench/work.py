"""One job of the bench: a recording, replayed with each algorithm, and each result held against the truth.

What was done before is found under a name that is its content. Must not know: other jobs, processes.
"""

import hashlib
import json
import os
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import slam
import sonarlog
from slam.config import settings
from sonarlog.bench.plan import Case, Contender
from sonarlog.digest import digest
from sonarlog.errors import SonarlogError
from sonarlog.evaluation import evaluate, reference_of_run, track_of_run
from sonarlog.replay import replay
from sonarlog.runs import Run, read_run
from sonarlog.scores import draw_runs

Measures = dict[str, float]
"""Of one replay, by name: errors in metres and degrees, `…_ratio` to raw odometry, shares of the map, milliseconds.

docs/evaluation.md says what each means; `online_…` is of the poses as they were found, `raw_…` of raw odometry,
`aligned_…` of the map after the best alignment.
"""

_JUDGES = (
    "decode.py",
    "odometer.py",
    "evaluation.py",
    "map_metrics.py",
    "metrics.py",
    "raster.py",
    "replay.py",
    "scores.py",
    "sweeps.py",
    "truth.py",
)
"""Sources that the measures hang on, beside the algorithm itself."""


@dataclass(frozen=True)
class Folder:
    """Where recordings and results are kept."""

    path: Path

    def recording(self, name: str) -> Path:
        """The recording of that recipe."""
        return self.path / "recordings" / f"{name}.mcap"

    def result(self, name: str, contender: Contender) -> Path:
        """What that algorithm made of that recording."""
        chosen = contender.algorithm
        made_of = (name, chosen.name, chosen.version, settings(chosen.config), judges_digest())
        return self.path / "results" / f"{name}-{chosen.name}-{digest(made_of)[:16]}.json"

    def picture(self, name: str, contenders: tuple[Contender, ...]) -> Path:
        """The maps that these algorithms made of that recording."""
        results = [self.result(name, contender).name for contender in contenders]
        return self.path / "pictures" / f"{name}-{digest(results)[:16]}.png"

    def make(self) -> None:
        """Have it there."""
        for inner in ("recordings", "results", "pictures"):
            (self.path / inner).mkdir(parents=True, exist_ok=True)


@dataclass(frozen=True)
class Job:
    """One recording, of that name, and who replays it."""

    folder: Folder
    name: str
    case: Case
    contenders: tuple[Contender, ...]


@dataclass(frozen=True)
class Outcome:
    """What a contender made of a recording: measures, or the sentence that says why there are none."""

    label: str
    measures: Measures | None = None
    error: str = ""


def known(job: Job) -> list[Outcome]:
    """What was found out before, of this job's contenders."""
    outcomes = []
    for contender in job.contenders:
        path = job.folder.result(job.name, contender)
        if path.exists():
            outcomes.append(Outcome(contender.label, json.loads(path.read_text(encoding="utf-8"))))
    return outcomes


def work(job: Job, clock: Callable[[], float] = time.process_time) -> list[Outcome]:
    """Do what is missing of the job. An error is the outcome of those it concerns; it is tried again next time."""
    try:
        recording = recorded(job)
    except Exception as error:
        return [Outcome(contender.label, error=_sentence(error)) for contender in job.contenders]
    outcomes = []
    for contender in job.contenders:
        path = job.folder.result(job.name, contender)
        try:
            measures = _measured(recording, contender, clock)
        except Exception as error:
            outcomes.append(Outcome(contender.label, error=_sentence(error)))
            continue
        part = path.with_suffix(f".{os.getpid()}.part")
        part.write_text(json.dumps(measures, allow_nan=False), encoding="utf-8")
        part.replace(path)
        outcomes.append(Outcome(contender.label, measures))
    return outcomes


def recorded(job: Job) -> Path:
    """The job's recording, made if it is not there. Raises what recording raises."""
    path = job.folder.recording(job.name)
    if not path.exists():
        job.case.recipe().make(path)
    return path


def draw(job: Job) -> Path:
    """The picture of all the job's maps side by side, drawn if it is not there. Raises what replaying raises."""
    picture = job.folder.picture(job.name, job.contenders)
    if not picture.exists():
        recording = recorded(job)
        with TemporaryDirectory(prefix="sonarlog-") as folder:
            runs = [(each.label, _run(recording, each, Path(folder) / f"{n}.run.mcap")) for n, each in
                    enumerate(job.contenders)]  # fmt: skip
            part = picture.with_suffix(f".{os.getpid()}.part")
            draw_runs(runs, part, force=True)
            part.replace(picture)
    return picture


def _measured(recording: Path, contender: Contender, clock: Callable[[], float]) -> Measures:
    with TemporaryDirectory(prefix="sonarlog-") as folder:
        begin = clock()
        output = Path(folder) / "it.run.mcap"
        replay(recording, contender.algorithm, output)
        seconds = clock() - begin
        run = read_run(output)
    judged = evaluate(track_of_run(run), reference_of_run(run))
    found: dict[str, float | None] = {}
    for prefix, errors in (("", judged.path), ("online_", judged.online), ("raw_", judged.odometry)):
        found |= {prefix + name: value for name, value in (asdict(errors) if errors else {}).items()}
    for prefix, ratios in (("", judged.ratio), ("online_", judged.online_ratio)):
        found |= {f"{prefix}{name}_ratio": value for name, value in (ratios or {}).items()}
    for prefix, shares in (("", judged.map), ("aligned_", judged.map_aligned)):
        found |= {prefix + name: value for name, value in (asdict(shares) if shares else {}).items()}
    found["bent_m"] = judged.straightness_m
    found |= {"sweeps": len(run.sweeps), "ms_per_sweep": 1000 * seconds / len(run.sweeps)}
    return {name: float(value) for name, value in found.items() if isinstance(value, int | float)}


def _run(recording: Path, contender: Contender, output: Path) -> Run:
    replay(recording, contender.algorithm, output)
    return read_run(output)


def _sentence(error: Exception) -> str:
    """What went wrong, in a line; of a bug of ours its kind too."""
    text = " ".join(str(error).split()) or "no reason given"
    return text if isinstance(error, SonarlogError) else f"{type(error).__name__}: {text}"


@cache
def judges_digest() -> str:
    """Digest of the algorithms' code and of what judges it."""
    home, algorithms = Path(sonarlog.__file__).parent, Path(slam.__file__).parent
    state = hashlib.blake2b(digest_size=16)
    for path in [*sorted(algorithms.rglob("*.py")), *(home / name for name in _JUDGES)]:
        state.update(path.name.encode() + path.read_bytes())
    return state.hexdigest()
