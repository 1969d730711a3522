"""`muscle-bayes check` without a fit: its errors, and its report of given predictions."""

import json

import pytest
from known_cases import posterior_of, sawtooth
from typer.testing import CliRunner

import muscle_bayes.data
from muscle_bayes.cli import app
from muscle_bayes.inference.posteriors import predictive as predictive_module
from muscle_bayes.inference.posteriors.posterior import Posterior


class _Metadata:
    origin = "synthetic"


class _Run:
    name = "example"
    metadata = _Metadata()


@pytest.fixture
def command(monkeypatch, tmp_path):
    """Runs `check` on a known prediction with a posterior that has converged or not."""

    def run(converged):
        values = {"D": sawtooth().model[:, 0]}
        given = posterior_of(values, values, converged=converged)
        monkeypatch.setattr(Posterior, "load", classmethod(lambda cls, path: given))
        monkeypatch.setattr(muscle_bayes.data, "read_runs", lambda paths: [_Run()])
        monkeypatch.setattr(predictive_module, "predict_runs", lambda *a, **k: [sawtooth()])
        words = ["check", "p.nc", "r.csv", "--json", f"{tmp_path}/c.json", "--out", str(tmp_path)]
        return CliRunner().invoke(app, words)

    return run


def test_checks_are_written_with_their_figures(command, tmp_path):
    result = command(converged=True)
    assert result.exit_code == 0, result.output
    told = json.loads((tmp_path / "c.json").read_text())
    assert {"rmse", "unit", "coverage90"} <= told["runs"]["example"].keys()
    assert told["drift"]["example"]["slope_difference"]["mean"] == pytest.approx(0.125, abs=0.03)
    assert (tmp_path / "example.png").exists()
    assert (tmp_path / "example-drift.png").exists()


def test_a_posterior_that_has_not_converged_exits_with_one(command, tmp_path):
    result = command(converged=False)
    assert result.exit_code == 1
    assert "NOT CONVERGED" in result.output
    assert json.loads((tmp_path / "c.json").read_text())["converged"] is False


def test_a_file_that_is_no_posterior_exits_with_two(tmp_path):
    path = tmp_path / "x.nc"
    path.write_text("no NetCDF")
    assert CliRunner().invoke(app, ["check", str(path), "data"]).exit_code == 2
