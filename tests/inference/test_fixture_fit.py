"""The shipped spring runs give back the fixture that made them."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.predictive import predict_runs
from muscle_bayes.inference.posteriors.summary import summarise
from muscle_bayes.inference.sampling.fit import QUICK, fit

DATA = Path(__file__).parents[2] / "data" / "plain"
SPRINGS = sorted(DATA.glob("spring-*.csv"))


@pytest.fixture(scope="module")
def fitted() -> Posterior:
    return fit(read_runs(SPRINGS), effort=QUICK, seed=4)


def test_truth_lies_within_four_standard_deviations(fitted: Posterior) -> None:
    truth = tomllib.loads((DATA / "truth.toml").read_text())["rotor"]
    for name in ("J", "D"):
        draws = fitted.tree["posterior"][name].to_numpy()
        assert abs(draws.mean() - truth[name]) < 4.0 * draws.std()
        assert draws.std() < 0.01 * truth[name]


def test_readings_lie_in_their_predictive_intervals(fitted: Posterior) -> None:
    runs = summarise(fitted)["runs"]
    for run in runs.values():
        assert run["unit"] == "counts"
        assert 0.4 < run["rmse"] < 0.7
    shares = [run["coverage90"] for run in runs.values()]
    readings = sum(fitted.tree["observed_data"][name].size for name in runs)
    spread = np.sqrt(0.9 * 0.1 / readings)
    assert abs(np.mean(shares) - 0.9) < 4.0 * spread


def test_saved_posterior_comes_back(fitted: Posterior, tmp_path: Path) -> None:
    fitted.save(tmp_path / "p.nc")
    again = Posterior.load(tmp_path / "p.nc")
    assert again.parameters == ("J", "D")
    before, after = summarise(fitted), summarise(again)
    for name, row in before["parameters"].items():
        unit, found = row.pop("unit"), after["parameters"][name]
        assert found.pop("unit") == unit
        assert found == pytest.approx(row, rel=1e-9)
    for name, row in before["runs"].items():
        assert after["runs"][name]["rmse"] == pytest.approx(row["rmse"], rel=1e-9)
    assert after["checksums"] == before["checksums"]
    groups = {"posterior", "prior", "sample_stats", "posterior_predictive", "log_likelihood"}
    assert groups | {"observed_data", "constant_data"} == set(again.tree.children)
    assert json.loads(again.tree.attrs["runs"]).keys() == {path.stem for path in SPRINGS}


def test_an_unfitted_run_is_predicted(fitted: Posterior) -> None:
    run = read_runs(SPRINGS[:1])[0]
    renamed = type(run)("new", run.path, run.metadata, run.table)
    (one,) = predict_runs(fitted, [renamed], draws=40, seed=1)
    assert one.model.shape == (40, one.time.size)
    assert np.sqrt(np.mean((one.observed - one.model.mean(axis=0)) ** 2)) < 3.0


def test_prediction_needs_the_parameters_of_the_run(fitted: Posterior) -> None:
    staircase = read_runs([DATA / "staircase-139g.csv"])
    with pytest.raises(MuscleBayesError, match="contraction"):
        predict_runs(fitted, staircase, draws=4)


def test_a_file_that_is_no_posterior(tmp_path: Path) -> None:
    path = tmp_path / "no.nc"
    path.write_text("no")
    with pytest.raises(MuscleBayesError, match="is not a NetCDF file"):
        Posterior.load(path)


def test_what_cannot_be_fitted_together() -> None:
    runs = read_runs(SPRINGS[:1])
    with pytest.raises(MuscleBayesError, match="catalogue"):
        pose(runs, effects=["no-such-effect"])
    with pytest.raises(MuscleBayesError, match="twice"):
        pose(runs, effects=["bias-torque", "bias-torque"])
    with pytest.raises(MuscleBayesError, match="muscle"):
        pose(runs, effects=["coil-contact"])
    with pytest.raises(MuscleBayesError, match="no runs"):
        pose([])
