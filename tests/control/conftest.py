"""Double precision, and a small synthetic posterior: no numbers of a fit."""

import json
from collections.abc import Iterator

import jax
import numpy as np
import pytest
import xarray as xr
from published import COIL_CONTACT, TABLE_1_LINEAR, TABLE_2

from muscle_bayes.control.draws import joint_draws
from muscle_bayes.inference.posteriors.posterior import Posterior


@pytest.fixture(autouse=True, scope="module")
def _compiled_fast(compiled_fast: None) -> None:
    pass


@pytest.fixture(autouse=True)
def double_precision() -> Iterator[None]:
    with jax.enable_x64(True):
        yield


def posterior_about(centre, *, friction="linear", effects=(), spread=0.03, size=40):
    """Draws that scatter about published values."""
    generator = np.random.default_rng(0)
    draws = {
        name: (("chain", "draw"), value * (1 + spread * generator.standard_normal((2, size // 2))))
        for name, value in centre.items()
    }
    tree = xr.DataTree.from_dict({"posterior": xr.Dataset(draws)})
    tree.attrs = {
        "friction": friction,
        "effects": json.dumps(list(effects)),
        "parameters": json.dumps(list(centre)),
        "converged": 1,
        "complaints": "[]",
    }
    return Posterior(tree)


@pytest.fixture(scope="session")
def posterior():
    return posterior_about(TABLE_1_LINEAR | TABLE_2)


@pytest.fixture(scope="session")
def touching():
    """A posterior with coils that touch as soon as the joint moves."""
    contact = COIL_CONTACT | {"coil-contact.onset": 0.145}
    return posterior_about(TABLE_1_LINEAR | TABLE_2 | contact, effects=("coil-contact",))


@pytest.fixture(scope="session")
def heater():
    generator = np.random.default_rng(1)
    medians = {"gain": 4.0, "cooling": 0.02, "lag": 0.4}
    return {k: v * np.exp(0.1 * generator.standard_normal(100)) for k, v in medians.items()}


@pytest.fixture(scope="session")
def joints(posterior, heater):
    return joint_draws(posterior, heater, 4)
