"""Export: a recording or a run, whichever the file is, in the form that is asked for.

docs/export.md says what each form holds and who reads it. Must not know: command lines, printing.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from sonarlog.exports.carmen import carmen_lines
from sonarlog.exports.csv import csv_lines
from sonarlog.exports.files import CannotExport, NotExported, check_free, write_lines, writing
from sonarlog.exports.ros_map import write_map, write_true_map
from sonarlog.exports.tables import log_json, pose_lines, run_json, wall_lines
from sonarlog.exports.tum import WhichPath, log_tum, run_tum
from sonarlog.mcap_file import McapReader, Watch
from sonarlog.recording import read_log
from sonarlog.runs import read_run
from sonarlog.scores import draw_runs
from sonarlog.sweeps import cut

SUFFIXES = {
    "csv": ".csv", "tum": ".tum", "carmen": ".log", "map": ".yaml", "png": ".png", "walls": ".walls.csv",
    "json": ".json",
}  # fmt: skip
READ = 70
"""So much of a hundred parts of the work is reading a recording; the rest is writing it."""
OF_A_RECORDING = ("csv", "carmen", "tum", "map", "json")
OF_A_RUN = ("csv", "tum", "map", "png", "walls", "json")


@dataclass(frozen=True)
class Asked:
    """What is to be exported: the form, which path where that is a choice (None: the first there is), where to.

    Raises CannotExport if these do not go together.
    """

    file: Path
    form: str
    which: WhichPath | None = None
    output: Path | TextIO | None = None
    force: bool = False

    def __post_init__(self) -> None:
        if self.form in ("map", "png") and not isinstance(self.target, Path):
            raise CannotExport(f"--format {self.form} is no text: name a file with -o")
        if self.form == "map" and self.made[0].suffix not in (".yaml", ".yml"):
            raise CannotExport(f"{self.made[0]}: the sheet of a map ends in .yaml; its image is put beside it")
        if self.which is not None and self.form != "tum":
            raise CannotExport("--path goes with --format tum alone; the other forms hold every path there is")

    @property
    def target(self) -> Path | TextIO:
        """Where to: as asked, else in the working folder by the file's name."""
        if self.output is not None:
            return self.output
        stem = self.file.name.removesuffix(".mcap").removesuffix(".run")
        return Path(stem + (f".{self.which}" if self.which else "") + SUFFIXES[self.form])

    @property
    def made(self) -> list[Path]:
        """The files that come of it, the one to open first; none for a stream."""
        if not isinstance(self.target, Path):
            return []
        return [self.target, self.target.with_suffix(".pgm")] if self.form == "map" else [self.target]


def export_file(asked: Asked, watch: Watch | None = None) -> tuple[str, ...]:
    """Write a recording or a run in the form that is asked for; in sentences, what is not in it.

    `watch` hears how many of a hundred parts of a recording are done.

    Raises NotExported, CannotExport, CannotDraw, and what reading the file raises.
    """
    is_run = "run" in McapReader(asked.file).metadata
    if is_run and asked.form not in OF_A_RUN:
        raise NotExported(
            f"{asked.file} is a run, which holds no readings: export the recording as {asked.form}, "
            f"or the run as one of {', '.join(OF_A_RUN)}"
        )
    if not is_run and asked.form not in OF_A_RECORDING:
        raise NotExported(
            f"{asked.file} is a recording, which has no {asked.form}: replay it and export the run, "
            f"or the recording as one of {', '.join(OF_A_RECORDING)}"
        )
    check_free(asked.made, force=asked.force)
    if not is_run:
        return _recording(asked, watch or (lambda _done, _count: None))
    _run(asked)
    return ()


def _run(asked: Asked) -> None:
    run = read_run(asked.file)
    if asked.form == "map":
        with writing(asked.made):
            write_map(run.grid, asked.made[1], asked.made[0])
    elif asked.form == "png":
        draw_runs([("", run)], asked.made[0], force=asked.force)
    else:
        lines: dict[str, Callable[[], Iterable[str]]] = {
            "csv": lambda: pose_lines(run),
            "walls": lambda: wall_lines(run),
            "json": lambda: run_json(run),
            "tum": lambda: run_tum(run, asked.which or "final"),
        }
        write_lines(lines[asked.form](), asked.target)


def _recording(asked: Asked, watch: Watch) -> tuple[str, ...]:
    log = read_log(asked.file, watch=lambda done, count: watch(READ * done // count, 100))
    if asked.form == "map":
        if log.surfaces is None or log.truth is None:
            raise NotExported(f"{asked.file} does not know its true surfaces: replay it, and export the run's map")
        with writing(asked.made):
            write_true_map(log.surfaces, log.truth.pose[:, :2], asked.made[1], asked.made[0])
        return log.missing
    lines: dict[str, Callable[[], Iterable[str]]] = {
        "csv": lambda: csv_lines(log),
        "json": lambda: log_json(log),
        "carmen": lambda: carmen_lines(log, cut(log).sweeps if len(log.odometry.t_ns) else ()),
        "tum": lambda: log_tum(asked.file, log, asked.which or "odometry"),
    }
    most = max(1, len(log.odometry.t_ns) + len(log.readings.t_ns))
    write_lines(
        lines[asked.form](), asked.target, lambda line: watch(READ + (100 - READ) * min(line, most) // most, 100)
    )
    breaks = int(log.odometry.session.max(initial=0))
    if asked.form in ("csv", "carmen", "tum") and breaks:
        return (
            *log.missing,
            f"odometry starts anew {'once' if breaks == 1 else f'{breaks} times'} in {asked.file}; "
            f"{asked.form} cannot say where: json can",
        )
    return log.missing
