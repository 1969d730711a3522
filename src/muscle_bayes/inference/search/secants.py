"""Derivatives of errors without evaluating them: Broyden's update, from how the errors changed."""

from typing import Any, NamedTuple, Protocol

import numpy as np
from jaxtyping import Float


class Glance(Protocol):
    """A point, seen without derivatives of the model."""

    @property
    def potential(self) -> Any:
        """Sum of e^2 / 2 and of ln s over all errors e and their scales s, less the log prior."""

    @property
    def parts(self) -> Any:
        """All e, then all ln s."""

    @property
    def pull(self) -> Any:
        """Gradient of the log prior."""

    @property
    def prior(self) -> Any:
        """Diagonal of the prior's precision."""


class Carried(NamedTuple):
    """Derivatives at a point, from those at another and what changed on the way."""

    gradient: Float[np.ndarray, " n"]
    information: Float[np.ndarray, "n n"]
    slopes: Float[np.ndarray, "n part"]
    """Derivatives of the parts."""


def carried(here: Glance, known: Carried, there: Glance, move: Float[np.ndarray, " n"]) -> Carried:
    """Derivatives at `there`, a `move` away from `here`, where they are `known`.

    The slopes S become S + w m' with m the change of the parts that S missed and w'move = 1: of all
    slopes that give this change, the nearest to S. Nearness is measured in standard deviations, so w is
    along the information's diagonal times the move. Source: Broyden, Math. Comp. 19 (1965), 577-593.
    """
    slopes, information = known.slopes, known.information
    along = np.diag(information) * move
    along = along / (move @ along)
    missed = np.asarray(there.parts) - np.asarray(here.parts) - move @ slopes
    pulled = slopes @ missed
    # What errors, scales and prior do not explain of the gradient stays.
    rest = known.gradient - (slopes @ _driving(here.parts) - np.asarray(here.pull))
    slopes = slopes + np.outer(along, missed)
    return Carried(
        gradient=slopes @ _driving(there.parts) - np.asarray(there.pull) + rest,
        information=information
        + np.outer(along, pulled)
        + np.outer(pulled, along)
        + np.outer(along, along) * (missed @ missed)
        + np.asarray(there.prior)
        - np.asarray(here.prior),
        slopes=slopes,
    )


def _driving(parts: Any) -> Float[np.ndarray, " part"]:
    """Derivative of the potential in each part: e of an error, 1 of a log scale."""
    errors = np.asarray(parts)[: len(parts) // 2]
    return np.concatenate([errors, np.ones_like(errors)])
