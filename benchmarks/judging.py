"""What draws are worth: effective sample size, agreement of chains, and a verdict."""

from dataclasses import dataclass

import arviz as az
import numpy as np
from jaxtyping import Bool, Float

from muscle_bayes.inference.model.problem import Layout

MAX_RHAT, MIN_ESS = 1.01, 400.0
"""What a user wants of every identified quantity before he trusts draws."""
LARGEST_RHAT = 1.05
"""Above it the effective sample size of draws means nothing but that it is no larger."""
HARDLY_KNOWN = "J", "D"
"""The fixture's parameters, which spring runs are made to tell: quasi-static runs do not show J, and
its posterior is the prior. How well they are drawn is told apart."""
FEWEST = 4
"""Draws below which arviz finds no effective sample size."""


@dataclass
class Quality:
    """Of one set of draws."""

    draws: int
    """Of each chain, after warm-up."""
    chains: int
    ess: float
    """Bulk effective sample size, the least among the identified quantities."""
    rhat: float
    """Rank-normalised, the greatest among them."""
    ess_all: float
    """The same over all sampled quantities."""
    rhat_all: float

    @property
    def verdict(self) -> str:
        """`converged`, `usable` (enough to tell a rate) or `not converged`."""
        if self.rhat <= MAX_RHAT and self.ess >= MIN_ESS:
            return "converged"
        return "usable" if self.rhat <= LARGEST_RHAT else "not converged"


def identified(layout: Layout) -> Bool[np.ndarray, " n"]:
    """Which entries of the unconstrained vector count: all but those of HARDLY_KNOWN."""
    return np.concatenate(
        [np.full(int(np.prod(shape)), name not in HARDLY_KNOWN) for name, shape in layout.shapes]
    )


def kept(
    draws: Float[np.ndarray, "draw ..."], tuning: Bool[np.ndarray, " draw"]
) -> Float[np.ndarray, "kept ..."]:
    """What is judged: draws after warm-up, or the later half if that is more.

    In favour of a sampler whom the cap met in its warm-up.
    """
    return draws[min(int(tuning.sum()), len(draws) // 2) :]


def judge(draws: Float[np.ndarray, "chain draw n"], chosen: Bool[np.ndarray, " n"]) -> Quality:
    """ESS and R-hat of draws; both are the same for an entry and for what it stands for."""
    chains, count, _ = draws.shape
    if count < FEWEST:
        most = float(chains * max(count, 1))
        return Quality(count, chains, most, np.inf, most, np.inf)
    ess, rhat = np.zeros(draws.shape[2]), np.full(draws.shape[2], np.inf)
    # An entry that stood still in some chain has neither.
    moved = np.ptp(draws, axis=1).min(axis=0) > 0.0
    if moved.any():
        values = az.convert_to_datatree({"v": draws[..., moved]}).posterior
        ess[moved] = np.nan_to_num(az.ess(values)["v"].to_numpy(), nan=0.0)
        rhat[moved] = np.nan_to_num(az.rhat(values)["v"].to_numpy(), nan=np.inf)
    return Quality(
        count,
        chains,
        float(ess[chosen].min()),
        float(rhat[chosen].max()),
        float(ess.min()),
        float(rhat.max()),
    )
