"""Draws in batches: each keeps its place, and banks of any size share a program."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.control.batch import SIDE_BY_SIDE, batch_by_batch
from muscle_bayes.inference.running.precision import double_precision


@double_precision
def test_every_draw_keeps_its_place_and_one_program_serves_all_sizes():
    traced = []

    @partial(jax.jit, static_argnames=("power",))
    def program(values, offset, *, power):
        traced.append(values["x"].shape)
        return {"y": offset + values["x"] ** power, "twice": 2.0 * values["x"]}

    for count in (SIDE_BY_SIDE, 3 * SIDE_BY_SIDE + 2):
        x = np.linspace(-1.0, 2.0, count)
        found = batch_by_batch(program, ({"x": jnp.asarray(x)},), (0.5,), power=3)
        np.testing.assert_allclose(found["y"], 0.5 + x**3, rtol=1e-5, atol=1e-6)
        np.testing.assert_array_equal(found["twice"], 2.0 * x.astype(np.float32))
    assert traced == [(SIDE_BY_SIDE,)]
