"""Random command streams: nothing heats that was not asked for, and nothing for long."""

import pytest

from benchmarks.bench_test.fuzz import LONGEST_HEAT, fuzz

pytestmark = pytest.mark.usefixtures("firmware")


def check(report, count):
    assert report.sent >= count
    assert report.heats > count / 300  # heat was asked for often enough to show something
    assert report.heated > 1000
    assert report.answered > report.commands
    assert report.wrong_heat == 0
    assert report.longest_heat <= LONGEST_HEAT
    assert report.restarts == 0


def test_random_streams_heat_only_what_was_asked():
    check(fuzz(60_000, seed=1), 60_000)


@pytest.mark.slow
def test_a_million_random_bytes_heat_only_what_was_asked():
    check(fuzz(1_000_000), 1_000_000)
