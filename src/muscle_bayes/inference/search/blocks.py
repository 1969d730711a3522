"""Which entries of the unconstrained vector which part of the sampler moves."""

from typing import NamedTuple

import numpy as np

from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import Layout

MODULUS, HYST = WALLED = ("F_modulus_min", "F_hyst_min")


class Blocks(NamedTuple):
    """Indices of the unconstrained vector, each entry in exactly one block."""

    smooth: np.ndarray
    """Parameters in which the posterior, noise given, is nearly normal."""
    walled: np.ndarray
    """The springs' minimum forces. Below the least force in the record they change nothing, above
    it nearly everything: such a wall throws gradient-based samplers off."""
    noise: np.ndarray
    """Noise parameters: their density is a curved funnel (a short-lived discrepancy is white noise,
    a vanishing one has no correlation time), but costs no simulation."""


def blocks(layout: Layout) -> Blocks:
    """The blocks of a layout."""
    endings = tuple(f".{key}" for key in NoiseParameters._fields)
    names = np.repeat(
        [name for name, _ in layout.shapes], [int(np.prod(shape)) for _, shape in layout.shapes]
    )
    walled = np.isin(names, WALLED)
    noise = np.array([name.endswith(endings) for name in names])
    return Blocks(*(np.flatnonzero(flag) for flag in (~walled & ~noise, walled, noise)))
