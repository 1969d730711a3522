"""Gain, cooling rate and lag of the heater tubes, with uncertainty, from the runs' own temperatures."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Final

import numpy as np
import pandas as pd
from scipy.optimize import minimize
from scipy.signal import lfilter

from muscle_bayes.bench.heat.temperature_control import HeaterLaw
from muscle_bayes.control.plant.certain_duty import STEP, Stretch, stretches
from muscle_bayes.data.run import Run
from muscle_bayes.errors import MuscleBayesError

PRIOR: Final = {"gain": (3.5, 0.9), "cooling": (1 / 55, 1.0), "lag": (1.0, 1.0)}
"""Median and standard deviation of the logarithm: a tube the size of a pencil, of glass or of aluminium
under Kapton, wound with a heating wire, reaches 90 C in ten seconds to minutes. K/s, 1/s, s."""
ASSUMED_SPREAD: Final = 0.3
"""Standard deviation of the logarithm where no runs tell: the same medians, taken for known to 30 %."""
CELLS: Final = 25
WIDENINGS: Final = 12
NEGLIGIBLE: Final = 1e-3
"""Most probability that may lie on an edge of the grid."""
LARGEST_PRODUCT: Final = 0.5
"""Of cooling rate and lag: a longer lag would be told from cooling by nothing."""
DRAWS: Final = 1000
LEAST_NOISE: Final = 0.029
"""Rounding to 0.1 C [C]."""
UNITS: Final = {"gain": "K/s at full duty", "cooling": "1/s", "lag": "s"}


@dataclass(frozen=True)
class HeaterPosterior:
    """Draws of `gain`, `cooling` and `lag`, and which of them the runs told."""

    draws: dict[str, np.ndarray]
    told: dict[str, bool]
    source: str

    def note(self) -> str:
        """Where the numbers come from, in a line."""
        untold = [name for name, told in self.told.items() if not told]
        return f"heater {self.source}" + (
            f"; not identified: {', '.join(untold)}" if untold else ""
        )

    def summary(self) -> pd.DataFrame:
        """Mean, sd, 90 % interval, unit and whether runs told it."""
        rows = {
            name: {
                "mean": value.mean(),
                "sd": value.std(),
                "q05": np.quantile(value, 0.05),
                "q95": np.quantile(value, 0.95),
                "unit": UNITS[name],
                "from runs": self.told[name],
            }
            for name, value in self.draws.items()
        }
        return pd.DataFrame(rows).T

    def _repr_html_(self) -> str:
        return f"<p><b>Heater</b>, {escape(self.source)}</p>{self.summary()._repr_html_()}"  # type: ignore[operator]


def assumed_heater(seed: int = 0) -> HeaterPosterior:
    """Heaters as they are taken to be where no run is given."""
    generator = np.random.default_rng(seed)
    draws = {
        name: median * np.exp(ASSUMED_SPREAD * generator.standard_normal(DRAWS))
        for name, (median, _) in PRIOR.items()
    }
    return HeaterPosterior(draws, dict.fromkeys(PRIOR, False), "assumed, not measured")


def response(duty: np.ndarray, cooling: float, lag: float) -> np.ndarray:
    """Temperature per gain at the instants of a duty, from rest: lag p' = duty - p, x' = p - cooling x.

    Exact for a duty that stands still from instant to instant.
    """
    cools, lags = np.exp(-cooling * STEP), np.exp(-STEP / lag)
    by_power = lag * (cools - lags) / (1.0 - cooling * lag)
    by_duty = (1.0 - cools) / cooling - by_power
    power = lfilter([0.0, 1.0 - lags], [1.0, -lags], duty)
    return lfilter([0.0, 1.0], [1.0, -cools], by_power * power + by_duty * duty)


class _Linear:
    """What is left when cooling and lag are held: linear in gain, room, and each stretch's start.

        T(t) = T_room + x_0 (e^{-ct} + c late(t)) + g response(t),
        late(t) = lag (e^{-ct} - e^{-t/lag}) / (1 - c lag)

    for a power that at t = 0 is what holds x_0, and is late by `lag` behind the duty (`response`), with a
    Gaussian prior on each, so that their posterior and the evidence are exact.
    """

    def __init__(self, found: Sequence[Stretch]) -> None:
        self.found = found
        self.y = np.concatenate([one.temperature for one in found])
        self.timing = np.concatenate([one.timing for one in found])
        self.room = found[0].room
        # gain, room, and where each stretch starts
        self.mean = np.r_[PRIOR["gain"][0], self.room, [o.temperature[0] - o.room for o in found]]
        self.sd = np.r_[PRIOR["gain"][0], 1.0, [10.0] * len(found)]

    def matrix(self, cooling: float, lag: float) -> np.ndarray:
        """Readings per gain, room and starts."""
        rows = []
        for index, one in enumerate(self.found):
            cools = np.exp(-cooling * one.time)
            late = lag * (cools - np.exp(-one.time / lag)) / (1.0 - cooling * lag)
            part = np.zeros((one.time.size, 2 + len(self.found)))
            if one.duty.any():
                instants = STEP * np.arange(one.duty.size)
                part[:, 0] = np.interp(one.time, instants, response(one.duty, cooling, lag))
            part[:, 1] = 1.0
            part[:, 2 + index] = cools + cooling * late
            rows.append(part)
        return np.concatenate(rows)

    def posterior(self, cooling: float, lag: float, noise: float):
        """Mean and Cholesky factor of the precision, of what is linear in units of its prior; evidence."""
        matrix, spread = self.matrix(cooling, lag), np.hypot(noise, self.timing)
        design = matrix * self.sd / spread[:, None]
        short = (self.y - matrix @ self.mean) / spread
        factor = np.linalg.cholesky(np.eye(self.sd.size) + design.T @ design)
        half = np.linalg.solve(factor, design.T @ short)
        best = np.linalg.solve(factor.T, half)
        evidence = 0.5 * (half @ half - short @ short) - np.log(np.diag(factor)).sum()
        return best, factor, evidence - np.log(spread).sum()

    def residual(self, cooling: float, lag: float, noise: float) -> np.ndarray:
        best, _, _ = self.posterior(cooling, lag, noise)
        return self.y - self.matrix(cooling, lag) @ (self.mean + self.sd * best)


def _log_density(linear: _Linear, noise: float, log_cooling: float, log_lag: float) -> float:
    """Log posterior density of both logarithms, up to a constant."""
    cooling, lag = np.exp(log_cooling), np.exp(log_lag)
    if cooling * lag > LARGEST_PRODUCT:
        return -np.inf
    prior = 0.0
    for name, logarithm in (("cooling", log_cooling), ("lag", log_lag)):
        median, spread = PRIOR[name]
        prior -= 0.5 * ((logarithm - np.log(median)) / spread) ** 2
    return float(linear.posterior(cooling, lag, noise)[2] + prior)


def _mode(linear: _Linear, noise: float) -> np.ndarray:
    """Where the density is highest, looked for from short, middling and long lags."""

    def short_of_all(x: np.ndarray) -> Any:
        return -max(_log_density(linear, noise, *x), -1e12)

    found = []
    for lag in (0.05, 0.5, 5.0):
        start = np.log([PRIOR["cooling"][0], lag])
        found.append(
            minimize(
                short_of_all,
                start,
                method="Nelder-Mead",
                options={"xatol": 1e-5, "fatol": 1e-3, "initial_simplex": start + _SIMPLEX},
            )
        )
    return min(found, key=lambda one: one.fun).x


_SIMPLEX: Final = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 1.0]])


def _grid(linear: _Linear, noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axes of log cooling and log lag about the mode, and the probabilities of their cells.

    Each axis reaches as far as the density along it matters, and is widened while an edge does.
    """
    mode = _mode(linear, noise)
    top = _log_density(linear, noise, *mode)
    reach = np.zeros((2, 2))
    for axis in (0, 1):
        for side, sign in enumerate((-1, 1)):
            step = 1e-5
            while step < 3.0:
                aside = mode.copy()
                aside[axis] += sign * step
                if _log_density(linear, noise, *aside) < top - 8.0:
                    break
                step *= 1.5
            reach[axis, side] = step
    for _ in range(WIDENINGS):
        axes = [np.linspace(m - r[0], m + r[1], CELLS) for m, r in zip(mode, reach, strict=True)]
        value = np.array([[_log_density(linear, noise, c, g) for g in axes[1]] for c in axes[0]])
        weight = np.exp(value - value.max())
        weight /= weight.sum()
        edges = np.array(
            [[weight[0].sum(), weight[-1].sum()], [weight[:, 0].sum(), weight[:, -1].sum()]]
        )
        if (edges < NEGLIGIBLE).all():
            break
        reach = np.where(edges < NEGLIGIBLE, reach, 1.5 * reach)
    return axes[0], axes[1], weight


def fit_heater(
    runs: Sequence[Run], law: HeaterLaw | None = None, *, draws: int = DRAWS, seed: int = 0
) -> HeaterPosterior:
    """The heater's posterior from where its duty is known.

    That is everywhere in a run that logs its duty; in runs without it, where the bench's law leaves no
    doubt that it is nothing or full.

    Cooling rate and lag lie on a grid about their mode, everything else is integrated out exactly. The
    noise is that of the residuals and of their correlation, beside what not knowing the time of a reading
    makes. Without a stretch that is heated the gain is not told, and stays as `PRIOR` has it. Raises
    MuscleBayesError where no stretch is found at all.
    """
    found = [one for run in runs for one in stretches(run, law or HeaterLaw())]
    if not found:
        raise MuscleBayesError(
            "these runs never leave it certain that a heater is off, or on at full duty. Fix: give "
            "runs that cool from 90 C, and for the gain some that heat from room temperature to 90 C"
        )
    linear = _Linear(found)
    noise = 0.1
    for _ in range(2):  # a second time with the noise that the first left over
        cooling, lag, weight = _grid(linear, noise)
        i, j = np.unravel_index(weight.argmax(), weight.shape)
        left = linear.residual(np.exp(cooling[i]), np.exp(lag[j]), noise)
        noise = _noise(left, linear.timing)
    generator = np.random.default_rng(seed)
    cells = generator.choice(weight.size, size=draws, p=weight.ravel())
    inside = generator.uniform(-0.5, 0.5, (2, draws))
    log_c = cooling[cells // CELLS] + inside[0] * (cooling[1] - cooling[0])
    log_lag = lag[cells % CELLS] + inside[1] * (lag[1] - lag[0])
    gain = np.array(
        [
            _gain(linear, c, one, noise, generator)
            for c, one in zip(np.exp(log_c), np.exp(log_lag), strict=True)
        ]
    )
    told = any(bool(one.duty.any()) for one in found)
    if not told:
        median, spread = PRIOR["gain"]
        gain = median * np.exp(spread * generator.standard_normal(draws))
    values = {"gain": gain, "cooling": np.exp(log_c), "lag": np.exp(log_lag)}
    names = ", ".join(run.name for run in runs)
    return HeaterPosterior(values, {"gain": told, "cooling": True, "lag": True}, f"from {names}")


def _noise(left: np.ndarray, timing: np.ndarray) -> float:
    """Standard deviation of independent noise that tells as little as the residuals do [C].

    Neighbours that deviate alike count for less: the variance is multiplied by (1 + r) / (1 - r), r being
    their correlation (Bartlett, J. Roy. Stat. Soc. B 8 (1946), 27).
    """
    alike = float(np.clip(np.mean(left[1:] * left[:-1]) / np.mean(left**2), 0.0, 0.99))
    own = max(float(np.mean(left**2) - np.mean(timing**2)), LEAST_NOISE**2)
    return float(np.sqrt(own * (1.0 + alike) / (1.0 - alike)))


def _gain(linear: _Linear, cooling: float, lag: float, noise: float, generator) -> float:
    """A draw of the gain given cooling and lag, positive."""
    best, factor, _ = linear.posterior(cooling, lag, noise)
    for _ in range(100):
        drawn = best + np.linalg.solve(factor.T, generator.standard_normal(best.size))
        gain = linear.mean[0] + linear.sd[0] * drawn[0]
        if gain > 0.0:
            return float(gain)
    return float(PRIOR["gain"][0])
