"""Small linear systems solved by hand, in one order of operations (no BLAS, no LAPACK)."""

import numpy as np

from slam import dmath
from slam.dmath import Floats
from slam.errors import SlamError


def solve_spd(matrix: Floats, right: Floats) -> Floats:
    """x with matrix · x = right, for a symmetric positive definite (n, n) matrix, by Cholesky's LDLᵀ.

    Raises SlamError where the matrix is not positive definite.
    """
    size = len(right)
    lower = np.eye(size)
    diagonal = np.zeros(size)
    for j in range(size):
        scaled = lower[j, :j] * diagonal[:j]
        diagonal[j] = matrix[j, j] - dmath.total(scaled * lower[j, :j])
        if not diagonal[j] > 0.0:
            raise SlamError(f"normal equations are singular in unknown {j}")
        for i in range(j + 1, size):
            lower[i, j] = (matrix[i, j] - dmath.total(lower[i, :j] * scaled)) / diagonal[j]
    solution = right.copy()
    for i in range(size):
        solution[i] -= dmath.total(lower[i, :i] * solution[:i])
    solution /= diagonal
    for i in range(size - 1, -1, -1):
        solution[i] -= dmath.total(lower[i + 1 :, i] * solution[i + 1 :])
    return solution
