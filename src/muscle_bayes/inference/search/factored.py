"""Precision matrices whose entries differ by many powers of ten."""

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_solve, solve_triangular

RIDGE = 1e-12
"""Added to the diagonal once that is 1: above what rounding leaves of a direction nothing tells."""


class FactoredPrecision:
    """A symmetric, positive definite matrix A = S^-1 (L L') S^-1, S making its diagonal 1.

    Cholesky's factorisation of A itself fails where one direction is told 1e16 times better than
    another, which a model that misfits grossly brings about.
    """

    def __init__(self, matrix: Float[np.ndarray, "n n"]) -> None:
        self._scale = 1.0 / np.sqrt(np.diag(matrix))
        unit = matrix * np.outer(self._scale, self._scale)
        self._lower = np.linalg.cholesky(unit + RIDGE * np.eye(len(unit)))

    def solve(self, right: Float[np.ndarray, "n ..."]) -> Float[np.ndarray, "n ..."]:
        """A^-1 right."""
        scale = self._scale.reshape(-1, *[1] * (right.ndim - 1))
        return scale * cho_solve((self._lower, True), scale * right)

    def inverse(self) -> Float[np.ndarray, "n n"]:
        """A^-1, the covariance."""
        return self.solve(np.eye(self._scale.size))

    def spread(self, kicks: Float[np.ndarray, "n ..."]) -> Float[np.ndarray, "n ..."]:
        """Standard normal numbers turned into draws with precision A."""
        scale = self._scale.reshape(-1, *[1] * (kicks.ndim - 1))
        return scale * solve_triangular(self._lower, kicks, trans=1, lower=True)

    @property
    def log_determinant(self) -> float:
        """ln |A|."""
        return float(2.0 * np.log(np.diag(self._lower)).sum() - 2.0 * np.log(self._scale).sum())
