"""The thesis' stories: coils touch for some seconds of one run, the muscle drifts; discovery says so."""

from dataclasses import replace
from pathlib import Path

import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.discover import discover
from muscle_bayes.twin import EFFECTS, save_runs, simulate
from muscle_bayes.twin.shipped import SEED, shipped_runs

DATA, HELD_OUT = Path(__file__).parents[2] / "data", "staircase-166g"


@pytest.mark.slow
def test_an_effect_of_some_seconds_is_located_named_and_added(tmp_path: Path) -> None:
    made = {}
    for number, (name, (rig, protocol)) in enumerate(shipped_runs().items()):
        truth = replace(rig.truth, effects=(EFFECTS["coil-contact"](),))
        made[name] = simulate(replace(rig, truth=truth), protocol, (SEED, number))
    save_runs(tmp_path / "runs", made)
    found = discover(read_runs([tmp_path / "runs"]), hold_out=[HELD_OUT], seed=1)
    assert found.verdict == "coil-contact"
    first = found.located.windows[0]
    assert first.run == "sawtooth"
    assert first.end - first.start < 60.0
    (step,) = found.steps
    # What is left is noise, as the trial asks; before the step it was not.
    floor = found.floor["sawtooth"]
    assert step.after.checks["sawtooth"].rmse < 1.1 * floor < step.before.checks["sawtooth"].rmse
    assert not found.final.misfit.significant


@pytest.mark.slow
def test_the_two_effects_in_the_shipped_runs_are_named() -> None:
    """Coil contact, the likeliest alone, does not predict better clearly: it needs the law beside it."""
    found = discover(read_runs([DATA]), hold_out=["sawtooth"])
    assert set(found.effects) == {"coil-contact", "damper-law"}
    assert not found.final.misfit.significant
    # The run that was held out is predicted better by both than by none.
    assert found.final.checks["sawtooth"].rmse < 0.5 * found.nominal.checks["sawtooth"].rmse
    law = found.steps[-1].parameters["activation_temperature"]
    assert law.low < 3000.0 < law.high
