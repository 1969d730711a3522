"""Steps of Levenberg and Marquardt."""

import numpy as np
from jaxtyping import Float

from muscle_bayes.inference.search.factored import FactoredPrecision

LONGEST_MOVE = 2.0
"""Longest step of any entry, in units of the unconstrained vector: many prior standard deviations at
once leave the region the model is good in."""


def damped_move(
    information: Float[np.ndarray, "n n"], gradient: Float[np.ndarray, " n"], damping: float
) -> Float[np.ndarray, " n"]:
    """Minimum of g'd + d'(I + damping diag I)d / 2, cut to LONGEST_MOVE in any entry."""
    damped = FactoredPrecision(information + damping * np.diag(np.diag(information)))
    move = -damped.solve(gradient)
    return move * min(1.0, LONGEST_MOVE / max(np.abs(move).max(), 1e-300))
