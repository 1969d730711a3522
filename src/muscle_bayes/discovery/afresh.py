"""Candidates started at draws of the muscle's prior: where misfit is gross, the present fit leads nowhere.

A model that lacks what matters is likeliest where a lasting discrepancy hides most of it, which may be far
from what any better model needs.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.discovery.gross import as_white, is_gross, noise_names
from muscle_bayes.inference.model.prior_draws import sample_prior
from muscle_bayes.inference.records.rig import has_muscle
from muscle_bayes.inference.search.descent import Fitted, descend, go_on
from muscle_bayes.inference.search.mode import SHRUNK
from muscle_bayes.inference.search.nested import Nested, values_at
from muscle_bayes.inference.search.nested_programs import explained_at
from muscle_bayes.physics.effects import effect_type

DRAWS, TRIED, KEPT = 96, 8, 3
"""Draws of the prior, those fitted, likeliest first, and those fitted further."""
EARLY_STEPS, STEPS = 4, 12
"""Of a fit, and of one further, the noise held."""
FIXTURE = "J", "D"
"""What runs without a muscle tell, whatever is missing."""
FIRST_FORCE = "hyst_force"
"""What a run has of its own that is the muscle's."""


def started_afresh(nested: Nested, base: Fitted, effect: str, seed: int) -> list[Fitted]:
    """The model that adds `effect` to `base`, fitted from draws of the prior; best first.

    Fixture, noise and runs' zeros and starts begin as in `base`, all misfit taken for white noise, and
    effects that it has already. Empty where the misfit of `base` is not gross, no run has a muscle, or
    nothing drawn has finite derivatives.
    """
    if not (is_gross(nested, base) and any(map(has_muscle, nested.problem.runs))):
        return []
    effects, noise = (*base.effects, effect), noise_names(nested)
    points = _drawn(nested, as_white(nested, base), effects, jax.random.key(seed))
    choice = nested.choice(effects)

    def potential(point: np.ndarray) -> float:
        seen = explained_at(jnp.asarray(point), choice, nested.layout, nested.data)
        return float(np.nan_to_num(float(seen.potential), nan=np.inf))

    levels = np.array([potential(point) for point in points])
    order = [index for index in np.argsort(levels)[:TRIED] if np.isfinite(levels[index])]
    begun = [descend(nested, effects, points[index], EARLY_STEPS, noise) for index in order]
    found = [go_on(nested, one, STEPS, noise) for one in _best_first(begun)[:KEPT]]
    return _best_first(found)


def _best_first(fits: Sequence[Fitted]) -> list[Fitted]:
    return sorted((one for one in fits if one.slope.finite), key=lambda one: one.potential)


def _drawn(
    nested: Nested, seen: Fitted, effects: Sequence[str], key: Array
) -> list[Float[np.ndarray, " n"]]:
    """Points; the last of the effects is weak in every other one."""
    present = values_at(jnp.asarray(seen.point), seen.choice, nested.layout, nested.data)
    draws = sample_prior(key, DRAWS, nested.layout, nested.data)
    effect = effect_type(effects[-1])
    off = {f"{effect.name}.{key}": parameter.off for key, parameter in effect.parameters.items()}
    muscle = [
        name
        for name, _ in nested.layout.shapes
        if name.endswith(FIRST_FORCE) or not ("." in name or name in FIXTURE)
    ]

    def point(index: int) -> np.ndarray:
        share = SHRUNK if index % 2 else 1.0
        drawn = {name: draws[name][index] for name in muscle}
        own = {name: at + share * (draws[name][index] - at) for name, at in off.items()}
        return nested.point({**present, **drawn, **own}, effects)

    return [point(index) for index in range(DRAWS)]
