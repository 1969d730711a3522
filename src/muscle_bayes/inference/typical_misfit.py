"""How large slow misfit typically is over draws of the noise's parameters."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.noise_moves import lasting_misfit, reading_spacing
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program
from muscle_bayes.inference.row_blocks import in_blocks


@Program
def _misfits(
    noise: Float[Array, "row k"], layout: Layout, data: Data
) -> Float[Array, "row regime"]:
    spacing = reading_spacing(layout, data)
    return jax.vmap(lambda entries: lasting_misfit(entries, spacing))(noise)


def typical_misfit(
    noise: Float[np.ndarray, "row k"], layout: Layout, data: Data
) -> Float[Array, " regime"]:
    """Median of `lasting_misfit` over rows."""
    return jnp.asarray(np.median(in_blocks(_misfits, noise, layout, data), axis=0))
