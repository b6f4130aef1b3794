"""How fast a replay is: the whole command against bare reading of the file and real time, and each block's share.

    python -m benchmarks.speed [--algorithm graph …] [RECORDING…]

Seconds of processor time, which other programs disturb least: a replay is one thread, and alone on a machine takes as
long by the clock. The tables are those of docs/speed.md.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from mcap.reader import make_reader

from benchmarks.blocks import measure
from slam.algorithms import DEFAULT, algorithm
from sonarlog.recording import read_log

ROUNDS = 3
RECORDINGS = Path(__file__).resolve().parent.parent / "recordings"


def bare_reading(path: Path) -> float:
    """Seconds to read the file message by message with the mcap library, and do nothing."""
    begin = time.process_time()
    with path.open("rb") as stream:
        for _ in make_reader(stream).iter_messages():
            pass
    return time.process_time() - begin


def process(command: list[str]) -> float:
    """Seconds of processor time of a Python process, from its start to its end."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *command], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def whole_command(path: Path, name: str, run: Path) -> float:
    """Seconds of `sonarlog replay`."""
    return process(["-m", "cli", "replay", str(path), "--algorithm", name, "-q", "--force", "-o", str(run)])


def nothing() -> float:
    """Seconds to start, import all of this and end."""
    return process(["-c", "import cli.main, cli.replay, cli.watching, sonarlog.replay"])


def row(path: Path, name: str, run: Path) -> tuple[str, str]:
    """A row of the whole command, and one of the blocks."""
    log = read_log(path)
    real = float(log.odometry.t_ns[-1] - log.odometry.t_ns[0]) / 1e9
    # By turns, so that a busy moment of the machine meets both.
    pairs = [(whole_command(path, name, run), bare_reading(path)) for _ in range(ROUNDS)]
    whole, bare = (min(column) for column in zip(*pairs, strict=True))
    times, _ = measure(path, algorithm(name), run, each=lambda number, times: None)
    start = min(nothing() for _ in range(ROUNDS))
    # Ten minutes of it: the start of the process stays, all else is in proportion.
    ten = 600.0 / (start + (whole - start) * 600.0 / real)
    cells = [f"{real:.0f}", f"{len(times.whole)}", f"{whole:.2f}", f"{start:.2f}", f"{whole / bare:.1f}"]
    first = f"| {path.stem} | {name} | {' | '.join(cells)} | {real / whole:.0f} | {ten:.0f} |"
    sweeps = len(times.whole)
    ms = {"reading": 1000.0 * times.reading / sweeps}
    ms |= {key: 1000.0 * float(np.mean(times.blocks[key])) for key in BLOCKS}
    ms |= {"E + F": ms["E"] + ms["F"], "all": ms["reading"] + 1000.0 * float(np.mean(times.whole))}
    return first, f"| {path.stem} | {name} | {' | '.join(f'{value:.1f}' for value in ms.values())} |"


BLOCKS = ("B", "C", "D", "E", "F", "G", "H", "I", "digests", "writing")
PARTS = f"ms a sweep | algorithm | reading | {' | '.join(BLOCKS)} | E + F | all"
WHOLE = (
    "recording | algorithm | real s | sweeps | command s | of it start s | × bare reading | × real time"
    " | × real time, 10 min"
)


def main(arguments: list[str]) -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed")
    parser.add_argument("recordings", nargs="*", type=Path, default=sorted(RECORDINGS.glob("*.mcap")))
    parser.add_argument("--algorithm", action="append", help="Several may be given; paper and the default if none is.")
    asked = parser.parse_args(arguments)
    names = asked.algorithm or ["paper", DEFAULT]
    with tempfile.TemporaryDirectory() as folder:
        rows = [row(path, name, Path(folder) / "run.mcap") for name in names for path in asked.recordings]
    for columns, table in zip((WHOLE, PARTS), zip(*rows, strict=True), strict=True):
        print(f"| {columns} |\n|" + "---|" * (columns.count("|") + 1))
        print("\n".join(table) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
