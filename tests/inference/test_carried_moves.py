"""Carried moves: by the surrogate they draw from what plain moves draw from."""

from pathlib import Path

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.bend_hyst import starts
from muscle_bayes.inference.bend_walls import bent_walls
from muscle_bayes.inference.bent_rows import bent_rows
from muscle_bayes.inference.blocks import MODULUS, blocks
from muscle_bayes.inference.carried_moves import offer_carried
from muscle_bayes.inference.chained_moves import chained
from muscle_bayes.inference.density import potential_given
from muscle_bayes.inference.noise_moves import move_noise
from muscle_bayes.inference.optimise import find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import pose
from muscle_bayes.inference.ridge import has_ridge, offer_along_ridge, ridge_of
from muscle_bayes.inference.surrogate import first_surrogate
from muscle_bayes.inference.whitening import placed, straight, whitened
from muscle_bayes.inference.whitening_at_mode import whitening

DATA = Path(__file__).parents[2] / "data"
ITERATIONS, CHAINS = 800, 4
LEAPS, STRIDE = 6, 0.25
SWING, SPREAD = 1.0, 0.03


@pytest.mark.slow
@double_precision
def test_they_draw_from_what_plain_moves_draw_from() -> None:
    """In both chains trajectories of smooth entries come between; all is judged by the surrogate."""
    problem = pose(read_runs([DATA / "staircase-166g.csv"]))
    layout, data = problem.layout, problem.data
    mode = find_mode(jax.random.key(0), layout, data)
    white = whitening(mode, layout, data)
    surrogate = first_surrogate(jax.random.key(1), white, layout, data)
    outer = blocks(layout).walled
    force = starts(layout)[MODULUS]
    which = list(outer).index(force)
    # As where readings tell the force, which they do not here: they would swing by it.
    place = white.factor.shape[0] + which
    swing = SWING * jnp.sin(jnp.linspace(0.0, 20.0, data.lanes[0].reading.shape[1]))
    slope = surrogate.slope[0]
    slope = slope._replace(reading=slope.reading.at[..., place].add(swing))
    surrogate = surrogate._replace(slope=[slope])
    spread = white.ridge.spread.at[which].set(SPREAD)
    white = white._replace(ridge=white.ridge._replace(spread=spread))
    assert has_ridge(white.ridge)[which]

    def energy(vector):
        predicted = surrogate.at(straight(vector, white, layout, data))
        return jnp.nan_to_num(potential_given(predicted, vector, layout, data), nan=jnp.inf)

    def trajectory(key, vector):
        key_momentum, key_accept = jax.random.split(key)
        rest = vector.at[outer].set(bent_walls(vector, layout, data)[outer])

        def along(z):
            point, x = placed(z, rest, white, layout, data)
            level = potential_given(surrogate.at(x), point.vector, layout, data)
            return level - point.log_volume, point.vector

        z = whitened(vector, white, layout, data)
        begun = jax.random.normal(key_momentum, z.shape)

        def leap(_, now):
            z, momentum = now
            momentum -= 0.5 * STRIDE * jax.grad(along, has_aux=True)(z)[0]
            z += STRIDE * momentum
            return z, momentum - 0.5 * STRIDE * jax.grad(along, has_aux=True)(z)[0]

        end, momentum = jax.lax.fori_loop(0, LEAPS, leap, (z, begun))
        rise = along(end)[0] - along(z)[0] + 0.5 * (momentum @ momentum - begun @ begun)
        taken = jnp.log(jax.random.uniform(key_accept)) < -rise
        return jnp.where(taken, along(end)[1], vector)

    def plain(key, vector):
        key_noise, key_ridge = jax.random.split(key)
        predicted = surrogate.at(straight(vector, white, layout, data))
        vector = move_noise(key_noise, predicted, vector, white.noise, layout, data).vector

        def along(key, vector):
            return offer_along_ridge(key, which, vector, ridge, white.bend, layout, data)

        return chained(key_ridge, vector, energy, along, 10).vector

    def carried(key, vector):
        return offer_carried(key, vector, white, surrogate, layout, data).vector

    def drawn(move, seed):
        def iterate(vector, key):
            key_move, key_trajectory = jax.random.split(key)
            vector = trajectory(key_trajectory, move(key_move, vector))
            return vector, vector

        keys = jax.random.split(jax.random.key(seed), (CHAINS, ITERATIONS))
        scan = jax.jit(jax.vmap(lambda keys: jax.lax.scan(iterate, mode.vector, keys)[1]))
        return np.asarray(scan(keys))[:, ITERATIONS // 10 :]

    carried_draws = drawn(carried, 2)
    seen = bent_rows(carried_draws.reshape(-1, mode.vector.size), white.bend, layout, data)
    ridge = ridge_of(seen.mean(axis=0)[outer], np.cov(seen.T)[outer], layout)
    plain_draws = drawn(plain, 3)
    trees = [az.convert_to_datatree({"v": draws}) for draws in (plain_draws, carried_draws)]
    error = np.hypot(*(az.mcse(tree)["v"].values for tree in trees))
    moved = [index for index in range(mode.vector.size) if index not in outer or index == force]
    away = (plain_draws - carried_draws).mean(axis=(0, 1))[moved] / error[moved]
    np.testing.assert_array_less(np.abs(away), 4.0)
    ratio = plain_draws.std(axis=(0, 1)) / carried_draws.std(axis=(0, 1))
    np.testing.assert_allclose(ratio[moved], 1.0, atol=0.15)
