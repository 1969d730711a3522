"""The NumPyro model of a set of runs: a site for each unknown, an observed site for each run."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
import numpyro
import pandas as pd
from jaxtyping import Array, Bool, Float
from numpyro import distributions as dist

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import Run
from muscle_bayes.inference.model.discrepancy import OUDiscrepancy
from muscle_bayes.inference.model.lane_model import (
    LanePrediction,
    Values,
    muscle_of,
    predictions,
    zeros_of,
)
from muscle_bayes.inference.model.likelihood import noise_of, reading_distribution
from muscle_bayes.inference.model.muscle_prior import MUSCLE_PARAMETERS
from muscle_bayes.inference.model.problem import Data, Problem, pose
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.physics.effects.own import AnyEffectType


class CalibrationModel:
    """What is unknown about some runs, and how their readings depend on it: a NumPyro model.

    Calling it declares a `numpyro.sample` site for each unknown, a deterministic site for each
    parameter of Table 2, and an observed site for each run, named as the run. So NUTS, Predictive,
    SVI, `log_density`, `render_model` and `az.from_numpyro` take it as any other model. Readings are
    those of the intervals into which a run is divided (`problem.records`), padded to a common length.

    `predict=False` declares the unknowns alone. `data` replaces the runs' arrays by others of the same
    shapes: compiled code then serves many data sets. Printed, it is a table of the priors.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    def __call__(self, data: Data | None = None, predict: bool = True) -> None:
        data = self.problem.data if data is None else data
        layout = self.problem.layout
        values: dict[str, Array] = {}
        for name, shape in layout.shapes:
            values[name] = numpyro.sample(name, data.priors[name].to_event(len(shape)))
        if not predict:
            return
        muscle = muscle_of(values, data)
        if muscle is not None:
            for name in MUSCLE_PARAMETERS:
                if name not in values:
                    numpyro.deterministic(name, getattr(muscle, name))
        predicted = predictions(values, layout, data)
        numpyro.factor("solved", jnp.where(all_solved(predicted), 0.0, -jnp.inf))
        for run, (distribution, readings) in self.likelihoods(values, predicted, data).items():
            numpyro.sample(run, distribution, obs=readings)

    def __repr__(self) -> str:
        return self.table().to_string(index=False)

    def _repr_html_(self) -> str:
        return self.table().to_html(index=False)

    def table(self) -> pd.DataFrame:
        """The priors: site, distribution with three digits, unit, meaning."""
        rows = [(n, described(s.prior), s.unit, s.meaning) for n, s in self.problem.sites.items()]
        return pd.DataFrame(rows, columns=["site", "prior", "unit", "meaning"])

    def likelihoods(
        self, values: Values, predicted: Sequence[LanePrediction], data: Data
    ) -> dict[str, tuple[OUDiscrepancy, Float[Array, "*lane interval"]]]:
        """Of each run, the distribution of its readings under predictions, and the readings.

        A run that is cut into segments has a leading axis of these.
        """
        problem, layout, result = self.problem, self.problem.layout, {}
        groups = zip(
            predicted, data.lanes, layout.regimes, layout.segmented, problem.lane_runs, strict=True
        )
        for prediction, lanes, regime, cut, owners in groups:
            zeros = zeros_of(values, lanes, regime, cut)
            whole = reading_distribution(lanes, zeros, prediction, noise_of(values, regime), regime)
            for owner in dict.fromkeys(owners):
                own = [lane for lane, run in enumerate(owners) if run == owner]
                chosen: Any = own[0] if len(own) == 1 else np.asarray(own)
                result[problem.runs[owner].name] = whole.of(chosen), lanes.reading[chosen]
        return result


def described(prior: dist.Distribution) -> str:
    """A distribution in words: its family and parameters; of many values, their range."""

    def number(value: Any) -> str:
        flat = np.unique(np.asarray(value))
        return f"{flat[0]:.3g}" if flat.size == 1 else f"{flat[0]:.3g}..{flat[-1]:.3g}"

    kind = type(prior).__name__.removeprefix("Standardised")
    known = [key for key in type(prior).arg_constraints if hasattr(prior, key)]
    return f"{kind}({', '.join(f'{key}={number(getattr(prior, key))}' for key in sorted(known))})"


def all_solved(predicted: Sequence[LanePrediction]) -> Bool[Array, ""]:
    """Whether every simulation succeeded."""
    return jnp.stack([jnp.all(one.finite > 0.5) for one in predicted]).all()


@double_precision
def calibration_model(
    runs: Sequence[Run],
    friction: Friction = "coulomb",
    effects: Sequence[str | AnyEffectType] = (),
    priors: Mapping[str, dist.Distribution] | None = None,
) -> CalibrationModel:
    """The NumPyro model of what is unknown about these runs.

    Args:
        runs: as `read_runs` gives them; those that are fitted together log one unit of position.
        friction: "coulomb": dry friction that sticks, D in N m or N. "linear": friction
            proportional to speed, D in N m s or N s/m.
        effects: names of effects, or classes of your own, in the order in which they act.
        priors: distributions that replace the default ones, by the name of a site or of a parameter
            of Table 2.

    Returns:
        The model; printed, a table of its priors with units.

    Raises:
        MuscleBayesError: for runs that cannot be fitted together, unknown friction, effects
            and priors.

    Example:
        >>> from numpyro import distributions as dist
        >>> from muscle_bayes import calibration_model, load_example
        >>> model = calibration_model(load_example("springs"), priors={"J": dist.HalfNormal(3e-3)})
    """
    return CalibrationModel(pose(runs, friction, effects, priors))
