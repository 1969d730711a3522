"""Figures say what they show and are the same for the same numbers."""

import numpy as np
import pytest
from known_cases import gaussian, posterior_of, sawtooth

from muscle_bayes.criticism.coverage import check_run
from muscle_bayes.criticism.drift import drift
from muscle_bayes.examples import load_example
from muscle_bayes.report.posterior_figures import posterior_figure
from muscle_bayes.report.predictive_figures import (
    drift_figure,
    predictive_figure,
    prior_predictive_figure,
)
from muscle_bayes.report.run_figure import run_figure
from muscle_bayes.report.style import mark_origin, save


def texts(fig):
    """All words of titles, labels and legends."""
    parts = [fig.get_suptitle(), fig.get_supxlabel(), *(text.get_text() for text in fig.texts)]
    legends = list(fig.legends)
    for axis in fig.axes:
        parts += [axis.get_title(loc="left"), axis.get_xlabel(), axis.get_ylabel()]
        parts += [text.get_text() for text in axis.texts]
        parts += [child.get_ylabel() for child in axis.child_axes]
        legends += [legend] if (legend := axis.get_legend()) else []
    parts += [text.get_text() for legend in legends for text in legend.get_texts()]
    return "\n".join(parts)


def test_predictions_tell_origin_units_and_intervals(tmp_path):
    one = sawtooth()
    fig = predictive_figure(one, check_run(one), "synthetic")
    told = texts(fig)
    for word in ("Synthetic data", "[counts]", "[deg]", "$T_A$ [°C]", "time [s]", "90% of"):
        assert word in told
    for name in ("a.png", "b.png"):
        save(predictive_figure(one, check_run(one), "synthetic"), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_an_unheated_run_has_no_temperature_panel():
    one = gaussian(readings=200, draws=50)
    assert "temperature" not in texts(predictive_figure(one, check_run(one), "measured"))


def test_drift_tells_the_number_and_its_interval(tmp_path):
    one = sawtooth()
    fig = drift_figure(one, drift(one), "measured")
    assert "deg/min, 90 % interval" in texts(fig)
    assert sum("from" in axis.get_title(loc="left") for axis in fig.axes) == 4
    save(fig, tmp_path / "drift.png")


def test_drift_without_cold_phases_tells_why():
    one = gaussian(readings=200, draws=50)
    assert "never rises" in texts(drift_figure(one, drift(one)))


@pytest.mark.parametrize("count", [1, 3])
def test_prior_predictions_have_a_panel_for_each_run(count, tmp_path):
    fig = prior_predictive_figure([gaussian(readings=100, draws=50)] * count, "synthetic")
    assert len(fig.axes) == count
    mark_origin(fig, "synthetic")  # as a study does with all its figures
    assert [text.get_text() for text in fig.texts].count("Synthetic data") == 1
    save(fig, tmp_path / "prior.png")


def test_posteriors_show_units_published_values_and_failed_convergence(tmp_path):
    rng = np.random.default_rng(0)
    prior = {"D": np.exp(rng.standard_normal(500)), "C": rng.standard_normal(500)}
    after = {
        "D": np.exp(0.1 * rng.standard_normal(500)),
        "C": -0.5 + 0.01 * rng.standard_normal(500),
    }
    posterior = posterior_of(prior, after, converged=False)
    fig = posterior_figure(posterior, {"D": 1.1, "C": 3.0}, "rig")
    told = texts(fig)
    for word in (
        "rig",
        "Synthetic data",
        "NOT CONVERGED",
        "D [N]",
        "published value",
        "published 3 →",
    ):
        assert word in told
    save(fig, tmp_path / "posterior.png")


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("springs", ["position reading [counts]"]),
        ("sawtooth", ["position reading [counts]", "temperature [°C]", "load [g]"]),
    ],
)
def test_a_run_shows_what_it_has_and_no_more(name, shown):
    """A run without a heater's power has no panel of it."""
    figure = run_figure(load_example(name)[0])
    assert [axis.get_ylabel() for axis in figure.axes if axis.get_ylabel()] == shown
