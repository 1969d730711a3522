"""The same point in other basins: with a spring opening elsewhere, with a run beginning otherwise."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import biject_to

from muscle_bayes.inference.model.muscle_prior import MINIMUM_FORCES
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.program import program
from muscle_bayes.inference.running.programs import predictions_at
from muscle_bayes.inference.search.tempering import entry_names

LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Prior probabilities below the values that a minimum force is given."""


@program
def _levels(layout: Layout, data: Data) -> dict[str, Float[Array, " level"]]:
    return {
        name: biject_to(data.priors[name].support).inv(data.priors[name].icdf(jnp.array(LEVELS)))
        for name, _ in layout.shapes
        if name in MINIMUM_FORCES
    }


def alternatives(
    point: Float[np.ndarray, " n"], quantities: Sequence[str], layout: Layout, data: Data
) -> list[tuple[int, float, float]]:
    """Of a vector of these `quantities`: entry, another value of it, and the change of some reading, in its
    expected noise, from which on that makes another shape.

    Each minimum force at quantiles of its prior: while the tension stays on one side of it, nothing tells
    a descent what lies on the other. And each run's HYST begun as in the median run, of two as in the
    other one: a rotor that is held from the first row on hides where in its dead band it is.
    """
    names = np.array(quantities)
    if not np.isin(MINIMUM_FORCES, names).any():
        return []
    found = [
        (int(np.flatnonzero(names == name)[0]), float(value), 0.01)
        for name, values in sorted(_levels(layout, data).items(), reverse=True)
        for value in np.asarray(values)
    ]
    first = np.flatnonzero(np.char.endswith(names, ".hyst_lag"))
    if not first.size:
        return found
    begun = point[first]
    usual = begun[::-1] if first.size == 2 else np.full(first.size, np.median(begun))
    return found + [(int(e), float(v), 1.0) for e, v in zip(first, usual, strict=True)]


def with_other_basins(
    vector: Float[Array, " n"], layout: Layout, data: Data
) -> list[Float[np.ndarray, " n"]]:
    """The unconstrained vector in basins that no descent from it would enter, where this is seen.

    Values that predict what the vector or an earlier one does are left out.
    """
    expected = [float(data.priors[f"{regime}.noise"].mean) for regime in layout.regimes]

    def readings(vector: np.ndarray) -> np.ndarray:
        groups = zip(
            predictions_at(jnp.asarray(vector), layout, data), data.lanes, expected, strict=True
        )
        return np.concatenate(
            [
                (np.asarray(one.reading) / noise)[np.asarray(lanes.weight) > 0]
                for one, lanes, noise in groups
            ]
        )

    point = np.asarray(vector)
    others = alternatives(point, entry_names(layout), layout, data)
    known = {0.01: [readings(point)], 1.0: [readings(point)]} if others else {}
    found = []
    for entry, value, seen in others:
        moved = point.copy()
        moved[entry] = value
        there = readings(moved)
        nearest = min(np.abs(there - one).max() for one in known[seen])
        if np.isfinite(there).all() and nearest > seen:
            found.append(moved)
            known[seen].append(there)
    return found
