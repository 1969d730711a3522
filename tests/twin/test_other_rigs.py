"""Other people's rigs, by independent code: the truth explains each log, and a fit covers the truth."""

from pathlib import Path

import jax
import numpy as np
import pytest
from numpyro import distributions as dist

import muscle_bayes as mb
from benchmarks.rigs import EXAMPLES, Example, example
from muscle_bayes.data import Run
from muscle_bayes.data.reader import run_from_bytes
from muscle_bayes.inference.model.lane_model import (
    muscle_of,
    predictions,
    zeros_of,
)
from muscle_bayes.inference.model.problem import Problem, pose
from muscle_bayes.inference.posteriors.predictive import carried_over
from muscle_bayes.inference.posteriors.summary import summarise
from muscle_bayes.inference.running.precision import double_precision

HELD = ("isometric-muscle", "heater-power")
"""Whose muscle stands still."""


def read(one: Example) -> Run:
    log, about = one.log().encode(), one.metadata.encode()
    return run_from_bytes(log, about, Path(f"{one.name}.csv"), Path(f"{one.name}.toml"))


def misfits(problem: Problem, values: dict) -> list[float]:
    """RMS of reading minus prediction of each run, in standard deviations of one mean reading."""
    with jax.enable_x64(True):
        layout, data = problem.layout, problem.data
        found = []
        groups = zip(predictions(values, layout, data), data.lanes, layout.regimes, strict=True)
        for one, lanes, regime in groups:
            zero = zeros_of(values, lanes, regime, False)[:, None]
            away = np.asarray(lanes.reading - zero - one.reading)
            seen = np.asarray(lanes.weight) > 0
            level = np.asarray(problem.sites[f"{regime}.noise"].prior.loc)
            found.append(float(np.sqrt(np.mean(away[seen] ** 2)) / np.exp(level)))
        return found


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_truth_is_among_what_is_estimated(name: str) -> None:
    one = example(name)
    sites = pose([read(one)]).sites
    table_2 = {"A", "B", "C", "K_hyst", "K_modulus", "H", "T_hyst_offset"}
    assert set(one.truth) - table_2 <= set(sites)


@pytest.mark.parametrize("name", HELD)
@double_precision
def test_the_truth_explains_a_held_muscle(name: str) -> None:
    one = example(name)
    inner = {name: value for name, value in one.truth.items() if "." not in name}
    # Priors by these names, so that the parameters of Table 2 are sampled; their width does not matter.
    fixed = {
        key: dist.LogNormal(np.log(value), 1.0) if value > 0 else dist.Normal(value, abs(value))
        for key, value in inner.items()
    }
    problem = pose([read(one)], priors=fixed)
    values = {
        name: np.asarray(one.truth.get(name, 0.0)) * np.ones(site.prior.shape())
        for name, site in problem.sites.items()
    }
    assert max(misfits(problem, values)) < 2.0


@pytest.mark.parametrize("name", HELD)
@double_precision
def test_another_runs_muscle_is_the_same_muscle(name: str) -> None:
    one = example(name)
    problem = pose([read(one)])
    drawn = {key: np.full(3, value) for key, value in one.truth.items()}
    noise = {key: np.ones(3) for key in problem.sites if key.startswith("imposed.")}
    values = carried_over(problem, noise | drawn)
    muscle = muscle_of(values, problem.data)
    for key in ("A", "B", "C", "K_hyst", "K_modulus", "H", "T_hyst_offset"):
        np.testing.assert_allclose(getattr(muscle, key), drawn[key], rtol=1e-6, err_msg=key)


@double_precision
def test_without_a_thermometer_no_reading_tells_how_fast_power_heats() -> None:
    problem = pose([read(example("heater-power"))])
    values = {
        name: np.asarray(site.prior.mean) * np.ones(site.prior.shape())
        for name, site in problem.sites.items()
    }
    shown = []
    for factor in (1.0, 4.0):
        rate = factor * values["heater_a.heating_rate"]
        told = predictions(values | {"heater_a.heating_rate": rate}, problem.layout, problem.data)
        shown.append(np.asarray(told[0].reading))
    assert np.ptp(shown[0]) > 0.1
    np.testing.assert_allclose(*shown, atol=1e-6)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", EXAMPLES)
def test_a_short_fit_covers_the_truth(name: str) -> None:
    one = example(name)
    found = summarise(mb.fit([read(one)], effects=one.effects, effort="quick", progress=False))
    assert found["explained"], found["unexplained"]
    for key, true in one.truth.items():
        row = found["parameters"][key]
        assert abs(row["mean"] - true) < 3.5 * row["sd"], key
