"""Double precision, and a small synthetic posterior: no numbers of a fit."""

import json
from collections.abc import Iterator

import jax
import numpy as np
import pytest
import xarray as xr
from published import COIL_CONTACT, TABLE_1_COULOMB, TABLE_2

from muscle_bayes.control.plant.draws import joint_draws
from muscle_bayes.inference.population import Population
from muscle_bayes.inference.posteriors.posterior import Posterior


@pytest.fixture(autouse=True, scope="module")
def _compiled_fast(compiled_fast: None) -> None:
    pass


@pytest.fixture(autouse=True)
def double_precision() -> Iterator[None]:
    with jax.enable_x64(True):
        yield


def _scattered(centre, spread, size, seed):
    generator = np.random.default_rng(seed)
    return {
        name: (("chain", "draw"), value * (1 + spread * generator.standard_normal((2, size // 2))))
        for name, value in centre.items()
    }


def posterior_about(centre, *, friction="coulomb", effects=(), spread=0.01, size=40):
    """Draws that scatter about published values, and a prior that is wider."""
    groups = {
        "posterior": xr.Dataset(_scattered(centre, spread, size, 0)),
        "prior": xr.Dataset(_scattered(TABLE_2, 0.2, 400, 1)),
    }
    tree = xr.DataTree.from_dict(groups)
    tree.attrs = {
        "friction": friction,
        "effects": json.dumps(list(effects)),
        "parameters": json.dumps(list(centre)),
        "converged": 1,
        "complaints": "[]",
        "base_length": 0.1,
        "tension": 5.0,
    }
    return Posterior(tree)


@pytest.fixture(scope="session")
def posterior():
    return posterior_about(TABLE_1_COULOMB | TABLE_2)


@pytest.fixture(scope="session")
def touching():
    """A posterior with coils that touch as soon as the joint moves."""
    contact = COIL_CONTACT | {"coil-contact.onset": 0.145}
    return posterior_about(TABLE_1_COULOMB | TABLE_2 | contact, effects=("coil-contact",))


@pytest.fixture(scope="session")
def heater():
    generator = np.random.default_rng(1)
    medians = {"gain": 4.0, "cooling": 0.02, "lag": 0.4}
    return {k: v * np.exp(0.1 * generator.standard_normal(100)) for k, v in medians.items()}


@pytest.fixture(scope="session")
def joints(posterior, heater):
    with jax.enable_x64(True):
        return joint_draws(Population.of_specimen(posterior), heater, 4)
