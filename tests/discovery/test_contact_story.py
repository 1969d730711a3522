"""The thesis' story: touching coils and a drift at room temperature, hidden in the shipped runs."""

from pathlib import Path

import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.discover import discover

DATA = Path(__file__).parents[2] / "data"
HELD_OUT = "staircase-166g"

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]


def test_both_effects_are_named_and_close_the_gap() -> None:
    found = discover(read_runs([DATA]), hold_out=[HELD_OUT], seed=1)
    assert set(found.verdict) == {"coil-contact", "damper-law"}
    assert found.located.significant
    assert not found.final.misfit.significant
    for step in found.steps:
        assert step.gate.passed
    closed = [step.closed("sawtooth", found.floor["sawtooth"]) for step in found.steps]
    assert any(share is not None and share > 0.5 for share in closed)


def test_nothing_is_claimed_of_the_plain_runs() -> None:
    assert discover(read_runs([DATA / "plain"]), hold_out=[HELD_OUT], seed=1).verdict == "none"
