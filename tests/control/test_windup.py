"""The integral at the limit, against what can be worked out by hand."""

import jax.numpy as jnp
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import IntegerPI

from muscle_bayes.control.laws.feed import NoFeed
from muscle_bayes.control.laws.law import Measured
from muscle_bayes.control.laws.pi import PI
from muscle_bayes.control.laws.split import SplitPI
from muscle_bayes.control.laws.windup import Conditional, Unlimited

KP, KI, ERROR, PUSHED = 2.0, 0.5, 50.0, 100


def periods_at_the_limit(windup) -> int:
    """Periods for which the output stays at its limit once an error of 50 has turned to -50."""
    pi, total = PI(jnp.asarray(KP), jnp.asarray(KI), windup), jnp.zeros(())
    for _ in range(PUSHED):
        total, output = pi.update(total, jnp.asarray(ERROR), jnp.zeros(()))
    assert output == 255.0
    for count in range(1000):
        total, output = pi.update(total, jnp.asarray(-ERROR), jnp.zeros(()))
        if output < 255.0:
            return count
    raise AssertionError("never came back")


def test_without_anti_windup_it_takes_as_long_to_come_back_as_it_was_pushed():
    # sum = 50 (100 - n) after n periods: -100 + 25 (100 - n) < 255 from n = 86 on: 85 were at it.
    assert periods_at_the_limit(Unlimited()) == 85


def test_with_anti_windup_it_comes_back_at_once():
    # The sum stopped where 100 + 0.5 sum first reached 255 (sum = 350): -100 + 0.5 300 = 50 < 255.
    assert periods_at_the_limit(Conditional()) == 0


def test_the_guarded_sum_stops_where_the_limit_is_reached():
    pi, total = PI(jnp.asarray(KP), jnp.asarray(KI), Conditional()), jnp.zeros(())
    for _ in range(PUSHED):
        total, _ = pi.update(total, jnp.asarray(ERROR), jnp.zeros(()))
    assert float(total) == pytest.approx(350.0)


@settings(max_examples=30, deadline=None)
@given(
    st.integers(-32767, 32767),
    st.integers(-32767, 32767),
    st.integers(0, 255),
    st.integers(0, 1023),
    st.lists(st.integers(0, 1023), min_size=1, max_size=30),
)
def test_the_law_is_the_firmwares_digit_for_digit(kp, ki, bias, setpoint, readings):
    law = SplitPI(
        PI(jnp.asarray(kp / 256), jnp.asarray(ki / 65536), Conditional()),
        jnp.asarray(float(bias)),
        NoFeed(),
    )
    plain, state = IntegerPI(kp, ki, bias), law.initial()
    for reading in readings:
        seen = Measured(jnp.asarray(float(setpoint)), jnp.asarray(float(reading)), jnp.zeros(2))
        state, duty = law.update(state, seen)
        assert tuple(map(int, duty)) == plain(setpoint, reading)
