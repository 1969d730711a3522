"""Draws of several chains, and how far these are from each other."""

from typing import NamedTuple

import arviz as az
import numpy as np
from jaxtyping import Float


class Draws(NamedTuple):
    """What the chains did after warm-up."""

    vector: Float[np.ndarray, "chain draw n"]
    """Unconstrained."""
    values: Float[np.ndarray, "chain draw n"]
    """The sampled quantities themselves."""
    statistics: dict[str, np.ndarray]
    """Of the smooth block, by ArviZ's names, chain and draw axes leading."""

    @property
    def divergences(self) -> int:
        """How many transitions diverged; none do without gradients."""
        return int(self.statistics.get("diverging", np.zeros(())).sum())


def worst_rhat(draws: Draws) -> float:
    """The largest rank-normalised R-hat of the sampled quantities; infinite where a chain does not move."""
    with np.errstate(divide="ignore", invalid="ignore"):
        found = az.rhat(az.convert_to_datatree({"v": draws.values}).posterior)["v"]
    largest = float(np.max(found.to_numpy()))
    return largest if np.isfinite(largest) else np.inf
