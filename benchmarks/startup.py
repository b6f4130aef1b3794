"""How long `sonarlog --help` takes, as a multiple of `python -c "import click"`: python -m benchmarks.startup

Exit code 1 if it is more than 4 times as long.
"""

import subprocess
import sys
import time
from statistics import median

RUNS = 15
LIMIT = 4.0
HELP = [sys.executable, "-c", "import sys; sys.argv[1:] = ['--help']; from cli.main import main; main()"]
CLICK = [sys.executable, "-c", "import click"]


def seconds(command: list[str]) -> float:
    """One run, from start to exit."""
    start = time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start


def main() -> int:
    """Take turns, so that a busy moment of the machine meets both."""
    times = [(seconds(HELP), seconds(CLICK)) for _ in range(RUNS)]
    ours, click = (median(column) for column in zip(*times, strict=True))
    print(f"sonarlog --help {1000 * ours:.0f} ms, import click {1000 * click:.0f} ms: {ours / click:.2f} times")
    return 0 if ours <= LIMIT * click else 1


if __name__ == "__main__":
    sys.exit(main())
