"""The normal equations of a part of the graph, from which the landmarks are eliminated (Schur's complement).

Each landmark is two numbers, seen from few poses, so that it goes out in closed form. Where in the equations a
sighting or a step has its share is worked out once; from one iteration to the next only the shares change. Must not
know: what the shares mean, and how what is left is solved.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.sweep import Ints

ERRORS = 4
"""Unknowns after those of the poses, RING the last of them."""
HELD = 1e-6
"""A line seen from one place only is tied by one bearing and one distance; this keeps its elimination defined."""


@dataclass(frozen=True)
class Part:
    """What moves: poses from number `first` on, and the landmarks seen from them with all their sightings.

    `rows` (r,) the sightings in order of landmark, `place` (r,) each one's landmark, `slot` (r,) its pose or −1;
    `landmarks` (l,), `begin` (l + 1,) where each one's rows begin; `sweeps` the poses (p,).
    """

    first: int
    sweeps: Ints
    landmarks: Ints
    rows: Ints
    place: Ints
    slot: Ints
    begin: Ints


@dataclass(frozen=True)
class Layout:
    """Where everything stands: n unknowns (three a pose, then the errors), column n is the right side.

    Shares of sightings (r, 4, 5) and of steps (s, 10, 11) in the (n, n + 1) matrix; `own` (r, 2, 4) in what each
    landmark has to itself (l, 2, 4). `ties` (r, 2, 3) in the ties of landmarks to poses (2, t): those of a landmark to
    all poses from the first that saw it to the last, landmark after landmark. Of each tie (t,): `column`, `landmark`;
    of each landmark `squares`: its columns and its ties, from and to.
    """

    size: int
    sightings: Ints
    steps: Ints
    own: Ints
    ties: Ints
    column: Ints
    landmark: Ints
    squares: tuple[tuple[int, int, int, int], ...]

    @classmethod
    def of(cls, part: Part) -> "Layout":
        """That of a part."""
        poses, count = len(part.sweeps), len(part.landmarks)
        size = 3 * poses + ERRORS
        ends = np.array([size - 1, size])
        own = 3 * np.maximum(part.slot, 0)[:, None] + np.arange(3)
        seen = np.concatenate([own, np.broadcast_to(ends, (len(own), 2))], axis=1)
        latter = 3 * np.arange(poses)[:, None] + np.arange(3)
        last = np.broadcast_to(np.arange(size - ERRORS, size + 1), (poses, ERRORS + 1))
        step = np.concatenate([np.maximum(latter - 3, 0), latter, last], axis=1)
        low = part.slot[part.begin[:-1] + np.bincount(part.place[part.slot < 0], minlength=count)]
        width = 3 * (part.slot[part.begin[1:] - 1] - low + 1)
        begin = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(width)])
        landmark = np.repeat(np.arange(count), width)
        tie = (begin[:-1] - 3 * low)[part.place, None] + 3 * np.maximum(part.slot, low[part.place])[:, None]
        return cls(
            size=size,
            sightings=seen[:, :-1, None] * (size + 1) + seen[:, None, :],
            steps=step[:, :-1, None] * (size + 1) + step[:, None, :],
            own=8 * part.place[:, None, None] + np.arange(8).reshape(2, 4),
            ties=(tie + np.arange(3))[:, None, :] + len(landmark) * np.arange(2)[:, None],
            column=np.arange(len(landmark)) + (3 * low - begin[:-1])[landmark],
            landmark=landmark,
            squares=tuple(
                zip(*(v.tolist() for v in (3 * low, 3 * low + width, begin[:-1], begin[1:])), strict=True)
            ),
        )  # fmt: skip


@dataclass(frozen=True)
class Landmarks:
    """What was eliminated: of each landmark its `own` equations (l, 2, 2 + 2), solved by `inverse`, and its ties."""

    layout: Layout
    own: Floats  # by RING, the right side, and the landmark
    ties: Floats  # (2, t)
    inverse: Floats  # (l, 2, 2)

    def steps(self, step: Floats) -> Floats:
        """How far each landmark moves (l, 2), once the steps of the poses and errors (n,) are known."""
        layout, count = self.layout, len(self.own)
        told = [summed(layout.landmark, tie * step[layout.column], (count,)) for tie in self.ties]
        left = self.own[:, :, 1] - np.stack(told, axis=1) - self.own[:, :, 0] * step[-1]
        return times(self.inverse, left[:, :, None])[:, :, 0]


def normal_equations(layout: Layout, sightings: Floats, steps: Floats, prior: Floats) -> tuple[Floats, Landmarks]:
    """The equations of poses and errors (n, n + 1), right side and all, and the landmarks that were eliminated.

    Sightings are rows (r, 2, 7) by pose (3), RING, residual, landmark (2); steps are rows (s, 3, 11) by former pose,
    latter pose, errors and residual; both weighed, the residual being what is to be explained. `prior` (4, 2) is the
    information on the errors and what it pulls them by. Below the diagonal the last columns are left out.
    """
    seen, moved = squares(sightings), squares(steps)
    size = layout.size
    matrix = summed(
        np.concatenate([layout.sightings.ravel(), layout.steps.ravel()]),
        np.concatenate([seen[:, :4, :5].ravel(), moved[:, :10].ravel()]),
        (size, size + 1),
    )
    errors = np.arange(size - ERRORS, size)
    matrix[errors, errors] += prior[:, 0]
    matrix[errors, size] += prior[:, 1]
    count = len(layout.squares)
    own = summed(layout.own, seen[:, 5:, 3:], (count, 2, 4))
    ties = summed(layout.ties, seen[:, 5:, :3], (2, len(layout.column)))
    landmarks = Landmarks(layout, own, ties, inverse(own[:, :, 2:]))
    _eliminate(matrix, landmarks)
    return matrix, landmarks


def squares(rows: Floats) -> Floats:
    """Each of the rows (k, q, c) times itself, summed over q: (k, c, c)."""
    total = rows[:, 0, :, None] * rows[:, 0, None, :]
    for q in range(1, rows.shape[1]):
        total += rows[:, q, :, None] * rows[:, q, None, :]
    return total


def summed(places: Ints, values: Floats, shape: tuple[int, ...]) -> Floats:
    """All values at their places in an array of this shape, in their order."""
    size = 1
    for length in shape:
        size *= length
    return np.bincount(places.ravel(), values.ravel(), size).astype(np.float64, copy=False).reshape(shape)


def inverse(matrices: Floats) -> Floats:
    """Of symmetric matrices (l, 2, 2), with a little on their diagonals."""
    first, mixed, second = matrices[:, 0, 0] + HELD, matrices[:, 0, 1], matrices[:, 1, 1] + HELD
    determinant = first * second - mixed * mixed
    return np.asarray(np.stack([second, -mixed, -mixed, first], axis=1) / determinant[:, None]).reshape(-1, 2, 2)


def times(matrices: Floats, columns: Floats) -> Floats:
    """(k, 2, 2) by (k, 2, c)."""
    return np.asarray(matrices[:, :, :1] * columns[:, :1] + matrices[:, :, 1:] * columns[:, 1:])


def _eliminate(matrix: Floats, landmarks: Landmarks) -> None:
    """Each landmark ties the poses that saw it to one another: a square of the matrix, and its last two columns."""
    layout, own, ties = landmarks.layout, landmarks.own, landmarks.ties
    ring, right = layout.size - 1, layout.size
    back = times(landmarks.inverse[layout.landmark], ties.T[:, :, None])[:, :, 0].T.copy()
    for low, high, begin, end in layout.squares:
        square = matrix[low:high, low:high]
        square -= ties[0, begin:end, None] * back[0, begin:end]
        square -= ties[1, begin:end, None] * back[1, begin:end]
    for column, other in ((ring, own[:, :, 0]), (right, own[:, :, 1])):
        tied = other[layout.landmark]
        matrix[:, column] -= summed(layout.column, back[0] * tied[:, 0] + back[1] * tied[:, 1], (layout.size,))
        through = times(landmarks.inverse, other[:, :, None])[:, :, 0]
        matrix[ring, column] -= dmath.total((own[:, :, 0] * through).ravel())
