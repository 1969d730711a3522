"""The same point in other basins: with a spring opening elsewhere, with a run beginning otherwise."""

from collections.abc import Callable, Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpyro.distributions import biject_to

from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.program import Program

WALLED = ("F_modulus_min", "F_hyst_min")

LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Prior probabilities below the values that a minimum force is given."""
FIRST_FORCE = ".hyst_force"
"""Ends the names of what is sampled of HYST at runs' first rows."""
SEEN = 0.01
"""Least change of a predicted reading, in the noise expected of one, for another shape."""
SEEN_LATER = 1.0
"""The same for another beginning of a run."""


@Program
def _levels(layout: Layout, data: Data) -> dict[str, Float[Array, " level"]]:
    return {
        name: biject_to(data.priors[name].support).inv(data.priors[name].icdf(jnp.array(LEVELS)))
        for name, _ in layout.shapes
        if name in WALLED
    }


def force_levels(layout: Layout, data: Data) -> dict[str, Float[np.ndarray, " level"]]:
    """Unconstrained values that each minimum force is given; empty where there is no muscle."""
    names = [name for name, _ in layout.shapes if name in WALLED]
    levels = _levels(layout, data) if names else {}
    # In the layout's order, not in that of a compiled program's keys.
    return {name: np.asarray(levels[name]) for name in names}


def first_hyst_levels(
    point: Float[np.ndarray, " n"], entries: Int[np.ndarray, " run"]
) -> dict[int, Float[np.ndarray, " level"]]:
    """HYST's first force of each run as it is in the median run, of two as in the other one."""
    if not entries.size:
        return {}
    begun = point[entries]
    usual = begun[::-1] if entries.size == 2 else np.full(entries.size, np.median(begun))
    return {int(entry): np.array([level]) for entry, level in zip(entries, usual, strict=True)}


def expected_noise(layout: Layout, data: Data) -> list[float]:
    """Prior mean of a reading's noise in each group of lanes [the log's unit]."""
    return [float(data.priors[f"{regime}.noise"].mean) for regime in layout.regimes]


def moved_entries(
    point: Float[np.ndarray, " n"],
    levels: Mapping[int, Float[np.ndarray, " level"]],
    readings: Callable[[np.ndarray], Float[np.ndarray, " reading"]],
    seen: float,
) -> list[Float[np.ndarray, " n"]]:
    """The point with each of these entries at each of its levels, where some reading changes by `seen`.

    `readings`: what a point predicts, in the noise expected of a reading. Levels that predict what the
    point or an earlier level does are left out.
    """
    found: list[np.ndarray] = []
    known = [readings(point)]
    for entry, values in levels.items():
        for value in values:
            moved = np.array(point)
            moved[entry] = value
            there = readings(moved)
            nearest = min(np.abs(there - one).max() for one in known)
            if np.isfinite(there).all() and nearest > seen:
                found.append(moved)
                known.append(there)
    return found
