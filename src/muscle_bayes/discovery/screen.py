"""A cheap look at every effect: what of the misfit could it explain that present parameters cannot?"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import biject_to

from muscle_bayes.inference.search.descent import Fitted
from muscle_bayes.inference.search.nested import SLOT_STEP, Nested, general
from muscle_bayes.inference.search.nested_programs import explained_at
from muscle_bayes.physics.effects import effect_type

DRAWS = 12
"""Draws of an effect's prior, each looked at in every strength."""
STRENGTHS = (1.0, 0.1, 0.01)
"""Distances from the off value, as shares of the draw's."""


class Start(NamedTuple):
    """One strength of an effect, with present parameters moved to make room for it."""

    strength: float
    """Share of the prior draw's distance from off."""
    gain: float
    """Rise of the log density that it promises: r . d - |d|^2 / 2, with d its change of the
    standardised errors and r the errors, both after present parameters have absorbed their share."""
    point: Float[np.ndarray, " n"]
    signature: Float[np.ndarray, " error"]
    """d."""


def starts_of(nested: Nested, base: Fitted, effect: str, key: Array) -> list[Start]:
    """Starts of a candidate that adds `effect` to `base`, most promising first.

    Strengths far from off are simulated, not extrapolated: an effect that acts only beyond some
    threshold has no slope where it is off.
    """
    layout, data = nested.layout, nested.data
    effects = (*base.effects, effect)
    choice = nested.choice(effects)
    slopes, kept = base.jacobian, base.errors
    found = []
    for strength, own in _draws(nested, effect, key):
        judged = explained_at(
            jnp.asarray(_joined(nested, base, base.point, own)), choice, layout, data
        )
        errors = np.concatenate([np.asarray(fit.errors).ravel() for fit in judged.fits])
        if not (np.isfinite(float(judged.potential)) and np.isfinite(errors).all()):
            continue
        change = errors - kept
        absorbed = base.precision.solve(slopes.T @ change)
        rest = change - slopes @ absorbed
        gain = float(-kept @ rest - 0.5 * (rest @ rest))
        moved = base.point.copy()
        moved[: base.used] -= np.clip(absorbed, -1.0, 1.0)
        found.append(Start(strength, gain, _joined(nested, base, moved, own), rest))
    return sorted(found, key=lambda one: -one.gain)


def redrawn(nested: Nested, fitted: Fitted, key: Array, count: int) -> list[np.ndarray]:
    """The fit's point with its last effect as drawn from its prior, `count` times."""
    drawn = _draws(nested, fitted.effects[-1], key)
    whole = [own for strength, own in drawn if strength == 1.0][:count]
    points = [fitted.point.copy() for _ in whole]
    for point, own in zip(points, whole, strict=True):
        point[fitted.used - own.size : fitted.used] = own
    return points


def _joined(nested: Nested, base: Fitted, point: np.ndarray, own: np.ndarray) -> np.ndarray:
    """The base's point with slots for one effect more."""
    slots = np.concatenate([point[nested.shared : base.used], own])
    room = -(-slots.size // SLOT_STEP) * SLOT_STEP
    return np.concatenate([point[: nested.shared], slots, np.zeros(room - slots.size)])


def _draws(nested: Nested, effect: str, key: Array) -> list[tuple[float, np.ndarray]]:
    """Strength, and the effect's parameters, unconstrained, of draws of its prior."""
    parameters, held = effect_type(effect).parameters, general(effect)
    parts = jax.random.split(key, len(parameters))
    columns = []
    for part, (name, parameter) in zip(parts, parameters.items(), strict=True):
        prior = nested.data.priors[f"{held}.{name}"]
        drawn = prior.sample(part, (DRAWS, 1))
        scaled = parameter.off + jnp.array(STRENGTHS) * (drawn - parameter.off)
        columns.append(biject_to(prior.support).inv(scaled).ravel())
    return list(zip(STRENGTHS * DRAWS, np.stack(columns, axis=1), strict=True))
