"""Derivatives through the loop against finite differences."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from loops import joint_of
from published import HEATER, TABLE_1_LINEAR, TABLE_2

from muscle_bayes.control.closed_loop import Clock, simulate, start_of
from muscle_bayes.control.cost import Cost
from muscle_bayes.control.gains import Gains
from muscle_bayes.control.laws.feed import NoFeed
from muscle_bayes.control.laws.pi import PI
from muscle_bayes.control.laws.split import SplitPI
from muscle_bayes.control.laws.windup import Conditional
from muscle_bayes.control.rounding import rounded, truncated
from muscle_bayes.control.scenarios import course_of
from muscle_bayes.control.sensors import Potentiometer

FINE = 1e-7
"""Share of a count, and of a unit of duty, to which the smooth loop rounds."""


def test_derivatives_through_a_loop_without_rounding_are_those_of_finite_differences():
    """Rounding so fine that it does not count: what is left must be the exact derivative."""
    time = 0.03 * np.arange(500)
    course = course_of(np.where(time > 1.0, 0.04, 0.0), 0.0 * time)
    values = TABLE_1_LINEAR | TABLE_2 | HEATER | {"heater.lag": 0.4}
    joint = joint_of(values)
    start = start_of(joint, jnp.zeros(()), jnp.zeros(()))

    def cost(numbers):
        proportional, integral, bias, gain, compliance = numbers
        sensor = Potentiometer(0.0058 * FINE, 0.0, 0.0)
        one = eqx.tree_at(
            lambda j: (j.heater.gain, j.plant.side_b.parameters.K_modulus),
            joint,
            (gain, compliance),
        )
        one = eqx.tree_at(lambda j: j.potentiometer, one, sensor)
        pi = PI(
            -proportional * 0.0058 * FINE,
            -integral * 0.0058 * FINE * 0.03,
            Conditional(),
            255,
            FINE,
        )
        law = SplitPI(pi, bias, NoFeed())
        trace = simulate(one, law, course, start, jax.random.key(0), Clock())
        return Cost()(course, trace)

    at = jnp.array([2000.0, 150.0, 8.0, 4.5, 186.0])
    # The converter's range must not clip the fine counts.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("muscle_bayes.control.sensors.FULL_SCALE", jnp.inf)
        patch.setattr(Potentiometer, "read", lambda self, q, noise: rounded(self.counts(q)))
        both = jax.jit(lambda x: (cost(x), jax.jacfwd(cost)(x)))
        slope = both(at)[1]
        for place, step in enumerate((2.0, 0.5, 0.01, 1e-3, 0.05)):
            change = jnp.zeros(5).at[place].set(step)
            difference = (both(at + change)[0] - both(at - change)[0]) / (2 * step)
            assert slope[place] == pytest.approx(float(difference), rel=2e-3, abs=1e-9)


@pytest.mark.parametrize("function", [rounded, truncated])
def test_rounding_has_the_stated_derivative(function):
    at = jnp.array([-2.7, -0.2, 0.4, 3.6])
    assert np.asarray(function(at)) == pytest.approx(
        np.rint(at) if function is rounded else np.trunc(at)
    )
    assert np.asarray(jax.vmap(jax.grad(function))(at)) == pytest.approx(np.ones(4))


def test_gains_move_the_cost_as_their_surrogate_derivative_says(joints):
    """With real rounding the derivative is a surrogate: right in sign, and within half of the slope over
    steps so large that single counts do not matter."""
    from muscle_bayes.control.batch import Bank
    from muscle_bayes.control.laws.build import Numbers
    from muscle_bayes.control.scenario import Scenario
    from muscle_bayes.control.sensitivity import judged_values

    time = 0.03 * np.arange(1000)
    scenario = Scenario("s", "", course_of(np.where(time > 1, 0.06, 0.0), 0 * time, noise=True))
    bank, blank = Bank(joints), Gains(proportional=1.0, integral=1.0)

    def cost(numbers):
        found, slope = judged_values(bank, blank, numbers, scenario, Cost())
        return found["cost"].mean(), slope["cost"].mean(axis=0)

    at = Numbers(3000.0, 100.0, 5.0)
    for place, step in ((0, 600.0), (2, 2.0)):
        up, down = (at._replace(**{at._fields[place]: at[place] + sign * step}) for sign in (1, -1))
        difference = (cost(up)[0] - cost(down)[0]) / (2 * step)
        assert cost(at)[1][place] == pytest.approx(difference, rel=0.5)
