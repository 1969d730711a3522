"""The hierarchy of specimens: integrals against quadrature, pooling, calibration, files."""

import jax
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import kstest, norm

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.population import Population
from muscle_bayes.inference.population.coordinates import NAMES, coordinates, table_of
from muscle_bayes.inference.population.hierarchy import (
    Likelihood,
    _gaussian,
    _marginal,
    _pooled,
    sample_population,
)
from muscle_bayes.study.published import TABLE_2

PRIOR_SPREAD = np.array([0.08, 0.08])


def gaussians(values, noise):
    """Likelihoods of measurements `values` (specimen, coordinate) with a standard deviation."""
    information = np.broadcast_to(np.diag(1.0 / noise**2), (len(values), 2, 2))
    return Likelihood(information, values / noise**2)


def test_a_specimen_is_integrated_out_as_by_quadrature():
    with jax.enable_x64(True):
        likelihood = Likelihood(np.array([[[25.0]]]), np.array([[25.0 * 0.7]]))
        mean, spread = np.array([0.4]), np.array([0.3])
        found = float(_marginal(likelihood, mean, spread)[0])

    def integrand(x):
        return norm.pdf(x, 0.4, 0.3) * np.exp(-12.5 * x**2 + 25.0 * 0.7 * x)

    assert found == pytest.approx(np.log(quad(integrand, -5, 6)[0]), abs=1e-9)


def test_a_posterior_less_its_prior_is_the_likelihood():
    generator = np.random.default_rng(0)
    prior = generator.multivariate_normal([0.0, 1.0], np.diag([1.0, 0.25]), 200_000)
    # A measurement of 2 +- 0.5 of the first, none of the second.
    own = 1.0 / (1.0 + 4.0)
    place = np.stack(
        [generator.normal(4.0 * 2.0 * own, np.sqrt(own), 200_000), prior[:, 1]], axis=1
    )
    information, shift = _gaussian(place, prior)
    assert information[0, 0] == pytest.approx(4.0, rel=0.03)
    assert abs(information[1, 1]) < 0.15
    assert shift[0] == pytest.approx(8.0, rel=0.03)


def test_specimens_are_pooled_by_what_is_known_of_them():
    likelihood = gaussians(np.array([[1.0, 1.0]]), np.array([0.1, 1.0]))
    mean, spread = np.zeros((20_000, 2)), np.full((20_000, 2), 0.1)
    (found,) = _pooled(likelihood, mean, spread, np.random.default_rng(0))
    assert found.mean(0) == pytest.approx([0.5, 0.01 / 1.01], abs=5e-3)
    assert found.std(0) == pytest.approx([0.1 / np.sqrt(2), 0.0995], rel=0.03)


def test_one_specimen_leaves_the_spread_to_its_prior():
    noise = np.array([1e-3, 1e-3])
    likelihood = gaussians(np.array([[0.3, -0.2]]), noise)
    mean, spread = sample_population(likelihood, np.zeros(2), np.eye(2), PRIOR_SPREAD, draws=2000)
    middle = np.median(spread, axis=0)
    assert middle == pytest.approx(PRIOR_SPREAD, rel=0.15)
    assert mean.mean(0) == pytest.approx([0.3, -0.2], abs=0.03)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_the_hierarchy_is_calibrated():
    """Simulation-based calibration: ranks of true mean and spread among draws are uniform."""
    generator = np.random.default_rng(5)
    noise, ranks = np.array([0.02, 0.10]), []
    for number in range(40):
        mean = generator.standard_normal(2)
        spread = PRIOR_SPREAD * np.exp(0.4 * generator.standard_normal(2))
        values = mean + spread * generator.standard_normal((8, 2))
        seen = values + noise * generator.standard_normal((8, 2))
        draws = sample_population(
            gaussians(seen, noise), np.zeros(2), np.eye(2), PRIOR_SPREAD, doubt=0.4,
            warm_up=200, draws=250, seed=number,
        )  # fmt: skip
        new = draws[0] + draws[1] * generator.standard_normal(draws[0].shape)
        fresh = mean + spread * generator.standard_normal(2)
        ranks.append(
            [
                (one < true).mean(0)
                for one, true in zip((*draws, new), (mean, spread, fresh), strict=True)
            ]
        )
    for quantity in range(3):
        for coordinate in range(2):
            uniform = np.array(ranks)[:, quantity, coordinate]
            assert kstest(uniform, "uniform").pvalue > 1e-3, (quantity, coordinate)


def test_coordinates_and_back():
    generator = np.random.default_rng(1)
    table = {
        name: value * (1 + 0.02 * generator.standard_normal(50)) for name, value in TABLE_2.items()
    }
    back = table_of(coordinates(table, 0.1, 5.0), 0.1, 5.0)
    for name, value in table.items():
        assert back[name] == pytest.approx(value, rel=1e-7, abs=1e-12), name


def test_a_population_comes_back_from_its_file(tmp_path):
    place = np.random.default_rng(0).standard_normal((5, len(NAMES)))
    kept = Population(
        place, 0.1 + 0 * place, {"m1": place}, {"J": np.ones(5), "D": np.ones(5)},
        "coulomb", (), 0.1, 5.0,
    )  # fmt: skip
    kept.save(tmp_path / "p.nc")
    read = Population.load(tmp_path / "p.nc")
    np.testing.assert_array_equal(read.mean, kept.mean)
    np.testing.assert_array_equal(read.specimens["m1"], place)
    for name, value in kept.new_muscles(4, seed=1).items():
        np.testing.assert_array_equal(read.new_muscles(4, seed=1)[name], value)


def test_no_population_is_told(tmp_path):
    (tmp_path / "p.nc").write_text("nothing")
    with pytest.raises(MuscleBayesError, match="cannot be read"):
        Population.load(tmp_path / "p.nc")
