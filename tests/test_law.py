from pathlib import Path

import pytest

import slam
import sonarlog
from tests.law import breaches

SLAM = Path(slam.__path__[0])
SONARLOG = Path(sonarlog.__path__[0])

BOUND = sorted(
    [
        *SLAM.rglob("*.py"),
        *(SONARLOG / "sim").glob("*.py"),
        *(SONARLOG / "protocol").glob("*.py"),
        *(SONARLOG / "imports").glob("*.py"),
        *(
            SONARLOG / name
            for name in ("decode.py", "odometer.py", "sweeps.py", "log.py", "robot.py", "canonical.py", "digest.py")
        ),
        *(SONARLOG / "recording" / name for name in ("topics.py", "layout.py")),
    ]
)
"""What a replay's bits depend on, from bytes to digests, and the robot that is simulated."""

ALLOWED = {
    ("slam/dmath.py", "(-1.0) ** n"): "powers of one are exact",
    ("sonarlog/decode.py", "sum((_is_sip(piece) for piece in pieces))"): "counts",
    ("sonarlog/protocol/framing.py", "sum(body[0:even:2])"): "bytes",
    ("sonarlog/protocol/framing.py", "sum(body[1:even:2])"): "bytes",
    ("sonarlog/sim/link.py", "import time"): "holds the simulation back to real time, changes no byte of it",
    ("sonarlog/sim/random_place.py", "id(outline[n - 1])"): "the same edge or another one; nothing is ordered by it",
    ("sonarlog/sim/random_place.py", "id(outline[n])"): "likewise",
    ("sonarlog/sim/random_place.py", "id(outline[(n + 1) % len(outline)])"): "likewise",
    ("sonarlog/sim/random_place.py", "id(edge)"): "likewise",
    ("sonarlog/sim/random_world.py", "sum(turns)"): "whole degrees",
    ("sonarlog/sim/server.py", "import os"): "the pseudo-terminal",
    ("sonarlog/sim/world.py", "for row, _ in occupied"): "only the extremes are taken",
    ("sonarlog/sim/world.py", "for _, column in occupied"): "only the extremes are taken",
}


def relative(path: Path) -> str:
    return path.relative_to(SLAM.parent).as_posix()


@pytest.mark.parametrize("path", BOUND, ids=relative)
def test_the_law_is_kept(path: Path) -> None:
    found = [b for b in breaches(path.read_text(encoding="utf-8")) if (relative(path), b.code) not in ALLOWED]
    assert not found, f"{relative(path)}: " + "; ".join(map(str, found))


def test_no_leave_is_given_that_nobody_takes() -> None:
    taken = {(relative(path), b.code) for path in BOUND for b in breaches(path.read_text(encoding="utf-8"))}
    assert not set(ALLOWED) - taken


@pytest.mark.parametrize(
    "planted",
    [
        "np.sin(x)", "np.arctan2(y, x)", "np.exp(x)", "np.hypot(x, y)", "np.tanh(x)", "np.power(x, 0.5)",
        "f = np.cos", "list(map(np.log, xs))", "numpy.log10(x)",
        "np.linalg.norm(x)", "np.fft.fft(x)", "a @ b", "a @= b", "np.dot(a, b)", "a.dot(b)", "np.einsum('i,i', a, b)",
        "sum(xs)", "sum(x * x for x in xs)", "np.sum(x)", "x.sum()", "x.mean(axis=0)", "np.std(x)", "np.add.reduce(x)",
        "np.average(x)", "x.prod()", "np.interp(x, a, b)",
        "x ** 0.5", "x ** 2", "x **= 2", "pow(x, 2)", "2 ** k",
        "np.argsort(x)", "x.argsort()", "np.argsort(x, kind='quicksort')", "np.argpartition(x, 3)", "x.partition(3)",
        "for x in {1, 2}: pass", "[x for x in set(xs)]", "list({x for x in xs})", "(*frozenset(xs),)",
        "seen = set()\nfor x in seen: pass", "seen: set[int] = f()\ntuple(seen)", "def f(a: set[int]): return list(a)",
        "seen = set()\nfor x in seen | other: pass", "seen = set(xs)\nseen.pop()",
        "import math", "from math import sin", "from math import sqrt, hypot", "import random", "import time",
        "from datetime import datetime",
        "hash(x)", "id(x)", "np.random.default_rng(0)", "x.astype(np.float32)",
    ],
)  # fmt: skip
def test_a_planted_breach_is_named(planted: str) -> None:
    assert breaches(planted)


@pytest.mark.parametrize(
    "honest",
    [
        "np.sqrt(x)", "np.rint(x / g) * g", "np.cumsum(x)", "dmath.sin(x)", "dmath.total(x)", "dmath.mean(x)",
        "sum(1 for x in xs if x)", "sum(len(x) for x in xs)", "sum(x > 0 for x in xs)", "1 << 20", "10**6",
        "np.argsort(x, kind='stable')", "sorted({r for a in b for r in a})", "x in {1, 2}", "len(set(xs))",
        "taken = set()\ntaken.update(places)\nany(p in taken for p in places)", "rows.pop()", "from math import sqrt",
        "seen = set(xs)\nmax(x for x in seen)", "np.unique(x)",
        "text.partition(':')",
    ],
)  # fmt: skip
def test_honest_code_is_left_alone(honest: str) -> None:
    assert not breaches(honest)


def test_a_breach_says_where_and_what_instead() -> None:
    (breach,) = breaches("x = 1\ny = np.sin(x)\n")
    assert str(breach) == "line 2: np.sin: differs by SIMD level and library: use slam.dmath"
