"""Linear systems solved by hand, in one order of operations (no BLAS, no LAPACK)."""

from collections.abc import Sequence
from heapq import heapify, heappop, heappush

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.errors import SlamError


def solve_spd(matrix: Floats, right: Floats) -> Floats:
    """x with matrix · x = right, for a symmetric positive definite (n, n) matrix, by Cholesky's LDLᵀ.

    Raises SlamError where the matrix is not positive definite.
    """
    return solve_joined(np.concatenate([matrix, right[:, None]], axis=1))


def solve_joined(joined: Floats) -> Floats:
    """The same for the matrix with the right side as one more column (n, n + 1), which is overwritten.

    Only what stands on the diagonal and right of it is looked at.
    """
    size = len(joined)
    diagonal = np.zeros(size)
    for j in range(size):
        diagonal[j] = pivot = _pivot(joined.item(j, j), j)
        row, below = joined[j, j + 1 :], joined[j + 1 :, j + 1 :]
        below -= (row[:-1] / pivot)[:, None] * row
    joined /= diagonal[:, None]
    solution = joined[:, size].copy()
    for j in range(size - 1, 0, -1):
        solution[:j] -= joined[:j, j] * solution[j]
    return solution


def inverse_3(matrix: Floats) -> Floats:
    """Inverse of a symmetric positive definite (3, 3) matrix, by its cofactors. Raises SlamError like `solve_spd`."""
    (a, b, c), (_, d, e), (_, _, f) = matrix.tolist()
    first, second, third = d * f - e * e, c * e - b * f, b * e - c * d
    determinant = a * first + b * second + c * third
    _pivot(determinant, 0)
    fourth, fifth, sixth = a * f - c * c, b * c - a * e, a * d - b * b
    cofactors = [[first, second, third], [second, fourth, fifth], [third, fifth, sixth]]
    return np.asarray(np.array(cofactors) / determinant)


def solve_blocks(joined: Floats, size: int, order: Sequence[tuple[int, list[int]]]) -> Floats:
    """The same as `solve_joined` for a large matrix (n, n + 1), most of which is zero, and which is overwritten.

    It is made of blocks of `size` unknowns, then a few that touch all; `order` is that of `elimination`. Raises
    SlamError like `solve_spd`.
    """
    tail = np.arange(size * len(order), joined.shape[1])  # with the right side
    steps = []
    for block, neighbours in order:
        own = np.arange(size * block, size * block + size)
        others = [size * n + k for n in neighbours for k in range(size)]
        rest = np.concatenate([own, np.array(others, dtype=np.int64), tail])
        square = joined[rest[:-1, None], rest]
        for k in range(size):
            pivot = _pivot(square.item(k, k), int(own[k]))
            row = square[k, k + 1 :]
            part = row / pivot
            square[k + 1 :, k + 1 :] -= part[:-1, None] * row
            steps.append((int(own[k]), rest[k + 1 : -1], part))
        joined[rest[size:-1, None], rest[size:]] = square[size:, size:]
    solution = np.zeros(len(joined))
    solution[tail[:-1]] = solve_joined(joined[tail[:-1, None], tail])
    for j, rest, part in reversed(steps):
        solution[j] = part[-1] - dmath.total(part[:-1] * solution[rest])
    return solution


def elimination(edges: Sequence[set[int]]) -> list[tuple[int, list[int]]]:
    """In which order to eliminate blocks, and what each one touches by then; `edges[i]` are those block i touches.

    The one that touches fewest others is next, of several the lowest (minimum degree).
    """
    touching = [set(neighbours) - {block} for block, neighbours in enumerate(edges)]
    waiting = [(len(touched), block) for block, touched in enumerate(touching)]
    heapify(waiting)
    order = []
    gone = [False] * len(edges)
    while waiting:
        degree, block = heappop(waiting)
        if gone[block] or degree != len(touching[block]):
            continue
        neighbours = sorted(touching[block])
        for n in neighbours:
            touching[n] |= touching[block]
            touching[n] -= {n, block}
            heappush(waiting, (len(touching[n]), n))
        gone[block] = True
        order.append((block, neighbours))
    return order


def _pivot(value: float, place: int) -> float:
    if not value > 0.0:
        raise SlamError(f"normal equations are singular in unknown {place}")
    return float(value)
