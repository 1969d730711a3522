"""One compiled program for every test that draws parameters: the muscle rig with every effect."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
from example_plants import TABLE_2, D, J, muscle_plant, schedule

from muscle_bayes.physics.effect import Scales
from muscle_bayes.physics.effects import CATALOGUE
from muscle_bayes.physics.response import inertial_response, quasi_static_response

SIZE = Scales(force=0.15, speed=2.0, tension=5.0, range=1.0)
DRAWS = 50
"""Draws in one call, fixed so that it compiles once."""


def nominal():
    """Table 1 and 2 with every effect off, DRAWS times."""
    values = {**TABLE_2, "J": J, "D": D, "hyst": 0.04}
    for name, effect in CATALOGUE.items():
        values |= {f"{name}.{key}": one.off for key, one in effect.parameters.items()}
    return {key: jnp.full(DRAWS, value) for key, value in values.items()}


def prior_draws(effect, seed: int):
    """DRAWS of an effect's parameters from their priors."""
    keys = jax.random.split(jax.random.key(seed), len(effect.parameters))
    return {
        name: parameter.prior(SIZE).sample(key, (DRAWS,))
        for key, (name, parameter) in zip(keys, effect.parameters.items(), strict=True)
    }


def hard_drive(end: float):
    """Heating, loads that jump, a shove into each stop, then padding."""
    time = np.concatenate([np.linspace(0.0, end, 81), np.full(4, end)])
    return schedule(
        time,
        lambda t: 25.0 + 70.0 * np.clip(2.0 * t / end, 0.0, 1.0),
        lambda t: np.select([t < end / 4, t < end / 2], [0.05, 2.0], 0.15),
        lambda t: np.where((t > 0.6 * end) & (t < 0.7 * end), -3.0, 0.0),
    )


def _sums(values):
    made = muscle_plant(values["J"], values["D"], **{key: values[key] for key in TABLE_2})
    for name, effect in CATALOGUE.items():
        made = made + effect(**{key: values[f"{name}.{key}"] for key in effect.parameters})
    q, hyst = jnp.asarray(-0.2), jnp.full(2, values["hyst"])
    quick = inertial_response(made, hard_drive(1.0), q, jnp.asarray(0.0), hyst)
    slow = quasi_static_response(made, hard_drive(200.0), q, hyst)
    sums = [jnp.sum(one.sensed) + jnp.sum(one.hyst) for one in (quick, slow)]
    return jnp.stack(sums), (quick, slow)


@cache
def _compiled():
    # It runs for a second: unoptimised, it compiles in a fifth of the time.
    options = {"xla_backend_optimization_level": 0}
    return jax.jit(jax.vmap(jax.jacfwd(_sums, has_aux=True)), compiler_options=options)


def responses_and_slopes(values):
    """Derivatives of both responses' sums by each value, and the responses."""
    # Through NumPy, so that weak and strong types do not compile twice.
    return _compiled()({key: jnp.asarray(np.asarray(value)) for key, value in values.items()})
