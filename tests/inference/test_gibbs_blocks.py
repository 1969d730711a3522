"""The sampler's kernel: its blocks, and what its slices leave unchanged."""

from collections.abc import Mapping
from pathlib import Path

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro import distributions as dist
from table_2 import sampled

from muscle_bayes.data import read_runs
from muscle_bayes.inference.model.calibration_model import CalibrationModel, calibration_model
from muscle_bayes.inference.model.lane_model import predictions
from muscle_bayes.inference.model.priors import Priors
from muscle_bayes.inference.model.problem import Data
from muscle_bayes.inference.sampling.gibbs_blocks import (
    Slices,
    blocks_of,
    noise_update,
    wall_update,
)

DATA = Path(__file__).parents[2] / "data" / "plain"
FORCES = ("F_modulus_min", "F_hyst_min")


def test_every_site_is_in_one_block() -> None:
    names = ["J", "D", "F_modulus_min", "slow.noise", "slow.zero", "F_hyst_min", "fast.discrepancy"]
    found = blocks_of([*names, "bias-torque.torque", "slow.correlation_time"])
    assert found.smooth == ("J", "D", "slow.zero", "bias-torque.torque")
    assert found.walls == FORCES
    assert found.noise == ("slow.noise", "fast.discrepancy", "slow.correlation_time")
    assert not blocks_of(["J", "fast.noise"]).walls


def beginning(run: str, until: float, every: int) -> tuple[CalibrationModel, Data]:
    """The model of a run's first seconds, and its data with every so many readings only.

    Noise is large: where readings tell much, values given them and readings given those move little.
    """
    model = calibration_model([read_runs([DATA / f"{run}.csv"])[0].until(until)])
    layout, data = model.problem.layout, model.problem.data
    (lanes,), (regime,) = data.lanes, layout.regimes
    chosen = np.arange(lanes.weight.shape[1]) % every == 0
    priors = {name: data.priors[name] for name, _ in layout.shapes}
    for key, middle in (("noise", 30.0), ("discrepancy", 30.0), ("correlation_time", 5.0)):
        priors[f"{regime}.{key}"] = dist.LogNormal(np.log(middle), 0.7)
    few = lanes._replace(weight=lanes.weight * chosen)
    return model, data._replace(lanes=(few,), priors=Priors(priors))


def successive(
    model: CalibrationModel, values: Mapping[str, jax.Array], data: Data, count: int
) -> dict[str, np.ndarray]:
    """Readings drawn given the values, then values by slices given the readings, in turns."""
    layout, slices = model.problem.layout, Slices()
    blocks = blocks_of([name for name, _ in layout.shapes])
    names = blocks.walls + blocks.noise
    others = {name: value for name, value in values.items() if name not in names}
    updates = [(noise_update(model, slices), blocks.noise)]
    if blocks.walls:
        updates.insert(0, (wall_update(model, slices, blocks.walls), blocks.walls))

    @jax.jit
    def run(key: jax.Array, own: dict[str, jax.Array], data: Data) -> dict[str, jax.Array]:
        def step(own: dict[str, jax.Array], key: jax.Array) -> tuple:
            key_readings, key_values = jax.random.split(key)
            predicted = predictions(others | own, layout, data)
            ((distribution, _),) = model.likelihoods(others | own, predicted, data).values()
            readings = distribution.sample(key_readings)[None]
            fresh = data._replace(lanes=(data.lanes[0]._replace(reading=readings),))
            for key, (update, mine) in zip(jax.random.split(key_values), updates, strict=False):
                rest = others | {name: own[name] for name in names if name not in mine}
                own = own | update(key, {name: own[name] for name in mine}, rest, fresh)
            return own, own

        return jax.lax.scan(step, own, jax.random.split(key, count))[1]

    drawn = run(jax.random.key(0), {name: values[name] for name in names}, data)
    return {name: np.asarray(value) for name, value in drawn.items()}


def springs_values(model: CalibrationModel) -> dict[str, jax.Array]:
    """As the shipped springs are, about."""
    priors = model.problem.data.priors
    values = {name: priors[name].mean for name in ("fast.zero", "fast.start")}
    values |= {"J": 1.3e-3, "D": 5e-3, "fast.noise": 0.4, "fast.discrepancy": 0.3}
    values |= {"fast.correlation_time": 0.1}
    return {name: jnp.asarray(value) for name, value in values.items()}


@pytest.mark.parametrize(
    ("run", "until", "every", "count"),
    [
        ("spring-1", 1.5, 8, 3000),
        pytest.param("staircase-139g", 150.0, 25, 1200, marks=pytest.mark.slow),
    ],
)
def test_slices_keep_the_joint_distribution_of_values_and_readings(
    run: str, until: float, every: int, count: int
) -> None:
    """Whatever the readings tell of each other's values, all values stay draws of the prior.

    Source: J. Geweke, J. Am. Stat. Assoc. 99 (2004), the successive-conditional simulator.
    """
    model, data = beginning(run, until, every)
    values = springs_values(model) if run == "spring-1" else sampled(model.problem)
    noise = blocks_of([name for name, _ in model.problem.layout.shapes]).noise
    values |= {name: jnp.exp(data.priors[name].loc) for name in noise}
    drawn = successive(model, values, data, count)
    assert (set(FORCES) <= set(drawn)) == (run != "spring-1")
    for name, value in drawn.items():
        prior = data.priors[name]
        z = np.asarray((np.log(value) - prior.loc) / prior.scale)[None]
        for moment, wanted in ((z, 0.0), (z**2, 1.0)):
            ess = float(az.ess(moment, method="mean"))
            assert ess > 50, name
            assert abs(moment.mean() - wanted) < 4.0 * moment.std() / np.sqrt(ess), name
