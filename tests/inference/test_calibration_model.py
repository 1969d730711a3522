"""The NumPyro model of runs: one density with the search's, sites as named, readings that can be drawn."""

import subprocess
import sys
import tomllib
from pathlib import Path

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro import distributions as dist
from numpyro import handlers
from numpyro.distributions import biject_to
from numpyro.infer import MCMC, NUTS, Predictive, init_to_value
from numpyro.infer.util import log_density

from muscle_bayes.data import read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.calibration_model import CalibrationModel, calibration_model
from muscle_bayes.inference.model.density import constrain, potential, unconstrain
from muscle_bayes.inference.model.lane_model import muscle_of
from muscle_bayes.inference.model.muscle_prior import MUSCLE_PARAMETERS
from muscle_bayes.inference.model.prior_draws import prior_draws
from muscle_bayes.inference.model.problem import Data

DATA = Path(__file__).parents[2] / "data" / "plain"
TRUTH = tomllib.loads((DATA / "truth.toml").read_text(encoding="utf-8"))["rotor"]


@pytest.fixture(scope="module")
def springs() -> CalibrationModel:
    return calibration_model(read_runs([DATA / "spring-1.csv", DATA / "spring-3.csv"]))


@pytest.fixture(scope="module")
def staircase() -> CalibrationModel:
    return calibration_model(read_runs([DATA / "staircase-166g.csv"]))


@pytest.fixture(scope="module")
def both() -> CalibrationModel:
    return calibration_model(read_runs([DATA / "spring-1.csv", DATA / "staircase-166g.csv"]))


def log_jacobian(vector: jax.Array, model: CalibrationModel, data: Data) -> float:
    """Of the map from the unconstrained vector to the values."""
    total, position = 0.0, 0
    for name, shape in model.problem.layout.shapes:
        part = vector[position : position + int(np.prod(shape))]
        transform = biject_to(data.priors[name].support)
        total += float(jnp.sum(transform.log_abs_det_jacobian(part, transform(part))))
        position += part.size
    return total


def points(model: CalibrationModel, count: int) -> list[jax.Array]:
    """Unconstrained vectors about a draw of the prior at which the density is finite."""
    layout, data = model.problem.layout, model.problem.data
    draws = prior_draws(jax.random.key(3), 8 * count, layout, data)
    vectors = jax.vmap(lambda one: unconstrain(one, layout, data))(draws)
    density = jax.jit(lambda vector: potential(vector, layout, data))
    finite = [vector for vector in vectors if np.isfinite(density(vector))]
    assert len(finite) >= count
    return finite[:count]


@pytest.mark.parametrize("runs", ["springs", "staircase"])
def test_its_density_is_that_of_the_search(runs: str, request: pytest.FixtureRequest) -> None:
    model: CalibrationModel = request.getfixturevalue(runs)
    layout, data = model.problem.layout, model.problem.data
    theirs = jax.jit(lambda values: log_density(model, (), {}, values)[0])
    ours = jax.jit(lambda vector: potential(vector, layout, data))
    for vector in points(model, 3):
        found = float(theirs(constrain(vector, layout, data)))
        wanted = -float(ours(vector)) - log_jacobian(vector, model, data)
        assert found == pytest.approx(wanted, rel=1e-9)


def test_other_readings_of_the_same_shapes_replace_those_of_the_runs(springs) -> None:
    layout, data = springs.problem.layout, springs.problem.data
    (lanes,) = data.lanes
    shifted = data._replace(lanes=(lanes._replace(reading=lanes.reading + 0.4),))
    (vector,) = points(springs, 1)
    theirs = jax.jit(lambda values, data: log_density(springs, (data,), {}, values)[0])
    values = constrain(vector, layout, data)
    ours = [-float(potential(vector, layout, one)) for one in (data, shifted)]
    found = [float(theirs(values, one)) for one in (data, shifted)]
    assert found[1] != pytest.approx(found[0])
    assert found[1] - found[0] == pytest.approx(ours[1] - ours[0], rel=1e-6)


def test_each_unknown_and_each_run_is_a_site(both: CalibrationModel) -> None:
    trace = handlers.trace(handlers.seed(both, 0)).get_trace()
    sampled = {
        name: site["value"].shape
        for name, site in trace.items()
        if site["type"] == "sample" and not site["is_observed"]
    }
    assert sampled == dict(both.problem.layout.shapes)
    # "solved" is no reading: it forbids what could not be simulated.
    observed = {name for name, site in trace.items() if site.get("is_observed")} - {"solved"}
    assert observed == {"spring-1", "staircase-166g"}
    alone = handlers.trace(handlers.seed(both, 0)).get_trace(predict=False)
    assert set(alone) == set(sampled)


def test_table_2_is_told_of_every_draw(both: CalibrationModel) -> None:
    layout, data = both.problem.layout, both.problem.data
    draws = prior_draws(jax.random.key(1), 1, layout, data)
    values = {name: value[0] for name, value in draws.items()}
    trace = handlers.trace(handlers.substitute(both, values)).get_trace()
    muscle = muscle_of(values, data)
    assert muscle is not None
    for name in MUSCLE_PARAMETERS:
        kind = "sample" if name in values else "deterministic"
        assert trace[name]["type"] == kind
        np.testing.assert_allclose(trace[name]["value"], getattr(muscle, name), rtol=1e-12)


def test_the_prior_predicts_readings(both: CalibrationModel) -> None:
    unseen = handlers.uncondition(both)
    found = Predictive(unseen, num_samples=4)(jax.random.key(0))
    for group, owners in zip(both.problem.data.lanes, both.problem.lane_runs, strict=True):
        for owner in owners:
            readings = np.asarray(found[both.problem.runs[owner].name])
            assert readings.shape == (4, group.reading.shape[1])
            assert np.isfinite(readings).all()
            assert np.all(np.ptp(readings, axis=0) > 0.0)


def test_given_priors_replace_the_default_ones() -> None:
    runs = read_runs([DATA / "spring-1.csv", DATA / "spring-2.csv"])
    given = {"J": dist.HalfNormal(3e-3), "fast.noise": dist.LogNormal(0.0, 0.1)}
    given["fast.start"] = dist.Normal(510.0, 7.0)  # of every run
    model = calibration_model(runs, priors=given)
    trace = handlers.trace(handlers.seed(model, 0)).get_trace(predict=False)
    assert isinstance(trace["J"]["fn"], dist.HalfNormal)
    assert float(trace["J"]["fn"].scale) == 3e-3
    assert float(trace["fast.noise"]["fn"].scale) == 0.1
    assert trace["fast.start"]["value"].shape == (2,)
    printed = repr(model)
    assert all(name in printed for name in dict(model.problem.layout.shapes))
    assert "HalfNormal(scale=0.003)" in printed


def test_parameters_of_table_2_take_priors_too() -> None:
    """Each in place of a quantity that it determines; the density is that of both."""
    given = {"K_hyst": dist.LogNormal(6.0, 0.3), "H": dist.Normal(-550.0, 60.0)}
    model = calibration_model(read_runs([DATA / "staircase-166g.csv"]), priors=given)
    layout, data = model.problem.layout, model.problem.data
    names = set(dict(layout.shapes))
    assert set(given) <= names
    assert not {"stiffness_hyst", "softening"} & names
    values = {name: data.priors[name].mean for name in names} | {"K_hyst": 415.0, "H": -546.0}
    values = {name: jnp.asarray(value) for name, value in values.items()}
    trace = handlers.trace(handlers.substitute(model, values)).get_trace()
    muscle = muscle_of(values, data)
    assert muscle is not None
    for name in set(MUSCLE_PARAMETERS) - names:
        np.testing.assert_allclose(trace[name]["value"], getattr(muscle, name), rtol=1e-12)
    for name in given:
        np.testing.assert_allclose(getattr(muscle, name), values[name], rtol=1e-9)
        logs = trace[name]["fn"].log_prob(values[name])
        np.testing.assert_allclose(logs, given[name].log_prob(values[name]), rtol=1e-6)


def test_what_is_not_unknown_is_told() -> None:
    runs = read_runs([DATA / "spring-1.csv", DATA / "spring-2.csv"])
    half = dist.HalfNormal(3e-3)
    with pytest.raises(MuscleBayesError, match=r"no parameter 'K_hyst'"):
        calibration_model(runs, priors={"K_hyst": half})
    with pytest.raises(MuscleBayesError, match=r"'fast.start' has shape \(3,\), wanted is \(2,\)"):
        calibration_model(runs, priors={"fast.start": half.expand((3,))})
    with pytest.raises(MuscleBayesError, match="catalogue"):
        calibration_model(runs, effects=("nothing",))


WRONG_PRIORS = {
    "a number": (0.003, r"'J' is 0.003, not a distribution. Fix: give a NumPyro distribution"),
    "any sign": (dist.Normal(0.0, 1.0), r"'J' allows negative values. Fix: .* such as LogNormal"),
}


@pytest.mark.parametrize("kind", WRONG_PRIORS)
def test_priors_that_cannot_be(kind: str) -> None:
    given, told = WRONG_PRIORS[kind]
    with pytest.raises(MuscleBayesError, match=told):
        calibration_model(read_runs(DATA / "spring-1.csv"), priors={"J": given})


@pytest.mark.slow
def test_nuts_finds_what_made_a_spring_run() -> None:
    model = calibration_model(read_runs([DATA / "spring-1.csv"]))
    priors = model.problem.data.priors
    start = {name: priors[name].mean for name in ("fast.zero", "fast.start")}
    start |= {"J": 1.3e-3, "D": 5e-3, "fast.noise": 0.4, "fast.discrepancy": 0.1}
    start |= {"fast.correlation_time": 0.1}
    begin = init_to_value(values={name: jnp.asarray(value) for name, value in start.items()})
    kernel = NUTS(model, init_strategy=begin, dense_mass=True, max_tree_depth=6)
    chains = MCMC(kernel, num_warmup=50, num_samples=50, progress_bar=False)
    chains.run(jax.random.key(0))
    draws = chains.get_samples()
    for name, share in (("J", 0.03), ("D", 0.15)):
        assert float(jnp.mean(draws[name])) == pytest.approx(TRUTH[name], rel=share)
        assert float(jnp.std(draws[name])) > 0.0
    told = az.from_numpyro(chains)
    assert set(told.posterior.data_vars) == {*dict(model.problem.layout.shapes)}
    assert "spring-1" in told.observed_data


def test_numpyro_is_whole_whatever_is_imported_first() -> None:
    """ArviZ imports NumPyro lazily, which hid parts of it from who came later."""
    lines = (
        "import arviz, muscle_bayes.inference.sampling.fit, numpyro",
        "print(numpyro.distributions.distribution, numpyro.distributions.constraints)",
    )
    done = subprocess.run(
        [sys.executable, "-c", "; ".join(lines)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
