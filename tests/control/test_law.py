"""The law, in JAX, against integers in plain Python; anti-windup, governor and filter by hand."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import IntegerLaw

from muscle_bayes.control.laws.gains import FeedForward, Gains, Inner, board_numbers, law_of
from muscle_bayes.control.laws.law import Law, Measured, Numbers
from muscle_bayes.control.plant.design import Design

NUMBERS = st.builds(
    Numbers,
    kp=st.integers(-131071, 131071),
    ki=st.integers(-131071, 131071),
    back=st.integers(-4000, 4000),
    filter=st.integers(1, 65536),
    bias=st.integers(0, 255),
    fade_low=st.integers(500, 900),
    fade_high=st.integers(901, 1200),
    feed_first=st.integers(300, 700),
    feed_step=st.integers(1, 60),
    feed=st.tuples(*[st.integers(-900, 900)] * 9),
    hold=st.integers(0, 200),
    heat=st.integers(0, 1000),
    room=st.integers(150, 350),
    hottest=st.integers(600, 1000),
)


UPDATE = eqx.filter_jit(Law.update)


def traced(numbers, cascade):
    return Law(Numbers(*(jnp.asarray(np.asarray(x, float)) for x in numbers)), cascade)


@settings(max_examples=60, deadline=None)
@given(
    NUMBERS,
    st.booleans(),
    st.lists(
        st.tuples(st.integers(0, 1023), st.integers(0, 1023), st.integers(0, 1100)),
        min_size=1,
        max_size=12,
    ),
)
def test_the_law_is_the_firmwares_digit_for_digit(numbers, cascade, seen):
    plain, law = IntegerLaw(numbers, cascade), traced(numbers, cascade)
    state = law.initial(jnp.asarray(float(seen[0][1])))
    for setpoint, reading, warm in seen:
        both = jnp.array([warm / 10.0, (1100 - warm) / 10.0])
        now = Measured(jnp.asarray(float(setpoint)), jnp.asarray(float(reading)), both)
        state, duty = UPDATE(law, state, now)
        assert tuple(map(int, duty)) == plain(setpoint, reading, (warm, 1100 - warm))


def periods_at_the_limit(gains) -> int:
    """Periods at full output once an error of 50 counts, there for 600 periods, has turned to -50."""
    law = law_of(gains, Design())
    state = law.initial(jnp.asarray(500.0))

    def duty(state, setpoint):
        now = Measured(jnp.asarray(setpoint), jnp.asarray(500.0), jnp.full(2, 25.0))
        return UPDATE(law, state, now)

    for _ in range(600):
        state, both = duty(state, 550.0)
    assert int(both[1]) == 255
    for count in range(1200):
        state, both = duty(state, 450.0)
        if int(both[1]) < 255:
            return count
    raise AssertionError("never came back")


def test_without_anti_windup_it_takes_as_long_to_come_back_as_it_was_pushed():
    # 290 duty by kp at 50 counts; the sum has 600 periods to shed but for what kp does: 570 or so.
    assert periods_at_the_limit(Gains(proportional=1000.0, integral=600.0)) > 400


def test_back_calculation_comes_back_within_its_tracking_time():
    gains = Gains(proportional=1000.0, integral=600.0, windup_time=0.6)
    assert periods_at_the_limit(gains) <= 3


def test_the_governor_limits_duties_and_what_is_within_the_limit_it_leaves_alone():
    gains = Gains(proportional=3000.0, integral=0.0, governor=(87.0, 97.0))
    law = law_of(gains, Design())
    shares = []
    for warm in (25.0, 87.0, 92.0, 97.0):
        now = Measured(jnp.asarray(510.0), jnp.asarray(500.0), jnp.array([25.0, warm]))
        _, duty = UPDATE(law, law.initial(jnp.asarray(510.0)), now)
        shares.append(float(duty[1]))
    assert shares[0] == shares[1] == pytest.approx(174, abs=1)
    assert shares[2] == 127
    assert shares[3] == 0


def test_the_sum_follows_what_the_governor_lets_through():
    """Held at 127 of 255 for long, the law wants no more than that: it comes back at once."""
    gains = Gains(proportional=1000.0, integral=400.0, governor=(87.0, 97.0), windup_time=0.5)
    law = law_of(gains, Design())
    state = law.initial(jnp.asarray(500.0))
    hot = jnp.array([25.0, 92.0])
    for _ in range(600):
        now = Measured(jnp.asarray(520.0), jnp.asarray(500.0), hot)
        state, duty = UPDATE(law, state, now)
    assert int(duty[1]) == 127
    now = Measured(jnp.asarray(500.0), jnp.asarray(501.0), jnp.full(2, 25.0))
    state, duty = UPDATE(law, state, now)
    assert int(duty[1]) < 127


def test_the_setpoint_filter_has_its_time_constant():
    gains = Gains(proportional=100.0, integral=0.0, filter_time=3.0)
    law = law_of(gains, Design())
    state = law.initial(jnp.asarray(400.0))
    for _ in range(100):  # 3 s
        now = Measured(jnp.asarray(500.0), jnp.asarray(400.0), jnp.full(2, 25.0))
        state, _ = UPDATE(law, state, now)
    assert float(state.reference) / 65536 == pytest.approx(500 - 100 * np.exp(-1), abs=0.1)


def test_the_table_feeds_what_it_says_with_the_benchs_sign():
    table = FeedForward(angle=(-0.116, 0.116), output=(-80.0, 80.0))
    numbers = board_numbers(Gains(proportional=1.0, integral=0.0, feedforward=table), Design())
    assert numbers.feed_first == 492
    assert numbers.feed[0] == 80
    assert numbers.feed[-1] == pytest.approx(-80, abs=1)


def test_a_cascade_holds_a_temperature():
    """At its setpoint with T = T* the inner loop gives the duty that `hold` says."""
    gains = Gains(
        law="cascade", proportional=50.0, integral=0.0, bias=20.0, inner=Inner(hold=1.3, heat=15.0)
    )
    law = law_of(gains, Design())
    now = Measured(jnp.asarray(500.0), jnp.asarray(500.0), jnp.array([45.0, 40.0]))
    _, duty = UPDATE(law, law.initial(jnp.asarray(500.0)), now)
    assert int(duty[0]) == pytest.approx(26, abs=1)
    assert int(duty[1]) == pytest.approx(26 + 75, abs=2)
