"""A meter that gets stuck at any moment, of heating or of holding: no tube gets much too hot."""

import numpy as np
import pytest

from benchmarks.bench_test.failures import ALLOWED
from benchmarks.bench_test.stuck_meter import MOST_EXCESS, StuckOutcome, stick, stick_all
from muscle_bayes.bench.heat.thermometry import Watch


def check(outcomes):
    assert all(outcome.safe for outcome in outcomes), outcomes
    print(
        f"{len(outcomes)} stuck meters: heaters off after "
        f"{np.quantile([o.off_after for o in outcomes], [0.5, 0.9, 1.0])} s (50, 90, 100 %), tubes "
        f"{np.quantile([o.excess for o in outcomes], [0.5, 0.9, 1.0])} C above their setpoints"
    )


def test_no_tube_gets_much_too_hot():
    outcomes = stick_all(10)
    assert {outcome.holding for outcome in outcomes} == {True, False}
    check(outcomes)


@pytest.mark.slow
def test_no_tube_gets_much_too_hot_by_many():
    check(stick_all(200, seed=10))


def test_without_the_wait_a_tube_does_get_too_hot(monkeypatch):
    monkeypatch.setattr(Watch, "waits", property(lambda _: False, lambda *_: None))
    assert any(not stick(seed).safe for seed in range(10))


def test_what_is_safe():
    assert StuckOutcome(0, False, ALLOWED, MOST_EXCESS).safe
    assert not StuckOutcome(0, False, ALLOWED + 0.001, 0.0).safe
    assert StuckOutcome(0, True, 60.0, MOST_EXCESS).safe
    assert not StuckOutcome(0, True, 0.0, MOST_EXCESS + 0.1).safe
