"""Figures are drawn as they are printed: no wider than a line, no text under 7 points."""

from types import SimpleNamespace

import numpy as np
import pytest
from known_cases import gaussian, posterior_of, sawtooth
from matplotlib.text import Text

from muscle_bayes.control.batch import SHOWN_EVERY
from muscle_bayes.criticism.coverage import check_run
from muscle_bayes.criticism.drift import drift
from muscle_bayes.examples import load_example
from muscle_bayes.inference.posteriors.identifiability import Identifiability, ParameterReport
from muscle_bayes.report.control_figures import responses_figure
from muscle_bayes.report.discovery_figures import discovery_figure
from muscle_bayes.report.pairs_figure import pairs_figure
from muscle_bayes.report.posterior_figures import (
    forest_figure,
    identifiability_figure,
    posterior_figure,
)
from muscle_bayes.report.predictive_figures import (
    drift_figure,
    predictive_figure,
    prior_predictive_figure,
)
from muscle_bayes.report.run_figure import run_figure
from muscle_bayes.report.style import SMALLEST, WIDTH


def _posterior(count: int):
    rng = np.random.default_rng(0)
    names = [f"p{number}" for number in range(count)]
    prior = {name: rng.standard_normal(400) for name in names}
    return posterior_of(prior, {name: 0.1 * rng.standard_normal(400) for name in names})


def _identified() -> Identifiability:
    one = ParameterReport(0.9, False, "", 0.1, {})
    return Identifiability({f"p{number}": one for number in range(9)}, (), ())


def _discovered(steps: int):
    """A search that found an effect, or none, as far as figures look at it."""
    rng = np.random.default_rng(0)
    time = np.linspace(0.0, 100.0, 200)

    def traced(size: float, windows: tuple) -> SimpleNamespace:
        residual = 0.2 * rng.standard_normal(200) + size * (time < 20.0)
        trace = SimpleNamespace(run="a", unit="counts", time=time, residual=residual)
        return SimpleNamespace(traces=(trace,), windows=windows, p_value=0.01)

    window = SimpleNamespace(run="a", start=0.0, end=20.0)
    return SimpleNamespace(
        located=traced(1.0, (window,)),
        final=SimpleNamespace(misfit=traced(0.0, ())),
        steps=tuple(SimpleNamespace(added=f"effect-{number}") for number in range(steps)),
        probabilities={"coil-contact": 0.9, "none": 0.06, "load-dependent-friction": 0.04},
    )


def _responses():
    """Loops in three scenarios, as far as the figure looks at them."""
    flat = np.ones(100 * SHOWN_EVERY)
    course = SimpleNamespace(setpoint=flat, load=flat)
    courses = [
        SimpleNamespace(name=name, course=course) for name in ("step", "square", "load-sine-0.1592")
    ]
    outcomes = {one.name: SimpleNamespace(angle=np.ones((9, 100))) for one in courses}
    return SimpleNamespace(
        scenarios=courses,
        outcomes={"pi": outcomes, "thesis": outcomes},
        gains={"pi": SimpleNamespace(period=0.03)},
        specs={one.name: SimpleNamespace(infeasible="") for one in courses},
        probability=lambda law, name: (0.5, 0.1),
    )


def test_a_response_out_of_reach_says_what_its_share_is_of():
    """Then peaks count as well as runaways."""
    found = _responses()
    limits = {"tracking": 2.0, "peak_temperature": 95.0}
    found.specs["square"] = SimpleNamespace(infeasible="no input does", limits=limits)
    panels = responses_figure(found, ["pi", "thesis"]).axes
    told = {axis.get_title(loc="left").strip() or axis.get_title().strip(): axis for axis in panels}
    texts = {name: axis.texts[0].get_text() for name, axis in told.items() if name}
    assert texts["step"] == "meets: pi 50%\nthesis 50%"
    assert texts["square"] == "no runaway, at most 95 °C:\npi 50%\nthesis 50%"


FIGURES = {
    "discovery": lambda: discovery_figure(_discovered(1), "a", "synthetic"),
    "nothing discovered": lambda: discovery_figure(_discovered(0), "a", "measured"),
    "responses": lambda: responses_figure(_responses(), ["pi", "thesis"]),
    "prediction": lambda: predictive_figure(sawtooth(), check_run(sawtooth()), "synthetic"),
    "prior": lambda: prior_predictive_figure([gaussian(readings=100, draws=50)] * 2),
    "drift": lambda: drift_figure(sawtooth(), drift(sawtooth()), "synthetic"),
    "posterior": lambda: posterior_figure(_posterior(11)),
    "pairs": lambda: pairs_figure(_posterior(6)),
    "forest": lambda: forest_figure({"nominal": _posterior(4), "revised": _posterior(4)}),
    "identifiability": lambda: identifiability_figure(_identified()),
    "run": lambda: run_figure(load_example("sawtooth")[0]),
}


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_fits_a_printed_line_and_can_be_read(name):
    fig = FIGURES[name]()
    assert fig.get_size_inches()[0] <= WIDTH
    assert fig.get_size_inches()[1] <= 8.5
    small = {
        one.get_text()
        for one in fig.findobj(Text)
        if one.get_visible() and one.get_text().strip() and one.get_fontsize() < SMALLEST
    }
    assert small == set()


def test_a_discovery_of_two_effects_names_both():
    axis = discovery_figure(_discovered(2), "a", "synthetic").axes[1]
    assert axis.get_title(loc="left").endswith("First:")
    assert axis.get_xlabel() == "probability; then effect-1"
    alone = discovery_figure(_discovered(1), "a", "synthetic").axes[1]
    assert (alone.get_title(loc="left"), alone.get_xlabel()) == ("what is missing?", "probability")
