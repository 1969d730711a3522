"""Metadata that leave a thermometer's delay uncertain open it in fits, and say how far."""

import dataclasses
from pathlib import Path

import pytest

from muscle_bayes.criticism.replicates import Template
from muscle_bayes.data import Thermometer, read_run
from muscle_bayes.discovery.discover import applicable, discover
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.records.open_delay import UNSTATED, with_open_delay

DATA = Path(__file__).parents[2] / "data" / "plain"
EFFECT, PARAMETER = "clock-offset", "clock-offset.delay"


def logged(name, meter):
    run = read_run(DATA / f"{name}.csv")
    return dataclasses.replace(run, metadata=run.metadata.model_copy(update={"thermometer": meter}))


def test_a_delay_that_is_known_is_not_estimated():
    run = logged("staircase-139g", Thermometer(delay=0.04))
    assert with_open_delay([run], ()) == ()
    assert EFFECT in applicable([run], ())


@pytest.mark.parametrize("meter", [None, Thermometer()])
def test_a_delay_that_nobody_stated_is_estimated(meter):
    run = logged("staircase-139g", meter)
    assert with_open_delay([run], ()) == (EFFECT,)
    prior = pose([run], effects=(EFFECT,)).sites[PARAMETER].prior
    assert float(prior.variance) ** 0.5 == pytest.approx(UNSTATED)


def test_a_temperature_that_never_changes_tells_no_delay():
    run = logged("staircase-139g", None)
    cold = dataclasses.replace(run, table=run.table.assign(temperature_a=25.0))
    assert with_open_delay([cold], ()) == ()


def test_an_uncertain_delay_is_estimated_as_far_as_the_metadata_leave_it_open():
    sure = logged("staircase-139g", Thermometer(delay=0.04, delay_uncertainty=0.05))
    unsure = logged("staircase-166g", Thermometer(delay=0.04, delay_uncertainty=0.2))
    effects = with_open_delay([sure, unsure], ("viscous-friction",))
    assert effects == ("viscous-friction", EFFECT)
    assert with_open_delay([sure], effects) == effects
    prior = pose([sure, unsure], effects=effects).sites[PARAMETER].prior
    assert (float(prior.mean), float(prior.variance) ** 0.5) == (0.0, pytest.approx(0.2))


def test_without_a_muscle_no_temperature_counts():
    run = logged("spring-1", Thermometer(delay=0.04, delay_uncertainty=0.2))
    assert with_open_delay([run], ()) == ()
    assert PARAMETER not in pose([run]).sites


def test_discovery_does_not_look_for_what_is_open_already():
    run = logged("staircase-139g", Thermometer(delay=0.04, delay_uncertainty=0.2))
    assert EFFECT not in applicable([run], ())
    with pytest.raises(MuscleBayesError, match=f"has {EFFECT} already"):
        discover([run], candidates=[EFFECT])


def test_calibration_is_of_the_model_that_is_fitted(tmp_path):
    log = tmp_path / "staircase-139g.csv"
    log.write_bytes((DATA / log.name).read_bytes())
    told = (DATA / "staircase-139g.toml").read_text(encoding="utf-8")
    told = told.replace("delay_uncertainty = 0.0", "delay_uncertainty = 0.2")
    log.with_suffix(".toml").write_text(told, encoding="utf-8")
    assert Template((log,)).problem().layout.effects == (EFFECT,)
