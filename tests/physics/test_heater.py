"""A body that a heater's power warms, against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.physics.heater import HeatedBody, LoggedTemperature

RATE, COOLING, ROOM = 2.5, 40.0, 22.0


def test_a_constant_power_settles_as_newton_says() -> None:
    time = jnp.asarray([0.0, 0.5, 3.0, 3.0, 20.0, 200.0, 2000.0])
    found = HeatedBody(RATE, COOLING, ROOM).temperature(time, 0.4 * jnp.ones(time.size))
    wanted = ROOM + 0.4 * RATE * COOLING * (1.0 - np.exp(-np.asarray(time) / COOLING))
    np.testing.assert_allclose(found, wanted, rtol=1e-6)


def test_a_ramp_of_power() -> None:
    """u = t: T - room = rate tau (t - tau (1 - exp(-t / tau)))."""
    time = jnp.linspace(0.0, 90.0, 10)
    found = HeatedBody(RATE, COOLING, ROOM).temperature(time, time)
    t = np.asarray(time)
    wanted = ROOM + RATE * COOLING * (t - COOLING * (1.0 - np.exp(-t / COOLING)))
    np.testing.assert_allclose(found, wanted, rtol=1e-5)


def test_its_derivatives_are_finite_also_in_padding() -> None:
    time = jnp.asarray([0.0, 1.0, 5.0, 5.0, 5.0])
    power = jnp.asarray([0.4, 0.4, 0.0, 0.0, 0.0])

    def end(rate: float, cooling: float) -> jax.Array:
        return HeatedBody(rate, cooling, ROOM).temperature(time, power)[-1]

    slopes = jax.grad(end, (0, 1))(RATE, COOLING)
    step = 1e-2
    numeric = [
        (end(RATE + step, COOLING) - end(RATE - step, COOLING)) / (2 * step),
        (end(RATE, COOLING + step) - end(RATE, COOLING - step)) / (2 * step),
    ]
    assert np.asarray(slopes) == pytest.approx(np.asarray(numeric), rel=2e-2)


def test_a_thermometer_is_believed() -> None:
    logged = jnp.asarray([20.0, 30.0])
    assert LoggedTemperature().temperature(jnp.asarray([0.0, 1.0]), logged) is logged
    assert HeatedBody().estimated() == ("heating_rate", "cooling_time")
