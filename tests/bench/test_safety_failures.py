"""Injected failures: heaters off within 0.5 s of the moment at which each strikes, and off they stay."""

import pytest

from benchmarks.bench_test.failures import (
    ALLOWED,
    BENCHES,
    FAILURES,
    Outcome,
    inject,
    inject_all,
)

FEW, MANY = 2, 40
"""Times that each of the kinds strikes in the plain and in the slow tests, by turns on a bench with a meter
and on ones with thermometers of the board's own."""


def check(outcomes):
    assert all(outcome.heated for outcome in outcomes), "a failure without heat shows nothing"
    late = [outcome for outcome in outcomes if outcome.off_after > ALLOWED]
    assert not late, late


@pytest.mark.usefixtures("firmware")
@pytest.mark.parametrize("failure", FAILURES, ids=lambda failure: failure.name)
def test_heaters_are_off_in_time_after(failure):
    other = BENCHES[1 + FAILURES.index(failure) % (len(BENCHES) - 1)]
    check([inject(failure, 0), inject(failure, 1, other)])


@pytest.mark.slow
@pytest.mark.usefixtures("firmware")
@pytest.mark.parametrize("failure", FAILURES, ids=lambda failure: failure.name)
def test_heaters_are_off_in_time_after_many_of(failure):
    seeds = range(FEW, FEW + MANY)
    check([inject(failure, seed, BENCHES[seed % len(BENCHES)]) for seed in seeds])


def test_at_least_200_failures_are_injected_in_the_slow_run():
    assert MANY * len(FAILURES) >= 200
    assert len({failure.name for failure in FAILURES}) == len(FAILURES)


@pytest.mark.usefixtures("firmware")
def test_a_failure_replays_exactly():
    failure = FAILURES[0]
    assert inject(failure, 5) == inject(failure, 5)
    assert inject(failure, 5) != inject(failure, 6)


@pytest.mark.usefixtures("firmware")
def test_every_kind_strikes_as_often():
    shares = []
    outcomes = inject_all(3, seed=1, progress=shares.append, failures=FAILURES[:2])
    assert [outcome.failure for outcome in outcomes] == [f.name for f in FAILURES[:2]] * 2
    assert shares == [0.25, 0.5, 0.75, 1.0]


def test_an_outcome_is_safe_only_if_there_was_heat_and_it_ended_in_time():
    assert Outcome("x", "", 0, True, ALLOWED).safe
    assert not Outcome("x", "", 0, True, ALLOWED + 0.001).safe
    assert not Outcome("x", "", 0, False, 0.0).safe
