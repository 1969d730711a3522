"""The axes along which a damper law is told apart from eq. 17."""

from pathlib import Path
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro import distributions as dist

from muscle_bayes.data import read_runs
from muscle_bayes.inference.model.calibration_model import calibration_model
from muscle_bayes.inference.model.damper_axes import LAW, from_axes, log_volume, to_axes
from muscle_bayes.inference.model.density import (
    constrain,
    log_prior,
    prior_precision,
    unconstrain,
)
from muscle_bayes.inference.sampling.kernels import Nuts
from muscle_bayes.inference.search.tempering import entry_names
from muscle_bayes.physics.effects import DamperLaw

DATA = Path(__file__).parents[2] / "data" / "plain"


def posed(priors=None):
    runs = read_runs([DATA / "staircase-139g.csv"])
    effects = ("coil-contact", "damper-law")
    problem = calibration_model(runs, effects=effects, priors=priors).problem
    names = list(entry_names(problem.layout))
    point = jnp.asarray(np.random.default_rng(0).normal(0.0, 0.5, len(names)))
    point = point.at[names.index("softening")].set(0.3)
    return problem.layout, problem.data, names, point


@pytest.mark.parametrize("walls", [("F_hyst_min",), ("F_hyst_min", "damper-law")])
def test_nuts_tells_its_draws_along_the_axes(walls):
    """Whether the law, of which parameters may be negative, is sliced or among the smooth sites."""
    runs = read_runs([DATA / "staircase-139g.csv"])
    problem = calibration_model(runs, effects=("coil-contact", "damper-law")).problem
    layout, data, _, point = posed()
    sampler = Nuts(walls=walls)
    smooth = sampler.blocks(layout).smooth
    held = {
        name: dist.biject_to(data.priors[name].support).inv(value) if name in smooth else value
        for name, value in constrain(point, layout, data).items()
    }
    seen = sampler.vectors({n: np.asarray(v)[None, None] for n, v in held.items()}, {}, problem)
    np.testing.assert_allclose(seen[0, 0], point, atol=1e-10)


def log_damper(values, celsius):
    """ln B / K_hyst at temperatures, by eq. 17 and by the law."""
    u = (np.asarray(celsius) - 25.0) / 65.0
    level = float(values["time_constant"]) * (1.0 - (1.0 - float(values["softening"])) * u)
    law = DamperLaw(*(values[name] for name in LAW))
    factors = [law(jnp.ones(()), SimpleNamespace(temperature=T)) for T in celsius]
    return np.log(level * np.array(factors, float))


def test_a_step_in_softening_keeps_the_damper_at_three_temperatures():
    layout, data, names, point = posed()
    further = point.at[names.index("softening")].set(0.1)
    here, there = (constrain(one, layout, data) for one in (point, further))
    assert there["softening"] > here["softening"] + 0.1
    kept = 57.5 + 32.5 * np.cos(np.pi * np.array([5.0, 3.0, 1.0]) / 6.0)
    np.testing.assert_allclose(log_damper(there, kept), log_damper(here, kept), atol=1e-9)
    # Elsewhere the curve differs, by what a parabola leaves.
    rest = log_damper(there, [25.0, 43.0, 72.0, 90.0]) - log_damper(here, [25.0, 43.0, 72.0, 90.0])
    assert (np.abs(rest) > 1e-4).all()
    assert (np.abs(rest) < 0.05).all()


def test_the_axes_are_a_shear_with_a_stretch_of_softening():
    layout, data, _, point = posed()
    np.testing.assert_allclose(
        to_axes(from_axes(point, layout, data), layout, data), point, atol=1e-12
    )
    slopes = jax.jacfwd(from_axes)(point, layout, data)
    volume = np.log(np.abs(np.linalg.det(np.asarray(slopes))))
    assert volume == pytest.approx(float(log_volume(point, layout, data)), abs=1e-12)
    values = constrain(point, layout, data)
    np.testing.assert_allclose(unconstrain(values, layout, data), point, atol=1e-10)


@pytest.mark.parametrize("place", [-0.6, -0.05, 0.003, 0.05, 0.4, 0.99, 1.02, 1.3])
def test_the_axis_of_softening_is_linear_in_the_cube_of_its_rest_and_never_leaves_it(place):
    layout, data, names, point = posed()
    point = point.at[names.index("softening")].set(place)
    softening = float(constrain(point, layout, data)["softening"])
    np.testing.assert_allclose(
        to_axes(from_axes(point, layout, data), layout, data), point, atol=1e-12
    )
    assert 0.0 < softening < 1.0
    clipped = 0.01 * (np.logaddexp(0.0, place / 0.01) - np.logaddexp(0.0, (place - 1.0) / 0.01))
    assert (1.0 - softening) ** 3 == pytest.approx(clipped, rel=1e-9)
    assert np.isfinite(jax.grad(lambda v: log_prior(v, layout, data))(point)).all()


def test_the_prior_is_that_of_the_sites():
    """Of density and not of axes: its difference between two points is that of the sites' own."""
    layout, data, names, point = posed()
    entry = names.index("softening")

    def own(vector):
        values = constrain(vector, layout, data)
        s, time = values["softening"], values["time_constant"]
        moved = (*LAW, "softening", "time_constant")
        densities = [data.priors[name].log_prob(values[name]) for name in moved]
        return float(sum(densities) - 2.0 * jnp.log(1.0 - s) + jnp.log(time))

    further = point.at[entry].set(0.6)
    rise = float(log_prior(further, layout, data) - log_prior(point, layout, data))
    assert rise == pytest.approx(own(further) - own(point), abs=1e-9)
    assert abs(rise) > 0.1


def test_the_prior_precision_follows_the_axes():
    """Where the law's prior is at its mode nothing pulls, and the whole Hessian is that of the axes."""
    layout, data, names, point = posed()
    values = constrain(point, layout, data) | {name: jnp.zeros(()) for name in LAW}
    point = unconstrain(values, layout, data)
    seen = prior_precision(point, layout, data)
    places = [names.index(name) for name in (*LAW, "softening")]
    whole = -jax.hessian(lambda v: log_prior(v, layout, data))(point)
    np.testing.assert_allclose(
        np.asarray(seen)[np.ix_(places[:2], places)],
        np.asarray(whole)[np.ix_(places[:2], places)],
        atol=1e-9,
    )
    assert abs(seen[places[1], places[2]]) > 0.1


def test_priors_of_another_kind_leave_the_sites_alone():
    layout, data, _, point = posed({"damper-law.curvature": dist.HalfNormal(3000.0)})
    np.testing.assert_array_equal(from_axes(point, layout, data), point)
