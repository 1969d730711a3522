"""Draws of the prior, impossible ones left out."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.density import is_possible
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program

BATCH = 500
ATTEMPTS = 100
"""Batches after which a prior is taken for impossible."""


@Program
def _batch(key: Array, layout: Layout, data: Data) -> tuple[dict[str, Array], Bool[Array, " draw"]]:
    keys = jax.random.split(key, len(layout.shapes))
    values = {
        name: data.priors[name].sample(key, (BATCH,))
        for key, (name, _) in zip(keys, layout.shapes, strict=True)
    }
    return values, jax.vmap(lambda one: is_possible(one, data))(values)


def prior_draws(key: Array, count: int, layout: Layout, data: Data) -> dict[str, Array]:
    """`count` draws of all sampled values, a leading axis of each.

    Raises MuscleBayesError where the prior holds hardly anything that is possible.
    """
    found: list[dict[str, np.ndarray]] = []
    missing = count
    for attempt in range(ATTEMPTS):
        values, possible = _batch(jax.random.fold_in(key, attempt), layout, data)
        chosen = np.flatnonzero(possible)[:missing]
        found.append({name: np.asarray(value)[chosen] for name, value in values.items()})
        missing -= chosen.size
        if not missing:
            return {name: jnp.concatenate([part[name] for part in found]) for name in found[0]}
    raise MuscleBayesError(
        "hardly any prior draw is possible for these runs; check the geometry in their metadata "
        "(lengths in m, masses in kg, angles in rad)"
    )
