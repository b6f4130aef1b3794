"""What one configuration of the machine computes, as JSON on stdout: canaries that must change, digests that must not.

Needs numpy, mcap, zstandard and lz4, nothing else. Usage: python -m tests.matrix.probe [--short] RECORDING…
"""

import hashlib
import json
import math
import platform
import sys
import tempfile
from pathlib import Path

import numpy as np

from slam import dmath
from slam.algorithms import ALGORITHMS, DEFAULT, algorithm
from sonarlog.digest import RunDigest, digest
from sonarlog.exploring.explorer import Explorer, Limits
from sonarlog.exploring.reproduction import Reproduction
from sonarlog.imports import udacity
from sonarlog.imports.rows import write_rows
from sonarlog.plan import Plan
from sonarlog.recorder import Recorder
from sonarlog.recording import RecordingWriter, read_log, recording_digest
from sonarlog.replay import replay_sweeps, sweeps_of
from sonarlog.robot import Robot
from sonarlog.route import parse_route
from sonarlog.runs import identify
from sonarlog.sim.link import open_sim

REAL = Path(__file__).parents[3] / "shared" / "data" / "udacity_corridor"
"""A real robot's log, as its course gave it out; left out where it is not at hand."""

PLACE = Path(__file__).parents[1] / "data" / "hall.toml"
"""Where the embedded robot explores."""

URL, ROUTE = "sim://corridor?seed=1&speed=0", "scan; follow 0.8; scan; follow 0.8; scan"


def canaries() -> dict[str, str]:
    """Digests of what is known to depend on SIMD level, libm, BLAS kernel and hash seed."""
    x = np.arange(1, 20001).astype(np.float64) * 1e-3
    square = (x[:900] % 1.0).reshape(30, 30)
    wide = np.resize(x % 0.37, (257, 257))
    return {
        "numpy": digest((np.exp(x), np.arctan2(x, x[::-1]), np.tanh(x), np.log10(x), np.argsort(np.rint(x)))),
        "libm": digest([f(value) for value in x.tolist() for f in (math.sin, math.cos, math.exp, math.atan)]),
        "blas": digest((wide @ wide, np.linalg.inv(square + 3.0 * np.eye(30)), np.dot(x, x[::-1]).item())),
        "hash": hashlib.blake2b(" ".join({f"key {k}" for k in range(50)}).encode(), digest_size=16).hexdigest(),
    }


def dmath_digest() -> str:
    """Of the functions that stand in for libm's, over arrays and one by one."""
    x = (np.arange(40001) - 20000).astype(np.float64) * 1e-3
    y = np.abs(x) + 1e-3
    one_by_one = [(dmath.sin(v), dmath.cos(v), dmath.exp(v), dmath.atan2(v, 1.5)) for v in x[::100].tolist()]
    arrays = (dmath.sin(x), dmath.cos(x), dmath.exp(x), dmath.log(y), dmath.hypot(x, y), dmath.atan2(x, y[::-1].copy()))
    return digest((arrays, one_by_one))


def recorded(path: Path) -> None:
    """The embedded robot, driven and recorded in process."""
    link = open_sim(URL)
    with RecordingWriter(path, started_wall_ns=0, command_line="probe", config={}) as writer:
        Recorder(link, writer, Plan(parse_route(ROUTE)), wall_ns=link.now_ns).run(lambda: False)


def explored(path: Path) -> None:
    """The embedded robot, exploring by itself with the default algorithm.

    Its driver goes by this machine's own sine and cosine: made once, replayed everywhere.
    """
    link, chosen = open_sim(f"sim://{PLACE}?seed=1"), algorithm(DEFAULT)

    def explorer(robot: Robot) -> Explorer:
        return Explorer(robot, chosen, Limits(scan_deg_s=24.0))

    with RecordingWriter(path, started_wall_ns=0, command_line="probe", config={}) as writer:
        Recorder(link, writer, Plan(mover=explorer, recovers=True), wall_ns=link.now_ns).run(lambda: False)


def decided(path: Path) -> dict[str, str]:
    """Whether a replay takes the recording's decisions again, word by word; nothing for one without."""
    log, chosen = read_log(path), algorithm(DEFAULT)
    if not log.decisions:
        return {}
    again = Reproduction(log.decisions, chosen)
    for step in replay_sweeps(log, sweeps_of(log, path), chosen):
        again.add(step)
    found = again.result()
    return {f"{path.stem}, decisions": digest([found.told() if found else "no decisions", *log.decisions])}


def imported(path: Path) -> None:
    """The real corridor as a recording."""
    rows = udacity.rows(REAL / "measurement.txt", REAL / "poses.txt")
    write_rows(path, rows, udacity.robot(), source=REAL / "measurement.txt", command_line="probe", config={})


def results(paths: list[Path], names: list[str], *, real: bool) -> dict[str, str]:
    """Digests by what was computed."""
    made = {"dmath": dmath_digest()}
    with tempfile.TemporaryDirectory() as folder:
        simulated = Path(folder) / "embedded robot"
        recorded(simulated)
        made["embedded robot, wire"] = recording_digest(simulated)
        if real:
            paths = [Path(folder) / "real corridor", *paths]
            imported(paths[0])
        for path in (simulated, *paths):
            made |= decided(path)
            made |= {f"{path.name.removesuffix('.mcap')}, {name}": each for name, each in replayed(path, names).items()}
    return made


def replayed(path: Path, names: list[str]) -> dict[str, str]:
    """The run's digest by algorithm; the recording is read once."""
    log, recording = read_log(path), recording_digest(path)
    sweeps = sweeps_of(log, path)
    digests = {}
    for name in names:
        chosen = algorithm(name)
        result = RunDigest(identify(recording, chosen).asked())
        for step in replay_sweeps(log, sweeps, chosen):
            result.add(step)
        digests[name] = result.result()
    return digests


def main(arguments: list[str]) -> None:
    """Print what this configuration computes."""
    short = "--short" in arguments
    paths = [Path(argument) for argument in arguments if argument != "--short"]
    facts = {"python": platform.python_version(), "numpy": np.__version__, "machine": platform.machine()}
    names = [DEFAULT] if short else list(ALGORITHMS)
    print(
        json.dumps(
            {"facts": facts, "canaries": canaries(), "results": results(paths, names, real=REAL.is_dir() and not short)}
        )
    )


if __name__ == "__main__":
    main(sys.argv[1:])
