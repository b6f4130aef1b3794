"""What a path and a map are held against: true poses by time, from a run, a recording or a TUM file.

Must not know: metrics, printing.
"""

from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np

from slam.dmath import Floats
from slam.geometry import Bools
from sonarlog.errors import SonarlogError
from sonarlog.log import Ints, Log, Odometry, Surfaces, Truth

LARGEST_GAP_NS = 1_200_000_000
"""Between true poses further apart nothing is known. A robot stops and starts in that time; lean truths come once a
second.
"""
NEAR_NS = 20_000_000
"""A true pose this near in time stands for the moment itself, as evo has it with its `t_max_diff`."""
HEADING_RAD = 6.283185307179586 / (1 << 20)


class BadTum(SonarlogError):
    """A file that is no TUM trajectory."""

    def __init__(self, path: Path, line: int, why: str) -> None:
        super().__init__(path, line, why)
        self.path, self.line, self.why = path, line, why

    def __str__(self) -> str:
        where = f"{self.path}:{self.line}:" if self.line else f"{self.path}"
        return f"{where} {self.why}; a TUM line is `t x y z qx qy qz qw` in seconds and metres"


class NoTruth(SonarlogError):
    """There is nothing to hold a run against."""


@dataclass(frozen=True)
class Reference:
    """All that is known to be true: poses by time, surfaces in the same frame, raw odometry by time."""

    name: str
    truth: Truth | None = None
    surfaces: Surfaces | None = None
    odometry: Odometry | None = None

    def shifted(self, by_ns: int) -> "Reference":
        """The same on a clock that shows so much more."""
        truth, odometry = self.truth, self.odometry
        return replace(
            self,
            truth=truth and replace(truth, t_ns=truth.t_ns + by_ns),
            odometry=odometry and replace(odometry, t_ns=odometry.t_ns + by_ns),
        )


def reference_of_log(path: Path, log: Log) -> Reference:
    """What a recording knows. Raises NoTruth for one without true poses."""
    if log.truth is None:
        raise NoTruth(f"{path} holds no /truth: only the embedded robot, or a simulator like it, records one")
    return Reference(str(path), log.truth, log.surfaces, log.odometry if len(log.odometry.t_ns) else None)


def read_tum(path: Path) -> Truth:
    """A TUM trajectory in order of time; of each rotation its turn about z. Raises BadTum."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise BadTum(path, 0, f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise BadTum(path, 0, f"is no text (byte {error.start} is not UTF-8)") from None
    rows = [
        _tum_row(path, number, line.split())
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise BadTum(path, 0, "holds no pose")
    rows.sort(key=lambda row: row[0])
    times = np.array([t for t, _ in rows], dtype=np.int64)
    return Truth(times, np.array([pose for _, pose in rows], dtype=np.float64))


def _tum_row(path: Path, number: int, words: list[str]) -> tuple[int, tuple[float, float, float]]:
    if len(words) != 8:
        raise BadTum(path, number, f"{len(words)} words where 8 belong")
    try:
        t_ns = int((Decimal(words[0]) * 10**9).to_integral_value())
        x, y, _, qx, qy, qz, qw = (float(word) for word in words[1:])
    except (ValueError, InvalidOperation, OverflowError):
        raise BadTum(path, number, f"{' '.join(words)[:40]!r} are no numbers") from None
    if not (abs(t_ns) < 1 << 62 and np.isfinite([x, y, qx, qy, qz, qw]).all()):
        raise BadTum(path, number, "a number is out of all bounds")
    if abs(np.sqrt(qx * qx + qy * qy + qz * qz + qw * qw) - 1.0) > 0.05:
        raise BadTum(path, number, "the rotation is no unit quaternion")
    theta = float(np.arctan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz)))
    return t_ns, (x, y, theta)


def poses_at(truth: Truth, t_ns: Ints) -> tuple[Floats, Bools]:
    """True poses (n, 3) at these moments, and which of them are known; the others are 0.

    A moment within 20 ms of a true pose has that one; one between two that are at most 1.2 s apart lies on the line
    between them.
    """
    after = np.clip(np.searchsorted(truth.t_ns, t_ns), 0, len(truth.t_ns) - 1)
    before = np.maximum(after - 1, 0)
    first, last = truth.t_ns[before], truth.t_ns[after]
    span = last - first
    part = (t_ns - first) / np.maximum(span, 1)
    inside = (part >= 0.0) & (part <= 1.0) & (span <= LARGEST_GAP_NS)
    nearest = np.where(np.abs(t_ns - first) <= np.abs(t_ns - last), before, after)
    near = np.abs(truth.t_ns[nearest] - t_ns) <= NEAR_NS
    start, step = truth.pose[before], truth.pose[after] - truth.pose[before]
    step[:, 2] = np.arctan2(np.sin(step[:, 2]), np.cos(step[:, 2]))  # the short way round
    between = start + np.clip(part, 0.0, 1.0)[:, None] * step
    poses = np.where(inside[:, None], between, truth.pose[nearest])
    known = np.asarray(inside | near)
    poses[:, 2] = np.arctan2(np.sin(poses[:, 2]), np.cos(poses[:, 2]))
    poses[~known] = 0.0
    return poses, known


def odometry_at(odometry: Odometry, t_ns: Ints) -> Floats:
    """Raw odometry (n, 3) in metres and radians at these moments; before and after it, its first and last pose."""
    columns = (odometry.x_um / 1e6, odometry.y_um / 1e6, odometry.heading * HEADING_RAD)
    return np.column_stack([np.interp(t_ns, odometry.t_ns, column) for column in columns])


def span_of(t_ns: Ints) -> str:
    """The stretch of time that is covered, in words."""
    return f"{t_ns[0] / 1e9:.1f} to {t_ns[-1] / 1e9:.1f} s"
