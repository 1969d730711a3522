"""A GPU is used where there is one, and asked for in vain with a message."""

from pathlib import Path

import jax
import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app

DATA = Path(__file__).parents[2] / "data" / "plain"


def has_gpu() -> bool:
    try:
        return bool(jax.devices("gpu"))
    except RuntimeError:
        return False


@pytest.mark.skipif(has_gpu(), reason="there is a GPU")
def test_a_missing_gpu_is_told(tmp_path: Path) -> None:
    arguments = ["fit", str(DATA / "spring-1.csv"), "--out", str(tmp_path / "p.nc")]
    result = CliRunner().invoke(app, [*arguments, "--device", "gpu"])
    assert result.exit_code == 2
    assert "JAX finds no GPU" in result.output


@pytest.mark.skipif(not has_gpu(), reason="there is no GPU")
def test_predictions_are_the_same_on_a_gpu() -> None:
    from muscle_bayes.data import read_runs
    from muscle_bayes.inference.posteriors.predictive import predict_from_prior

    runs = read_runs([DATA / "staircase-139g.csv"])
    with jax.default_device(jax.devices("cpu")[0]):
        here = predict_from_prior(runs, draws=8)[0].model
    with jax.default_device(jax.devices("gpu")[0]):
        there = predict_from_prior(runs, draws=8)[0].model
    assert abs(here - there).max() < 1e-6 * abs(here).max()
