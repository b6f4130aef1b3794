"""How long the commands take that must feel instant, as multiples of what Python itself takes.

    python -m benchmarks.startup [RECORDING]

`sonarlog --help` against `python -c "import click"`, and `sonarlog diff` of a RECORDING's run against itself, from the
cache, against Python's bare start; by turns, so that a busy moment of the machine meets both. Exit code 1 if one of
them is more than LIMITS times as long.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from statistics import median

RUNS = 15
LIMITS = {"sonarlog --help": 4.0, "sonarlog diff": 50.0}
"""Fifty starts of a Python that starts in 20 ms are a second."""
RECORDING = Path(__file__).resolve().parent.parent / "recordings" / "loop.mcap"
START = "from cli.main import main; main()"


def seconds(words: list[str], environment: Mapping[str, str]) -> float:
    """One run of Python, from start to exit. Raises CalledProcessError unless it exits with 0."""
    start = time.perf_counter()
    subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, check=True, env=environment)
    return time.perf_counter() - start


def ratio(name: str, ours: list[str], against: list[str], environment: Mapping[str, str]) -> float:
    """How many times as long as the other one ours takes, told."""
    times = [(seconds(ours, environment), seconds(against, environment)) for _ in range(RUNS + 1)][1:]  # one compiles
    mine, bare = median(each for each, _ in times), median(each for _, each in times)
    words = f"python {' '.join(against)}"
    print(
        f"{name} {1000 * mine:.0f} ms, {words} {1000 * bare:.0f} ms: {mine / bare:.1f} times (at most {LIMITS[name]:g})"
    )
    return mine / bare


def main(arguments: list[str]) -> int:
    """Both, one after the other."""
    recording = arguments[0] if arguments else RECORDING
    with tempfile.TemporaryDirectory() as folder:
        # Compiled once, as it is where Python is let alone.
        environment = {**os.environ, "SONARLOG_CACHE": folder, "PYTHONPYCACHEPREFIX": folder}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        diff = ["-c", START, "diff", f"{recording}@paper", f"{recording}@paper", "-q"]
        found = {
            "sonarlog --help": ratio("sonarlog --help", ["-c", START, "--help"], ["-c", "import click"], environment),
            "sonarlog diff": ratio("sonarlog diff", diff, ["-c", "pass"], environment),
        }
    return 0 if all(found[name] <= limit for name, limit in LIMITS.items()) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
