"""The misfit as a linear regression on what each effect would change."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from muscle_bayes.discovery.screen import Start
from muscle_bayes.inference.search.descent import Fitted


@dataclass(frozen=True)
class Regression:
    """y = X b + noise: y the standardised errors, X the effects' signatures, of unit length each.

    A signature is the change of the errors by the most promising of an effect's starts, less what
    present parameters absorb. Least squares of any selection of effects needs no more than this.
    """

    effects: tuple[str, ...]
    gram: Float[np.ndarray, "effect effect"]
    """X'X."""
    projection: Float[np.ndarray, " effect"]
    """X'y."""
    total: float
    """y'y."""
    errors: int
    """Length of y."""


def regression_on(base: Fitted, screened: Mapping[str, Sequence[Start]]) -> Regression:
    """The regression of a fit's errors, candidates without any finite start left out."""
    starts = {name: found[0] for name, found in screened.items() if found}
    columns = np.stack([one.signature for one in starts.values()], axis=1)
    length = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(length > 0.0, length, 1.0)
    # Errors e of the readings are what an effect should take away.
    wanted = -base.errors
    return Regression(
        tuple(starts),
        columns.T @ columns,
        columns.T @ wanted,
        float(wanted @ wanted),
        int(np.count_nonzero(base.log_densities)),
    )
