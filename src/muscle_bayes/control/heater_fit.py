"""Gain, cooling rate and lag of the heater tubes, with uncertainty, from the runs' own temperatures."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from muscle_bayes.bench.temperature_control import HeaterLaw
from muscle_bayes.control.certain_duty import Stretch, stretches
from muscle_bayes.data.run import Run
from muscle_bayes.errors import MuscleBayesError

PRIOR: Final = {"gain": (4.0, 0.7), "cooling": (1 / 50, 1.0), "lag": (1.0, 1.0)}
"""Median and standard deviation of the logarithm: a glass tube the size of a pencil, wound with a
heating wire, reaches 90 C in tens of seconds and cools in a minute. K/s, 1/s, s."""
ASSUMED_SPREAD: Final = 0.2
"""Standard deviation of the logarithm where no runs tell: the same medians, taken for known to 20 %."""
CELLS: Final = 21
ZOOMS: Final = 12
NEGLIGIBLE: Final = 1e-7
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
        return f"<p><b>Heater</b>, {self.source}</p>{self.summary()._repr_html_()}"  # type: ignore[operator]


def assumed_heater(seed: int = 0) -> HeaterPosterior:
    """Heaters as they are taken to be where no run is given."""
    generator = np.random.default_rng(seed)
    draws = {
        name: median * np.exp(ASSUMED_SPREAD * generator.standard_normal(DRAWS))
        for name, (median, _) in PRIOR.items()
    }
    return HeaterPosterior(draws, dict.fromkeys(PRIOR, False), "assumed, not measured")


class _Linear:
    """What is left when cooling and lag are held: linear in gain, room, and each stretch's start.

        T(t) = T_room + x_0 (e^{-ct} + c late(t)) + g u ((1 - e^{-ct}) / c - late(t)),
        late(t) = lag (e^{-ct} - e^{-t/lag}) / (1 - c lag)

    for a power that at t = 0 is what holds x_0, and is late by `lag` behind the duty u,
    with a Gaussian prior on each, so that their posterior and the evidence are exact.
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
            part[:, 0] = (1.0 - cools) / cooling - late if one.full else 0.0
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


def _log_prior(name: str, logarithm: np.ndarray) -> np.ndarray:
    median, spread = PRIOR[name]
    return -0.5 * ((logarithm - np.log(median)) / spread) ** 2


def _grid(linear: _Linear, noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axes of log cooling and log lag that hold all that matters, and the cells' probabilities."""
    low, high = np.log([1 / 500, 0.01]), np.log([1 / 4, 20.0])
    for _ in range(ZOOMS):
        axes = [np.linspace(a, b, CELLS) for a, b in zip(low, high, strict=True)]
        value = np.full((CELLS, CELLS), -np.inf)
        for i, c in enumerate(axes[0]):
            for j, lag in enumerate(axes[1]):
                # A lag as long as cooling would be told from it by nothing.
                if np.exp(c + lag) < 0.5:
                    value[i, j] = linear.posterior(np.exp(c), np.exp(lag), noise)[2]
        value += _log_prior("cooling", axes[0])[:, None] + _log_prior("lag", axes[1])[None]
        weight = np.exp(value - value.max())
        weight /= weight.sum()
        shrunk = False
        for axis in (0, 1):
            along = weight.sum(1 - axis)
            used = np.flatnonzero(along > NEGLIGIBLE)
            first, last = max(used[0] - 1, 0), min(used[-1] + 1, CELLS - 1)
            if last - first < CELLS // 2:
                shrunk = True
                low[axis], high[axis] = axes[axis][first], axes[axis][last]
        if not shrunk:
            break
    return axes[0], axes[1], weight


def fit_heater(
    runs: Sequence[Run], law: HeaterLaw | None = None, *, draws: int = DRAWS, seed: int = 0
) -> HeaterPosterior:
    """The heater's posterior from where the bench's law leaves no doubt about its duty.

    Cooling rate and lag lie on a grid that zooms in, everything else is integrated out exactly. The
    noise is that of the residuals, beside what not knowing the time of a reading makes. Without a stretch at full
    duty the gain is not told, and stays as `PRIOR` has it. Raises MuscleBayesError where no stretch
    is found at all.
    """
    found = [one for run in runs for one in stretches(run, law or HeaterLaw())]
    if not found:
        raise MuscleBayesError(
            "these runs never leave it certain that a heater is off, or on at full duty. Mend: give "
            "runs that cool from 90 C, and for the gain some that heat from room temperature to 90 C"
        )
    linear = _Linear(found)
    noise = 0.1
    for _ in range(2):  # a second time with the noise that the first left over
        cooling, lag, weight = _grid(linear, noise)
        i, j = np.unravel_index(weight.argmax(), weight.shape)
        left = linear.residual(np.exp(cooling[i]), np.exp(lag[j]), noise)
        noise = float(np.sqrt(max(np.mean(left**2) - np.mean(linear.timing**2), LEAST_NOISE**2)))
    generator = np.random.default_rng(seed)
    cells = generator.choice(weight.size, size=draws, p=weight.ravel())
    inside = generator.uniform(-0.5, 0.5, (2, draws))
    log_c = cooling[cells // CELLS] + inside[0] * (cooling[1] - cooling[0])
    log_lag = lag[cells % CELLS] + inside[1] * (lag[1] - lag[0])
    gain = np.array([_gain(linear, c, one, noise, generator) for c, one in zip(
        np.exp(log_c), np.exp(log_lag), strict=True)])
    told = any(one.full for one in found)
    if not told:
        median, spread = PRIOR["gain"]
        gain = median * np.exp(spread * generator.standard_normal(draws))
    values = {"gain": gain, "cooling": np.exp(log_c), "lag": np.exp(log_lag)}
    names = ", ".join(run.name for run in runs)
    return HeaterPosterior(values, {"gain": told, "cooling": True, "lag": True}, f"from {names}")


def _gain(linear: _Linear, cooling: float, lag: float, noise: float, generator) -> float:
    """A draw of the gain given cooling and lag, positive."""
    best, factor, _ = linear.posterior(cooling, lag, noise)
    for _ in range(100):
        drawn = best + np.linalg.solve(factor.T, generator.standard_normal(best.size))
        gain = linear.mean[0] + linear.sd[0] * drawn[0]
        if gain > 0.0:
            return float(gain)
    return float(PRIOR["gain"][0])
