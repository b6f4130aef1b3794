"""What the same bits everywhere cost: a replay as it is against the same with numpy's and libm's own functions.

Both in one process by turns; processor time, the shortest of each counts.
Usage: python -m benchmarks.determinism_cost [RECORDING…]
"""

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from slam import dmath, pipeline
from slam.algorithms import DEFAULT, algorithm
from sonarlog.digest import RunDigest
from sonarlog.recording import read_log
from sonarlog.replay import sweeps_of

ROUNDS = 5
RECORDINGS = Path(__file__).resolve().parent.parent / "recordings"


def _either(arrays: Callable[..., Any], floats: Callable[..., Any]) -> Callable[..., Any]:
    return lambda *x: arrays(*x) if isinstance(x[0], np.ndarray) else floats(*x)


NATIVE: dict[str, Callable[..., Any]] = {
    "sincos": _either(lambda x: (np.sin(x), np.cos(x)), lambda x: (math.sin(x), math.cos(x))),
    "sin": _either(np.sin, math.sin),
    "cos": _either(np.cos, math.cos),
    "atan2": _either(np.arctan2, math.atan2),
    "hypot": _either(np.hypot, math.hypot),
    "sqrt": _either(np.sqrt, math.sqrt),
    "exp": _either(np.exp, math.exp),
    "log": _either(np.log, math.log),
    "total": lambda values: float(values.sum()),
    "mean": lambda values: float(values.mean()),
    "ordered_sum": sum,
}
"""What dmath stands in for."""


@contextmanager
def native() -> Iterator[None]:
    """slam/ with the machine's own functions."""
    own = {name: getattr(dmath, name) for name in NATIVE}
    try:
        for name, function in NATIVE.items():
            setattr(dmath, name, function)
        yield
    finally:
        for name, function in own.items():
            setattr(dmath, name, function)


def measure(path: Path) -> tuple[float, float, float, float]:
    """Seconds to read and cut; of the pipeline with native functions; with dmath; of the digests."""
    begin = time.process_time()
    log = read_log(path)
    sweeps, ring, chosen = sweeps_of(log, path).sweeps, log.robot.ring(), algorithm(DEFAULT)
    reading = time.process_time() - begin
    best = [math.inf] * 3
    for _ in range(ROUNDS):
        begin = time.process_time()
        with native():
            for _ in pipeline.run(sweeps, ring, chosen):
                pass
        best[0] = min(best[0], time.process_time() - begin)
        result, hashing = RunDigest("benchmark"), 0.0
        begin = time.process_time()
        for step in pipeline.run(sweeps, ring, chosen):
            middle = time.process_time()
            result.add(step)
            hashing += time.process_time() - middle
        best[1] = min(best[1], time.process_time() - begin - hashing)
        best[2] = min(best[2], hashing)
    return reading, best[0], best[1], best[2]


def main(arguments: list[str]) -> None:
    """Print a row for each recording."""
    paths = [Path(argument) for argument in arguments] or sorted(RECORDINGS.glob("*.mcap"))
    print("| recording | reading s | pipeline, native s | with dmath s | digests s | ratio, pipeline | ratio, replay |")
    print("|---|---|---|---|---|---|---|")
    for path in paths:
        reading, plain, dmaths, digests = measure(path)
        whole = (reading + dmaths + digests) / (reading + plain)
        cells = [f"{value:.3f}" for value in (reading, plain, dmaths, digests)]
        print(f"| {path.stem} | {' | '.join(cells)} | {(dmaths + digests) / plain:.2f} | {whole:.2f} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
