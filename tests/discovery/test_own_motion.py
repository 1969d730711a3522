"""A fit counts by the density with the motion at its own point, on the measured axis."""

from pathlib import Path

import jax
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.conditions import traces
from muscle_bayes.discovery.explanation import Explanation, Search
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.discovery.screen import starts_of
from muscle_bayes.discovery.search import finished, first_steps
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search.descent import Fitted, descend
from muscle_bayes.physics.effects.empirical import function_name

PRESENT = ("viscous-friction", "bias-torque")


def _rmse(search: Search, fitted: Fitted) -> float:
    (line,) = traces(search.train, fitted)
    return float(np.sqrt(np.mean(line.residual**2)))


@pytest.mark.slow
@pytest.mark.real
@double_precision
def test_a_function_is_not_fitted_to_motion_that_is_not_its_own(real_data: Path) -> None:
    """Linear about other segments' starts, its density rises while readings are missed ever more."""
    start = nominal(read_runs([real_data / "emps"]), "coulomb", PRESENT, 0)
    whole, point = nest(start, ["unknown-torque"])
    search = Search(whole, whole, (), 0, lambda stage, done, total: None).over(whole)
    base = descend(search.train, PRESENT, point)
    function = function_name("torque", "speed", -0.15, 0.15)
    starts = starts_of(search.train, base, function, jax.random.key(0))
    fitted = finished(search.train, base, first_steps(search.train, base, function, starts))
    settled = Explanation(search, fitted).settled()
    assert _rmse(search, fitted) > _rmse(search, base)
    assert _rmse(settled.search, settled.fitted) < 0.9 * _rmse(search, base)
    assert _rmse(settled.search, settled.polished()) < 0.9 * _rmse(search, base)
