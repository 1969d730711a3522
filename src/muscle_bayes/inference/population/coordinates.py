"""A muscle in nine coordinates in which specimens scatter about a mean: logarithms where positive.

The quantities are those of `muscle_sites`; taut strain and bend may have either sign and are taken as
they are, softening lies between 0 and 1 and is taken by its logit.
"""

from collections.abc import Mapping
from typing import Final

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.inference.model.muscle_prior import (
    MUSCLE_PARAMETERS,
    completed,
    muscle_parameters,
)
from muscle_bayes.inference.running.precision import double_precision

NAMES: Final = (
    "taut_strain",
    "contraction",
    "bend",
    "modulus",
    "F_modulus_min",
    "stiffness_hyst",
    "F_hyst_min",
    "time_constant",
    "softening",
)
SITE_UNITS: Final = dict(zip(NAMES, ("1", "1", "1", "N", "N", "N", "N", "s", "1"), strict=True))
"""Units of these quantities."""
PLAIN: Final = ("taut_strain", "bend")

Coordinates = Float[np.ndarray, "draw coordinate"]


@double_precision
def coordinates(table: Mapping[str, np.ndarray], base_length: float, tension: float) -> Coordinates:
    """Coordinates of draws of Table 2's parameters; taut strain is that under `tension` [N]."""
    known = completed(
        {name: jnp.asarray(table[name]).reshape(-1) for name in MUSCLE_PARAMETERS},
        base_length,
        tension,
    )
    columns = []
    for name in NAMES:
        value = np.asarray(known[name], float)
        if name == "softening":
            value = np.log(value / (1.0 - value))
        elif name not in PLAIN:
            value = np.log(value)
        columns.append(value)
    return np.stack(columns, axis=1)


def quantities(place: Coordinates) -> dict[str, np.ndarray]:
    """The quantities of `NAMES` at these coordinates."""
    values = {}
    for name, column in zip(NAMES, place.T, strict=True):
        if name == "softening":
            values[name] = 1.0 / (1.0 + np.exp(-column))
        else:
            values[name] = column if name in PLAIN else np.exp(column)
    return values


@double_precision
def table_of(place: Coordinates, base_length: float, tension: float) -> dict[str, np.ndarray]:
    """Table 2's parameters of muscles at these coordinates."""
    found = muscle_parameters(quantities(place), base_length, tension)
    return {name: np.asarray(getattr(found, name)) for name in MUSCLE_PARAMETERS}
