"""Linear systems solved by hand, in one order of operations (no BLAS, no LAPACK)."""

from collections.abc import Sequence

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
    diagonal, room = np.zeros(size), np.empty(joined.size)
    for j in range(size):
        diagonal[j] = pivot = _pivot(joined.item(j, j), j)
        row, below = joined[j, j + 1 :], joined[j + 1 :, j + 1 :]
        products = room[: below.size].reshape(below.shape)
        np.multiply((row[:-1] / pivot)[:, None], row, out=products)
        below -= products
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


def solve_blocks(matrix: Floats, right: Floats, size: int, edges: Sequence[set[int]]) -> Floats:
    """The same for a large matrix, most of which is zero: b blocks of `size` unknowns, then a few that touch all.

    `edges[i]` are the blocks that block i touches. The block that touches fewest others is eliminated first; of
    several the lowest. `matrix` and `right` are overwritten. Raises SlamError like `solve_spd`.
    """
    blocks = len(edges)
    tail = np.arange(size * blocks, len(right))
    steps = []
    for block, neighbours in _elimination(edges):
        own = np.arange(size * block, size * block + size)
        others = [size * n + k for n in neighbours for k in range(size)]
        for k in range(size):
            rest = np.concatenate([own[k + 1 :], np.array(others, dtype=np.int64), tail])
            j = own[k]
            diagonal = _pivot(matrix[j, j], int(j))
            row = matrix[j, rest]
            part = row / diagonal
            matrix[rest[:, None], rest] -= part[:, None] * row[None, :]
            right[rest] -= part * right[j]
            steps.append((j, rest, part, diagonal))
    solution = np.zeros(len(right))
    solution[tail] = solve_spd(matrix[tail[:, None], tail], right[tail])
    for j, rest, part, diagonal in reversed(steps):
        solution[j] = right[j] / diagonal - dmath.total(part * solution[rest])
    return solution


def _elimination(edges: Sequence[set[int]]) -> list[tuple[int, list[int]]]:
    """In which order to eliminate the blocks, and what each one touches by then (minimum degree)."""
    touching = [set(neighbours) - {block} for block, neighbours in enumerate(edges)]
    waiting = dict.fromkeys(range(len(edges)))
    order = []
    while waiting:
        block = min(waiting, key=lambda b: (len(touching[b]), b))
        neighbours = sorted(touching[block])
        for n in neighbours:
            touching[n] |= touching[block]
            touching[n] -= {n, block}
        del waiting[block]
        order.append((block, neighbours))
    return order


def _pivot(value: float, place: int) -> float:
    if not value > 0.0:
        raise SlamError(f"normal equations are singular in unknown {place}")
    return float(value)
