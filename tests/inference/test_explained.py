"""A fit that does not explain its data is not called fine."""

import json

import numpy as np
import pytest
import xarray as xr

from muscle_bayes.inference.posteriors.explained import Limits, unexplained
from muscle_bayes.inference.posteriors.posterior import Posterior

ROWS, DRAWS = 200, 100
SWING = np.sin(np.linspace(0.0, 20.0, ROWS))


def fitted(seen, band=0.02, model=SWING, inertia=2e-3, friction=5e-3, noise=0.02) -> Posterior:
    """A posterior whose draws lie about `model` as wide as `band`."""
    rng = np.random.default_rng(0)
    drawn = model + band * rng.standard_normal((1, DRAWS, ROWS))
    dims = ["chain", "draw", "row"]
    readings = xr.Dataset(
        {"drop": (dims, drawn), "drop:model": (dims, np.broadcast_to(model, drawn.shape))}
    )
    observed = xr.Dataset({"drop": (["row"], seen, {"units": "rad"})})
    values = {"J": inertia, "D": friction}
    posterior = {
        name: (["chain", "draw"], np.full((1, DRAWS), value), {"units": "kg m^2"})
        for name, value in values.items()
    }
    posterior["fast.noise"] = (["chain", "draw"], np.full((1, DRAWS), noise), {"units": "rad"})
    prior = {
        name: (["chain", "draw"], rng.lognormal(np.log(3e-3), 2.0, (1, 1000))) for name in values
    }
    tree = xr.DataTree.from_dict(
        {
            "posterior": xr.Dataset(posterior),
            "prior": xr.Dataset(prior),
            "posterior_predictive": readings,
            "observed_data": observed,
        }
    )
    tree.attrs["parameters"] = json.dumps(list(values))
    return Posterior(tree)


NOISE = 0.02 * np.random.default_rng(1).standard_normal(ROWS)


def test_readings_within_their_bands_are_explained() -> None:
    assert unexplained(fitted(SWING + NOISE)) == []


def test_too_narrow_bands_are_not() -> None:
    (reason,) = unexplained(fitted(SWING + NOISE, band=0.005))
    assert "of the readings lie in the 90 % band" in reason


def test_wide_bands_do_not_hide_a_model_that_is_wrong() -> None:
    (reason,) = unexplained(fitted(SWING + NOISE, band=0.5, model=0.5 * SWING))
    assert reason.startswith("drop: the RMSE")
    assert "of the range" in reason
    assert unexplained(fitted(SWING, band=0.5, model=0.5 * SWING), Limits(misfit=0.3)) == []


@pytest.mark.parametrize("inertia", [1e-9, 1e4])
def test_an_inertia_that_nobody_would_have_thought_of(inertia: float) -> None:
    (reason,) = unexplained(fitted(SWING, inertia=inertia))
    assert reason.startswith("J: ")
    assert "plausible" in reason


def test_a_bearing_without_friction_is_plausible() -> None:
    assert unexplained(fitted(SWING, friction=1e-12)) == []
    assert len(unexplained(fitted(SWING, friction=1e6))) == 1


def test_noise_alone_is_explained() -> None:
    held = np.r_[np.zeros(ROWS // 2), np.ones(ROWS // 2)]
    away = held + 0.4 * np.where(np.arange(ROWS) % 2, 1.0, -1.0)
    assert unexplained(fitted(held, band=1.0, model=away, noise=0.3)) == []
    assert len(unexplained(fitted(held, band=1.0, model=away, noise=0.03))) == 1
