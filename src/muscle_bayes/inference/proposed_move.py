"""What every Metropolis move offers."""

from typing import NamedTuple

from jaxtyping import Array, Float


class ProposedMove(NamedTuple):
    """A vector to move to."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    log_odds: Float[Array, ""]
    """Log density of the way back over that of the way there."""
