"""Derivatives over the posterior's width, on the shipped springs."""

from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.search.descent import Fitted, descend
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import explained_at
from muscle_bayes.inference.search.secants import _groups, polished

DATA = Path(__file__).parents[2] / "data"


@pytest.fixture(scope="module")
def fitted() -> tuple[Nested, Fitted]:
    with jax.enable_x64(True):
        runs = read_runs([DATA / "spring-1.csv", DATA / "spring-3.csv"])
        nested = Nested(pose(runs, "coulomb", ("bias-torque",)))
        values = {name: site.prior.mean for name, site in nested.problem.sites.items()}
        start = values | {"J": 1.5e-3, "D": 5e-3, "fast.noise": 0.4, "fast.discrepancy": 0.3}
        return nested, descend(nested, (), nested.point(start, ()))


def _errors(nested: Nested, fitted: Fitted, point: np.ndarray) -> np.ndarray:
    found = explained_at(jnp.asarray(point), fitted.choice, nested.layout, nested.data)
    return np.concatenate([np.asarray(fit.errors).ravel() for fit in found.fits])


def test_a_runs_own_entries_move_its_errors_alone(fitted) -> None:
    nested, fit = fitted
    groups = _groups(nested, fit.used)
    assert sorted(np.concatenate([group.entries for group in groups])) == list(range(fit.used))
    (own, *_) = [group for group in groups if group.entries.size > 1]
    for number, entry in enumerate(own.entries):
        moved = fit.point.copy()
        moved[entry] += 1e-3
        change = _errors(nested, fit, moved) - fit.errors
        assert np.any(change != 0.0)
        assert np.all(change[own.owner != number] == 0.0)


def test_polishing_climbs_and_foresees_errors_a_deviation_away(fitted) -> None:
    nested, fit = fitted
    better = polished(nested, fit)
    assert better.potential <= fit.potential
    assert np.all(np.isfinite(better.information))

    def missed(one: Fitted) -> float:
        """Squared error of the linearisation, a standard deviation away in every direction."""
        kicks = np.random.default_rng(3).standard_normal((one.used, 8))
        total = 0.0
        for kick in better.precision.spread(kicks).T / np.sqrt(one.used):
            moved = better.point.copy()
            moved[: one.used] += kick
            change = _errors(nested, better, moved) - better.errors
            total += float(np.sum((change - one.jacobian @ kick) ** 2))
        return total

    at_the_point = descend(nested, better.effects, better.point, limit=0)
    assert missed(better) < missed(at_the_point)


def test_noise_has_its_whole_fisher_information(fitted) -> None:
    nested, fit = fitted
    name = nested.shared_names().index("fast.noise")
    step = 1e-3 * np.eye(fit.point.size)[name]

    def gradient(point: np.ndarray) -> float:
        return float(descend(nested, (), point, limit=0).slope.gradient[name])

    curvature = (gradient(fit.point + step) - gradient(fit.point - step)) / 2e-3
    assert fit.information[name, name] == pytest.approx(curvature, rel=0.15)
    errors_alone = replace(
        fit, slope=fit.slope._replace(scales=[0.0 * part for part in fit.slope.scales])
    )
    assert errors_alone.information[name, name] < 0.7 * curvature
