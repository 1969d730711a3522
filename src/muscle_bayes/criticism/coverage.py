"""How well the predictions of a run agree with what was logged: RMSE, coverage and PIT."""

from dataclasses import asdict, dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import kstest

from muscle_bayes.errors import refuse_all_but
from muscle_bayes.inference.posteriors.predict import Prediction

WINDOWS = 10
"""Number of equal spans of time into which a run is divided to see how the checks vary."""
PIT_SEED = 20_240
"""Seed of the ranks' random part, fixed so that the same predictions give the same check."""

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Window:
    """The checks within a span of time. A span without readings has `readings` 0 and NaN."""

    start: float
    """s"""
    end: float
    """s"""
    readings: int
    bias: float
    """mean of observed minus mean model [unit of the reading]"""
    rmse: float
    """[unit of the reading]"""
    coverage50: float
    coverage90: float
    pit: float
    """mean PIT; 0.5 where the readings lie evenly about the prediction"""


@dataclass(frozen=True, repr=False)
class RunCheck:
    """The checks of one run."""

    run: str
    unit: str
    """unit of the reading"""
    rmse: float
    """[unit]"""
    judged_unit: str
    """deg, or mm where motion is linear"""
    judged_rmse: float
    """[judged_unit]"""
    coverage50: float
    """share of readings within the central 50 % of the predictive draws"""
    coverage90: float
    pit: Values
    """rank of each reading among its predictive draws, as a share"""
    pit_distance: float
    """largest distance of the PIT values' distribution from the uniform one (Kolmogorov)"""
    windows: tuple[Window, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers; the PIT values as a histogram of ten equal bins, in shares."""
        counts, _ = np.histogram(self.pit, bins=10, range=(0.0, 1.0))
        return {
            "rmse": self.rmse,
            "unit": self.unit,
            f"rmse_{self.judged_unit}": self.judged_rmse,
            "coverage50": self.coverage50,
            "coverage90": self.coverage90,
            "pit_histogram": (counts / max(self.pit.size, 1)).tolist(),
            "pit_distance": self.pit_distance,
            "windows": [asdict(window) for window in self.windows],
        }

    def __repr__(self) -> str:
        return (
            f"RunCheck({self.run}: RMSE {self.rmse:.3g} {self.unit} = {self.judged_rmse:.3g} "
            f"{self.judged_unit}, coverage {self.coverage50:.0%} of 50 %, "
            f"{self.coverage90:.0%} of 90 %)"
        )

    def _repr_html_(self) -> str:
        header = "<th>from [s]<th>to [s]<th>RMSE<th>50 %<th>90 %<th>mean PIT"
        rows = "".join(
            f"<tr><td>{w.start:.4g}<td>{w.end:.4g}<td>{w.rmse:.3g}<td>{w.coverage50:.0%}"
            f"<td>{w.coverage90:.0%}<td>{w.pit:.2f}</tr>"
            for w in self.windows
            if w.readings
        )
        return f"<p>{escape(repr(self))}</p><table><tr>{header}</tr>{rows}</table>"


def judged_unit(prediction: Prediction) -> tuple[str, float]:
    """The unit in which a person judges a rotor's coordinate.

    Its name, deg or mm, and how many of it one unit of reading is, with sign.
    """
    if prediction.unit in ("m", "mm"):
        return "mm", prediction.scale * 1e3
    return "deg", prediction.scale * 180.0 / np.pi


def _residual(prediction: Prediction) -> Values:
    return prediction.observed - prediction.model.mean(axis=0)


def _root_mean_square(values: Values) -> float:
    return float(np.sqrt(np.mean(values**2)))


def rmse(prediction: Prediction) -> float:
    """sqrt(mean (observed - mean model)^2) in the unit of the reading."""
    return _root_mean_square(_residual(prediction))


def judged_rmse(prediction: Prediction) -> float:
    """The same in degrees, or in mm where motion is linear."""
    return rmse(prediction) * abs(judged_unit(prediction)[1])


def inside(prediction: Prediction, level: float) -> NDArray[np.bool_]:
    """Whether each reading lies within the central interval of its predictive draws."""
    tail = 0.5 * (1.0 - level)
    low, high = np.quantile(prediction.reading, [tail, 1.0 - tail], axis=0)
    return (prediction.observed >= low) & (prediction.observed <= high)


def coverage(prediction: Prediction, level: float) -> float:
    """Share of readings within the central interval; `level` itself if predictions are honest."""
    return float(np.mean(inside(prediction, level)))


def pit(prediction: Prediction) -> Values:
    """Probability integral transform: (draws below + u (draws equal + 1)) / (draws + 1).

    u is uniform in [0, 1], so that the ranks of honest predictions are exactly uniform.
    """
    draws = prediction.reading
    below = np.sum(draws < prediction.observed, axis=0)
    equal = np.sum(draws == prediction.observed, axis=0)
    share = np.random.default_rng(PIT_SEED).uniform(size=prediction.observed.size)
    return (below + share * (equal + 1.0)) / (draws.shape[0] + 1.0)


def windows(prediction: Prediction, count: int = WINDOWS) -> tuple[Window, ...]:
    """The checks in `count` equal spans of time."""
    time, residual = prediction.time, _residual(prediction)
    half, most, ranks = inside(prediction, 0.5), inside(prediction, 0.9), pit(prediction)
    edges = np.linspace(time[0], time[-1], count + 1)
    owner = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, count - 1)
    result = []
    for index in range(count):
        own = owner == index
        span = float(edges[index]), float(edges[index + 1])
        if not own.any():
            result.append(Window(*span, 0, *[float("nan")] * 5))
            continue
        shares = (float(np.mean(values[own])) for values in (half, most, ranks))
        misfit = float(np.mean(residual[own])), _root_mean_square(residual[own])
        result.append(Window(*span, int(own.sum()), *misfit, *shares))
    return tuple(result)


def check_run(prediction: Prediction) -> RunCheck:
    """How well a prediction agrees with its run: RMSE, coverage and PIT.

    Checked is the part that is predicted ahead, which is the whole of a fitted run.

    Args:
        prediction: of one run, as `predict` gives it.

    Returns:
        RMSE [the log's unit, and deg or mm], and shares of readings within the central 50 and 90 % of
        the predictive draws. PIT values: ranks of readings among the draws. The same for ten spans of
        time.

    Example:
        >>> import muscle_bayes as mb
        >>> runs = mb.load_example("springs")
        >>> posterior = mb.fit(runs, effort="quick", progress=False)
        >>> check = mb.check(mb.predict(posterior, runs)[0])
        >>> check.run, check.judged_unit, len(check.windows)
        ('spring-1', 'deg', 10)
    """
    refuse_all_but(Prediction, prediction, "prediction", "give one of those that `predict` returns")
    prediction = prediction.ahead()
    ranks = pit(prediction)
    return RunCheck(
        run=prediction.run,
        unit=prediction.unit,
        rmse=rmse(prediction),
        judged_unit=judged_unit(prediction)[0],
        judged_rmse=judged_rmse(prediction),
        coverage50=coverage(prediction, 0.5),
        coverage90=coverage(prediction, 0.9),
        pit=ranks,
        pit_distance=float(kstest(ranks, "uniform").statistic),
        windows=windows(prediction),
    )
