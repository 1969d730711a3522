"""The misfit regressed on signatures that are given."""

from dataclasses import dataclass

import numpy as np
import pytest

from muscle_bayes.discovery.screen import Start
from muscle_bayes.discovery.signatures import regression_on


@dataclass
class Errors:
    """What the regression looks at of a fit."""

    errors: np.ndarray

    @property
    def log_densities(self) -> np.ndarray:
        return np.ones(self.errors.size)


def test_coefficients_are_those_of_the_effect_that_made_the_errors() -> None:
    rng = np.random.default_rng(0)
    signatures = {name: rng.standard_normal(200) for name in ("a", "b", "c")}
    screened = {
        name: [Start(1.0, 0.0, np.zeros(1), one), Start(0.1, -1.0, np.zeros(1), 0.0 * one)]
        for name, one in signatures.items()
    }
    found = regression_on(Errors(-2.0 * signatures["b"]), screened | {"never": []})
    assert found.effects == ("a", "b", "c")
    np.testing.assert_allclose(np.diag(found.gram), 1.0)
    length = np.linalg.norm(signatures["b"])
    solved = np.linalg.solve(found.gram, found.projection)
    np.testing.assert_allclose(solved, [0.0, 2.0 * length, 0.0], atol=1e-9)
    assert found.total == pytest.approx(4.0 * length**2)
    assert found.errors == 200
