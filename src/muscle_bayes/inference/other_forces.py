"""The same shape with a spring opening elsewhere: which springs open at which loads parts basins."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import biject_to

from muscle_bayes.inference.blocks import WALLED, blocks
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program
from muscle_bayes.inference.programs import predictions_at

LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Prior probabilities below the values that a minimum force is given."""
SEEN = 0.01
"""Least change of a predicted reading, in the noise expected of one, for another shape."""


@Program
def _levels(layout: Layout, data: Data) -> Float[Array, "walled level"]:
    names = [name for name, _ in layout.shapes if name in WALLED]
    priors = [data.priors[name] for name in names]
    return jnp.stack([biject_to(p.support).inv(p.icdf(jnp.array(LEVELS))) for p in priors])


def _readings(vector: Array, layout: Layout, data: Data) -> Float[np.ndarray, " reading"]:
    """Predicted readings, in the noise expected of one."""
    predicted = predictions_at(vector, layout, data)
    expected = [float(data.priors[f"{regime}.noise"].mean) for regime in layout.regimes]
    parts = zip(predicted, data.lanes, expected, strict=True)
    return np.concatenate(
        [
            (np.asarray(one.reading) / noise)[np.asarray(lanes.weight) > 0]
            for one, lanes, noise in parts
        ]
    )


def with_other_forces(
    vector: Float[Array, " n"], layout: Layout, data: Data
) -> list[Float[Array, " n"]]:
    """The unconstrained vector with each minimum force at quantiles of its prior, where this is seen.

    While the tension stays on one side of a minimum force, nothing tells a descent what lies on the
    other: it ends in the basin where it began. A force that opens its spring where another did changes
    no prediction, taut_strain being held, and is left out.
    """
    walled = blocks(layout).walled
    if not walled.size:
        return []
    found: list[Array] = []
    known = [_readings(vector, layout, data)]
    for entry, levels in zip(walled, np.asarray(_levels(layout, data)), strict=True):
        for level in levels:
            moved = jnp.asarray(vector).at[int(entry)].set(level)
            there = _readings(moved, layout, data)
            nearest = min(np.abs(there - one).max() for one in known)
            if np.isfinite(there).all() and nearest > SEEN:
                found.append(moved)
                known.append(there)
    return found
