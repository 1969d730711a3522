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


def sample_prior(key: Array, count: int, layout: Layout, data: Data) -> dict[str, Array]:
    """`count` draws of all sampled values, possible or not.

    Not one compiled program: that holds a random generator for each quantity, and takes seconds to
    compile.
    """
    keys = jax.random.split(key, len(layout.shapes))
    return {
        name: data.priors[name].sample(key, (count,))
        for key, (name, _) in zip(keys, layout.shapes, strict=True)
    }


@Program
def _possible(values: dict[str, Array], layout: Layout, data: Data) -> Bool[Array, " draw"]:
    return jax.vmap(lambda one: is_possible(one, data))(values)


def prior_draws(key: Array, count: int, layout: Layout, data: Data) -> dict[str, Array]:
    """`count` draws of all sampled values, a leading axis of each.

    Raises MuscleBayesError where the prior holds hardly anything that is possible.
    """
    found: list[dict[str, np.ndarray]] = []
    missing = count
    for attempt in range(ATTEMPTS):
        values = sample_prior(jax.random.fold_in(key, attempt), BATCH, layout, data)
        chosen = np.flatnonzero(_possible(values, layout, data))[:missing]
        found.append({name: np.asarray(value)[chosen] for name, value in values.items()})
        missing -= chosen.size
        if not missing:
            return {name: jnp.concatenate([part[name] for part in found]) for name in found[0]}
    raise MuscleBayesError(
        "hardly any prior draw is possible for these runs; check the geometry in their metadata "
        "(lengths in m, masses in kg, angles in rad)"
    )
