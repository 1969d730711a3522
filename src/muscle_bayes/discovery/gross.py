"""Gross misfit, taken for white noise at first: a lasting discrepancy would hide what causes it."""

import numpy as np

from muscle_bayes.discovery.locate import TOLERATED_TIME
from muscle_bayes.discovery.tolerance import noise_by_regime
from muscle_bayes.inference.search.descent import Fitted, descend
from muscle_bayes.inference.search.nested import Nested

GROSS = 3.0
"""Misfit, in the noise of a reading, from which on it is gross."""
STEPS = 15
"""Steps of the fit that takes misfit for white noise."""
NOISE = ("noise", "discrepancy", "correlation_time")


def noise_names(nested: Nested) -> list[str]:
    """Names of the noise parameters among the shared entries."""
    return [name for name in nested.shared_names() if name.endswith(tuple(f".{n}" for n in NOISE))]


def rms_by_regime(nested: Nested, fitted: Fitted) -> dict[str, tuple[float, float]]:
    """RMS residual of each regime's intervals [log's unit], and the readings in a usual interval."""
    found: dict[str, list[np.ndarray]] = {}
    weights: dict[str, list[np.ndarray]] = {}
    groups = zip(nested.layout.regimes, nested.data.lanes, fitted.found.residuals, strict=True)
    for regime, lanes, residual in groups:
        weight = np.asarray(lanes.weight)
        found.setdefault(regime, []).append(np.asarray(residual)[weight > 0])
        weights.setdefault(regime, []).append(weight[weight > 0])
    return {
        regime: (
            float(np.sqrt(np.mean(np.concatenate(parts) ** 2))),
            float(np.median(np.concatenate(weights[regime]))),
        )
        for regime, parts in found.items()
    }


def is_gross(nested: Nested, fitted: Fitted) -> bool:
    """Whether any regime's misfit is."""
    level = noise_by_regime(nested.problem)
    return any(
        rms > GROSS * level[name] for name, (rms, _) in rms_by_regime(nested, fitted).items()
    )


def _with_noise(nested: Nested, fitted: Fitted, values: dict[str, float]) -> np.ndarray:
    names, point = nested.shared_names(), fitted.point.copy()
    for name, value in values.items():
        point[names.index(name)] = np.log(value)
    return point


def as_white(nested: Nested, fitted: Fitted) -> Fitted:
    """The model fitted as if all of its misfit were white noise: looks at the whole shape of runs."""
    values = {}
    for regime, (rms, readings) in rms_by_regime(nested, fitted).items():
        values[f"{regime}.noise"] = rms * np.sqrt(readings)
        values[f"{regime}.discrepancy"] = 1e-3 * rms
    point = _with_noise(nested, fitted, values)
    return descend(nested, fitted.effects, point, STEPS, held=noise_names(nested))


def as_lasting(nested: Nested, fitted: Fitted) -> Fitted:
    """The model fitted in full, from where its misfit is taken for a lasting discrepancy."""
    level, values = noise_by_regime(nested.problem), {}
    for regime, (rms, _) in rms_by_regime(nested, fitted).items():
        values[f"{regime}.noise"] = level[regime]
        values[f"{regime}.discrepancy"] = max(rms, 0.1 * level[regime])
        values[f"{regime}.correlation_time"] = TOLERATED_TIME[regime]
    return descend(nested, fitted.effects, _with_noise(nested, fitted, values))
