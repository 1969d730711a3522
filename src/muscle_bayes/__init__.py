"""Bayesian calibration of artificial muscles and of the rigs that test them.

    import muscle_bayes as mb

    runs = mb.load_example("springs")
    posterior = mb.fit(runs, effort="quick")

The names below are the public ones (`__all__`); each is imported when it is first used, so that
importing the package is quick.
"""

from importlib import import_module
from operator import attrgetter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from muscle_bayes.api.fitting import fit
    from muscle_bayes.api.plants import plant_of
    from muscle_bayes.api.populations import fit_population
    from muscle_bayes.api.tuning import tune
    from muscle_bayes.compiled import keep_compiled_code
    from muscle_bayes.criticism.compare import compare
    from muscle_bayes.criticism.coverage import check_run as check
    from muscle_bayes.criticism.drift import drift
    from muscle_bayes.data.reader import read_runs
    from muscle_bayes.discovery.discover import discover
    from muscle_bayes.errors import MuscleBayesError
    from muscle_bayes.examples import load_example
    from muscle_bayes.inference.model.calibration_model import calibration_model
    from muscle_bayes.inference.posteriors.identifiability import identify
    from muscle_bayes.inference.posteriors.posterior import Posterior
    from muscle_bayes.inference.posteriors.predictive import predict_from_prior as prior_predict
    from muscle_bayes.inference.posteriors.predictive import predict_runs as predict
    from muscle_bayes.physics.effect import Effect
    from muscle_bayes.physics.plant import Plant
    from muscle_bayes.physics.schedule import Schedule
    from muscle_bayes.physics.simulation import (
        initial_state,
        simulate,
    )
    from muscle_bayes.physics.solvers.quasi_static import QuasiStatic
    from muscle_bayes.physics.solvers.stick_slip import StickSlip
    from muscle_bayes.report.control_figures import responses_figure as plot_responses
    from muscle_bayes.report.discovery_figures import before_after_figure as plot_before_after
    from muscle_bayes.report.discovery_figures import discovery_figure as plot_discovery
    from muscle_bayes.report.discovery_figures import misfit_figure as plot_misfit
    from muscle_bayes.report.discovery_figures import probability_figure as plot_probabilities
    from muscle_bayes.report.pairs_figure import pairs_figure as plot_pairs
    from muscle_bayes.report.posterior_figures import forest_figure as plot_forest
    from muscle_bayes.report.posterior_figures import (
        identifiability_figure as plot_identifiability,
    )
    from muscle_bayes.report.posterior_figures import posterior_figure as plot_posterior
    from muscle_bayes.report.predictive_figures import drift_figure as plot_drift
    from muscle_bayes.report.predictive_figures import predictive_figure as plot_prediction
    from muscle_bayes.report.predictive_figures import (
        prior_predictive_figure as plot_prior_prediction,
    )
    from muscle_bayes.report.run_figure import run_figure as plot_run
    from muscle_bayes.study.published import TABLE_1, TABLE_2

    load = Posterior.load
    __version__: str

__all__ = [
    "TABLE_1",
    "TABLE_2",
    "Effect",
    "MuscleBayesError",
    "Plant",
    "Posterior",
    "QuasiStatic",
    "Schedule",
    "StickSlip",
    "__version__",
    "calibration_model",
    "check",
    "compare",
    "discover",
    "drift",
    "fit",
    "fit_population",
    "identify",
    "initial_state",
    "keep_compiled_code",
    "load",
    "load_example",
    "plant_of",
    "plot_before_after",
    "plot_discovery",
    "plot_drift",
    "plot_forest",
    "plot_identifiability",
    "plot_misfit",
    "plot_pairs",
    "plot_posterior",
    "plot_prediction",
    "plot_prior_prediction",
    "plot_probabilities",
    "plot_responses",
    "plot_run",
    "predict",
    "prior_predict",
    "read_runs",
    "simulate",
    "tune",
]

_HOME = {
    "Effect": "physics.effect:Effect",
    "MuscleBayesError": "errors:MuscleBayesError",
    "Plant": "physics.plant:Plant",
    "Posterior": "inference.posteriors.posterior:Posterior",
    "QuasiStatic": "physics.solvers.quasi_static:QuasiStatic",
    "Schedule": "physics.schedule:Schedule",
    "TABLE_1": "study.published:TABLE_1",
    "TABLE_2": "study.published:TABLE_2",
    "StickSlip": "physics.solvers.stick_slip:StickSlip",
    "calibration_model": "inference.model.calibration_model:calibration_model",
    "check": "criticism.coverage:check_run",
    "compare": "criticism.compare:compare",
    "discover": "discovery.discover:discover",
    "drift": "criticism.drift:drift",
    "fit": "api.fitting:fit",
    "fit_population": "api.populations:fit_population",
    "identify": "inference.posteriors.identifiability:identify",
    "initial_state": "physics.simulation:initial_state",
    "keep_compiled_code": "compiled:keep_compiled_code",
    "load": "inference.posteriors.posterior:Posterior.load",
    "load_example": "examples:load_example",
    "plant_of": "api.plants:plant_of",
    "plot_before_after": "report.discovery_figures:before_after_figure",
    "plot_discovery": "report.discovery_figures:discovery_figure",
    "plot_drift": "report.predictive_figures:drift_figure",
    "plot_forest": "report.posterior_figures:forest_figure",
    "plot_identifiability": "report.posterior_figures:identifiability_figure",
    "plot_misfit": "report.discovery_figures:misfit_figure",
    "plot_pairs": "report.pairs_figure:pairs_figure",
    "plot_posterior": "report.posterior_figures:posterior_figure",
    "plot_prediction": "report.predictive_figures:predictive_figure",
    "plot_prior_prediction": "report.predictive_figures:prior_predictive_figure",
    "plot_probabilities": "report.discovery_figures:probability_figure",
    "plot_run": "report.run_figure:run_figure",
    "plot_responses": "report.control_figures:responses_figure",
    "predict": "inference.posteriors.predictive:predict_runs",
    "prior_predict": "inference.posteriors.predictive:predict_from_prior",
    "read_runs": "data.reader:read_runs",
    "simulate": "physics.simulation:simulate",
    "tune": "api.tuning:tune",
}
"""Where each public name is defined, as `module:attribute` within the package."""


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("muscle-bayes")
    elif name in _HOME:
        module, _, attribute = _HOME[name].partition(":")
        value = attrgetter(attribute)(import_module(f"{__name__}.{module}"))
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
