"""Does a sweep take longer as the log gets longer? A tour of a large building, recorded once, replayed with a clock.

    python -m benchmarks.long_log FOLDER                   # 1 km: half an hour to record, a minute or two to replay
    python -m benchmarks.long_log FOLDER --metres 200      # the same tour's beginning

The recording stays in FOLDER (outside of git: some 30 MB) and is used again; one that was broken off is begun anew.
"""

import argparse
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np

from benchmarks.blocks import Times, measure
from benchmarks.building import STATION_M, Building
from benchmarks.speed import BLOCKS
from slam.algorithms import DEFAULT, algorithm

AROUND = 40
"""A sweep's time is the median of so many: one alone may have a chunk of the file to write, or a loop to close."""

CLOSING = 10.0
"""A sweep whose block F takes so many times the median has closed a loop."""

EVERY = 100
MARKS = (100, 300, 500, 800, 1000)
COLUMNS = f"sweep | algorithm | {' | '.join(BLOCKS)} | E + F | all"


def recording(folder: Path, metres: float) -> Path:
    """The recording of the tour's first metres, made if it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    path, world = folder / f"building-{metres:.0f}.mcap", folder / "building.toml"
    if not path.exists():
        world.write_text(Building().toml(metres), encoding="utf-8")
        stations = max(1, round(metres / STATION_M))
        route = f"repeat {stations} (scan; follow {STATION_M})"
        port = f"sim://{world}?seed=1"
        command = ["-m", "cli", "record", "--port", port, "--lean", "--force", "-o", str(path), "--route", route]
        subprocess.run([sys.executable, *command], check=True)
    return path


def at(times: list[float], sweep: int) -> float:
    """Milliseconds a sweep, around that one."""
    near = times[max(0, sweep - AROUND // 2) : sweep + AROUND // 2]
    return 1000.0 * float(np.median(near))


class Told:
    """What is said every so many sweeps, and the memory that the process had after each."""

    def __init__(self) -> None:
        self.mb: list[float] = []

    def __call__(self, number: int, times: Times) -> None:
        """After a sweep."""
        self.mb.append(resident_mb())
        if number % EVERY == EVERY - 1:
            blocks = ", ".join(
                f"{name} {1000.0 * np.median(each[-AROUND:]):.1f}" for name, each in times.blocks.items()
            )
            text = f"sweep {number + 1}: {at(times.whole, number):.1f} ms, {self.mb[-1]:.0f} MB ({blocks})"
            print(text, file=sys.stderr, flush=True)


def resident_mb() -> float:
    """Memory that the process has now, where the system tells; else the most that it ever had."""
    pages = Path("/proc/self/statm")
    if pages.exists():
        return int(pages.read_text(encoding="ascii").split()[1]) * resource.getpagesize() / 1e6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main(arguments: list[str]) -> None:
    """Record, replay, and print what grew."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.long_log")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--metres", type=float, default=1000.0)
    parser.add_argument("--algorithm", action="append", help="Several may be given; paper and the default if none is.")
    parser.add_argument("--sweeps", type=int, default=None, help="Replay so many only.")
    asked = parser.parse_args(arguments)
    path = recording(asked.folder, asked.metres)
    tables = [replayed(path, name, asked.sweeps) for name in asked.algorithm or ["paper", DEFAULT]]
    print(f"\n| {COLUMNS} |\n|" + "---|" * (COLUMNS.count("|") + 1))
    print("\n".join(line for table in tables for line in table))


def replayed(path: Path, name: str, sweeps: int | None) -> list[str]:
    """Replay, say what else is worth saying, and return the table's rows."""
    run = path.with_name(f"{path.stem}.{name}.run.mcap")
    told = Told()
    times, step = measure(path, algorithm(name), run, sweeps=sweeps, each=told)
    count, cell = len(times.whole), step.state.grid.cell_m
    _, _, width, height = step.state.grid.bounds()
    first, last = told.mb[0], told.mb[-1]
    print(
        f"{name}: {count} sweeps, {width * cell:.0f} × {height * cell:.0f} m, {len(step.state.chains.members)} walls; "
        f"reading and cutting {times.reading:.1f} s; {run.stat().st_size / count / 1000:.0f} kB of run a sweep; "
        f"{first:.0f} MB after the first sweep, {1000.0 * (last - first) / count:.0f} MB more per 1000 sweeps"
    )
    rows = {**{key: times.blocks[key] for key in BLOCKS}, "E + F": both(times, "EF"), "all": times.whole}
    closing = [taken for taken in rows["F"] if taken > CLOSING * float(np.median(rows["F"]))]
    if closing:
        each_ms = 1000.0 * float(np.median(closing))
        print(f"{name}: block F closes loops in {len(closing)} sweeps, {each_ms:.0f} ms each")
    marks = [mark for mark in MARKS if mark + AROUND // 2 <= count]
    return [f"| {mark} | {name} | {' | '.join(f'{at(each, mark):.1f}' for each in rows.values())} |" for mark in marks]


def both(times: Times, names: str) -> list[float]:
    """Seconds of these blocks together."""
    return [sum(taken) for taken in zip(*(times.blocks[name] for name in names), strict=True)]


if __name__ == "__main__":
    main(sys.argv[1:])
