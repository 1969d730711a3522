"""Draws in batches: each keeps its place, and banks of any size share a program."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from loops import loop

from muscle_bayes.control.batch import SHOWN_EVERY, SIDE_BY_SIDE, Bank, batch_by_batch, run
from muscle_bayes.control.laws.gains import Gains, law_of
from muscle_bayes.control.scenarios.scenario import Scenario
from muscle_bayes.control.scenarios.thesis import step
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


def test_single_precision_is_double_precision_to_a_fraction_of_a_count(joints):
    """The batch against one joint at a time in double precision, whose law is the board's to the digit."""
    gains = Gains(proportional=1.1e4, integral=300.0, windup_time=30.0, governor=(82.0, 107.0))
    course, few = step(gains.period), joints.take(slice(0, 4))
    scenario = Scenario("step", "", course)
    single = run(Bank(few), law_of(gains, few.design), scenario).angle
    count = few.design.potentiometer.radians_per_count
    for index in range(len(few)):
        double = loop(few.one(index), gains, course).angle[::SHOWN_EVERY]
        assert np.abs(single[index] - double).max() < 0.5 * count
        assert np.ptp(double) > 5.0 * count
