"""Heater tubes: exact steps, bounds."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from muscle_bayes.control.plant.heater import Heater, HeaterState


def tubes(gain, cooling, lag, room):
    """Two alike."""
    return Heater(*(jnp.full(2, x) for x in (gain, cooling, lag)), jnp.asarray(room))


@pytest.mark.parametrize("lag", [0.5, 5.0])
def test_step_solves_the_equations(lag):
    heater = tubes(4.2, 0.021, lag, 22.0)
    step, state = heater.step(0.7), HeaterState(jnp.array([0.3, 0.0]), jnp.array([10.0, 2.0]))
    duty = np.array([200.0, 40.0])

    def rates(t, x):
        return np.r_[(duty / 255 - x[:2]) / lag, 4.2 * x[:2] - 0.021 * x[2:]]

    start = np.r_[state.power, state.excess]
    solved = solve_ivp(rates, (0, 2.1), start, rtol=1e-11, atol=1e-12)
    for _ in range(3):
        state = step(state, jnp.asarray(duty))
    assert np.r_[state.power, state.excess] == pytest.approx(solved.y[:, -1], rel=1e-8)


def test_without_lag_the_duty_heats_at_once():
    heater = tubes(4.5, 1 / 48, 0.0, 25.0)
    state = HeaterState(jnp.zeros(2), jnp.zeros(2))
    state = heater.step(10.0)(state, jnp.full(2, 255.0))
    assert np.asarray(state.excess) == pytest.approx(4.5 * 48 * (1 - np.exp(-10 / 48)), rel=1e-12)


@settings(max_examples=50, deadline=None)
@given(
    st.floats(0.5, 10),
    st.floats(0.005, 0.05),
    st.floats(0, 5),
    st.lists(st.floats(0, 255), min_size=1, max_size=40),
)
def test_temperature_stays_between_room_and_full_power(gain, cooling, lag, duties):
    heater = tubes(gain, cooling, lag, 25.0)
    step, state = heater.step(3.0), HeaterState(jnp.zeros(2), jnp.zeros(2))
    for duty in duties:
        state = step(state, jnp.full(2, duty))
        assert (np.asarray(state.excess) >= -1e-9).all()
        assert (np.asarray(state.excess) <= gain / cooling * (1 + 1e-9)).all()


def test_holding_duty_holds():
    heater = tubes(4.2, 0.021, 0.5, 22.0)
    duty = heater.holding_duty(jnp.asarray(40.0), 1)
    state = HeaterState(jnp.full(2, duty / 255), jnp.full(2, 40.0))
    after = heater.step(50.0)(state, jnp.full(2, duty))
    assert np.asarray(after.excess) == pytest.approx(40.0, rel=1e-12)
