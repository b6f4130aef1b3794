"""How fast a replay is: the whole command against bare reading of the file and real time, and each block's share.

    python -m benchmarks.speed [--algorithm graph] [RECORDING…]

Seconds of processor time, which other programs disturb least: a replay is one thread, and alone on a machine takes as
long by the clock. Numbers stand side by side, and nothing is judged.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

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
    blocks = [1000.0 * float(np.mean(times.blocks[key])) for key in KEYS]
    rest = 1000.0 * float(np.mean(times.whole)) - sum(blocks)
    found = blocks[KEYS.index("E")] + blocks[KEYS.index("F")]
    shown = " | ".join(f"{value:.1f}" for value in (*blocks, rest, sum(blocks) + rest))
    return first, f"| {path.stem} | {name} | {shown} | {1000.0 * median(times.whole):.1f} | {found:.1f} |"


KEYS = ("B", "C", "D", "E", "F", "G", "H", "I", "digests", "writing")


def main(arguments: list[str]) -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed")
    parser.add_argument("recordings", nargs="*", type=Path, default=sorted(RECORDINGS.glob("*.mcap")))
    parser.add_argument("--algorithm", default=DEFAULT)
    asked = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        rows = [row(path, asked.algorithm, Path(folder) / "run.mcap") for path in asked.recordings]
    print(
        "| recording | algorithm | real s | sweeps | command s | of it start s | × bare reading | × real time |", end=""
    )
    print(" × real time, 10 min |\n|" + "---|" * 9)
    print("\n".join(first for first, _ in rows))
    print(
        f"\n| ms a sweep | algorithm | {' | '.join(KEYS)} | rest | all | median | E + F |\n|" + "---|" * (len(KEYS) + 6)
    )
    print("\n".join(second for _, second in rows))


if __name__ == "__main__":
    main(sys.argv[1:])
