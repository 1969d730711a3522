"""Sets of runs and effects that cannot be fitted together end in a message."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpyro import distributions as dist

from muscle_bayes.data import Run, read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.density import log_likelihood
from muscle_bayes.inference.model.problem import MUSCLE_PORTS, pose
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.physics.effects import CATALOGUE, effect_type

DATA = Path(__file__).parents[2] / "data" / "plain"


@pytest.mark.parametrize("name", CATALOGUE)
def test_effects_on_a_muscle_need_one(name):
    springs = read_runs([DATA / "spring-1.csv"])
    if effect_type(name).port in MUSCLE_PORTS:
        with pytest.raises(
            MuscleBayesError, match=f"'{name}' acts on a muscle, but no run has one"
        ):
            pose(springs, effects=(name,))
    else:
        sampled = [site for site, _ in pose(springs, effects=(name,)).layout.shapes]
        assert any(site.startswith(f"{name}.") for site in sampled)


def test_nothing_to_fit_and_effects_named_twice():
    with pytest.raises(MuscleBayesError, match="no runs were given"):
        pose([])
    with pytest.raises(MuscleBayesError, match="named twice"):
        pose(read_runs([DATA / "spring-1.csv"]), effects=("bias-torque", "bias-torque"))


def in_degrees(folder: Path, source: str, shift: float, told: str) -> Path:
    """A shipped spring run as another rig would log it: in degrees, its zero off by `shift`."""
    log = pd.read_csv(DATA / f"{source}.csv", skipinitialspace=True)
    angle = np.degrees(0.0058 * (log["Potentiometer Reading"] - 512.0)) + shift
    pd.DataFrame({"t": log["Time (s)"], "angle": angle.round(3)}).to_csv(
        folder / f"{source}.csv", index=False
    )
    toml = (DATA / f"{source}.toml").read_text()
    start, end = toml.index("[potentiometer]"), toml.index("[element_a]")
    columns = f'[columns]\ntime = "t"\nposition = "angle"\nposition_unit = "deg"\n{told}\n\n'
    (folder / f"{source}.toml").write_text(toml[:start] + columns + toml[end:])
    return folder / f"{source}.csv"


def test_a_zero_that_may_be_off_is_an_unknown_of_each_run(tmp_path):
    exact = read_runs([in_degrees(tmp_path, "spring-1", 0.0, "position_zero_uncertainty = 0.0")])
    assert "fast.zero" not in dict(pose(exact).layout.shapes)
    unsure = "position_zero = 5.0\nposition_zero_uncertainty = 0.5"
    runs = read_runs([*(run.path for run in exact), in_degrees(tmp_path, "spring-2", 5.7, unsure)])
    posed = pose(runs)
    assert dict(posed.layout.shapes)["fast.zero"] == (2,)
    prior = posed.data.priors["fast.zero"]
    np.testing.assert_allclose(prior.mean, [0.0, 5.0])
    assert prior.scale[0] < 1e-3
    assert prior.scale[1] == 0.5
    (unsaid,) = read_runs([in_degrees(tmp_path, "spring-3", 0.0, "")])
    scale = pose([unsaid]).data.priors["fast.zero"].scale
    np.testing.assert_allclose(scale, 2.0 * unsaid.sensor.resolution)


def likelihood_at_prior_centres(runs: list[Run]) -> float:
    """Log likelihood where every quantity has its prior's median, or mean where it is normal."""
    posed = pose(runs)
    centres = {
        name: prior.mean if isinstance(prior, dist.Normal) else prior.icdf(0.5)
        for name, prior in ((name, posed.data.priors[name]) for name, _ in posed.layout.shapes)
    }
    return float(log_likelihood(centres, posed.layout, posed.data))


@double_precision
def test_an_exact_zero_counts_where_it_is(tmp_path):
    paths = []
    for shift, told in ((0.0, ""), (5.0, "position_zero = 5.0")):
        folder = tmp_path / f"{shift}"
        folder.mkdir()
        paths.append(in_degrees(folder, "spring-1", shift, told))
    at_zero, away = (likelihood_at_prior_centres(read_runs([path])) for path in paths)
    assert away == pytest.approx(at_zero, abs=0.01)

    toml = (DATA / "spring-1.toml").read_text()
    scale = "radians_per_count = 0.0058\n"
    (tmp_path / "spring-1.csv").write_bytes((DATA / "spring-1.csv").read_bytes())
    (tmp_path / "spring-1.toml").write_text(toml.replace(scale, scale + "zero_uncertainty = 0.0\n"))
    exact = likelihood_at_prior_centres(read_runs([tmp_path / "spring-1.csv"]))
    unsure = likelihood_at_prior_centres(read_runs([DATA / "spring-1.csv"]))
    assert exact == pytest.approx(unsure, abs=0.01)
