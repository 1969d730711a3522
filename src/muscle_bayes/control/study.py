"""Robustness of gains: every scenario for every draw, summed up with intervals."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Final

import numpy as np
import pandas as pd

from muscle_bayes.control.batch import SHOWN_EVERY, Bank, Outcome, run
from muscle_bayes.control.cost import Cost
from muscle_bayes.control.criteria import cvar
from muscle_bayes.control.gains import Gains
from muscle_bayes.control.laws.build import build_law
from muscle_bayes.control.scenario import Scenario
from muscle_bayes.control.scenarios import LONG, setpoint_sine
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.markup import html_table

INTERVAL: Final = (0.05, 0.5, 0.95)
SHARES: Final = ("unstable", "unsafe")
"""Metrics whose mean is a probability."""
UNITS: Final = {
    "rise_time": "s",
    "overshoot": "1",
    "settling_time": "s",
    "steady_error": "rad",
    "drift": "rad/cycle",
    "tracking_error": "rad",
    "disturbance": "rad",
    "ripple": "rad",
    "energy": "s at full power",
    "peak_temperature": "C",
    "limit_share": "1",
    "cost": "1",
}
SWEEP: Final = tuple(float(f) for f in np.geomspace(0.008, 0.6, 10))
"""Frequencies of the setpoint at which runaway is looked for [Hz]."""
SWEPT_DRAWS: Final = 200
"""Most draws of which that is asked."""

Report = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Robustness:
    """What gains do over the draws."""

    gains: Gains
    scenarios: tuple[Scenario, ...]
    outcomes: dict[str, Outcome]
    draws: int
    notes: tuple[str, ...] = ()
    """What was assumed."""

    def _columns(self, name: str) -> dict[str, np.ndarray]:
        outcome = self.outcomes[name]
        return {**outcome.metrics._asdict(), "cost": outcome.cost}

    def summary(self) -> dict[str, dict[str, Any]]:
        """Of every scenario and metric: median, 5 and 95 % quantile, unit, and the share of draws that
        have it at all; probabilities of instability and of leaving the safe temperature; CVaR."""
        found: dict[str, dict[str, Any]] = {}
        for scenario in self.scenarios:
            rows: dict[str, Any] = {}
            for metric, values in self._columns(scenario.name).items():
                finite = np.isfinite(values)
                if metric in SHARES:
                    rows[metric] = {"probability": float(np.mean(values))}
                elif finite.any():
                    low, middle, high = np.quantile(values[finite], INTERVAL)
                    rows[metric] = {
                        "median": float(middle),
                        "q05": float(low),
                        "q95": float(high),
                        "unit": UNITS[metric],
                        "share": float(finite.mean()),
                    }
            rows["cost"]["cvar95"] = cvar(self.outcomes[scenario.name].cost, 0.95)
            found[scenario.name] = rows
        return found

    def table(self) -> pd.DataFrame:
        """One row a scenario and metric."""
        rows = [
            {"scenario": scenario, "metric": metric, **values}
            for scenario, metrics in self.summary().items()
            for metric, values in metrics.items()
        ]
        return pd.DataFrame(rows).set_index(["scenario", "metric"])

    def time(self, name: str) -> np.ndarray:
        """Times of the kept samples of a scenario [s]."""
        samples = self.outcomes[name].angle.shape[1]
        return np.arange(samples) * SHOWN_EVERY * self.gains.period

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "gains": self.gains.model_dump(exclude_none=True),
            "draws": self.draws,
            "notes": list(self.notes),
            "scenarios": self.summary(),
        }

    def _repr_html_(self) -> str:
        told = "".join(f"<br>{escape(note)}" for note in self.notes)
        header = ("scenario", "cost", "95 % CVaR", "RMS error [deg]", "peak [°C]", *SHARES)
        rows = [_row(name, metrics) for name, metrics in self.summary().items()]
        return (
            f"<p><b>Robustness</b> of {self.gains.law} over {self.draws} simulated draws: medians, "
            f"90 % intervals, probabilities{told}</p>{html_table(header, rows)}"
        )


def _row(name: str, metrics: dict[str, Any]) -> tuple[str, ...]:
    """A scenario's line in a notebook; a dash where no draw has the metric."""
    cost, error = metrics["cost"], metrics.get("tracking_error")
    peak = metrics.get("peak_temperature")
    return (
        name,
        f"{cost['median']:.3f}" if "median" in cost else "-",
        f"{cost['cvar95']:.3f}",
        "-" if error is None else _range({k: np.degrees(error[k]) for k in ("q05", "q95")}, ".2f"),
        "-" if peak is None else _range(peak, ".0f"),
        *(f"{metrics[share]['probability']:.0%}" for share in SHARES),
    )


def _range(metric: Mapping[str, Any], form: str) -> str:
    return f"{metric['q05']:{form}} to {metric['q95']:{form}}"


@double_precision
def robustness(
    bank: Bank,
    gains: Gains,
    scenarios: Sequence[Scenario],
    *,
    cost: Cost | None = None,
    notes: Sequence[str] = (),
    report: Report = lambda stage, done, total: None,
) -> Robustness:
    """The gains' law on every draw of the bank in every scenario."""
    law = build_law(gains, bank.draws.design)
    outcomes = {}
    for number, scenario in enumerate(scenarios):
        outcomes[scenario.name] = run(bank, law, scenario, cost)
        report("simulating", number + 1, len(scenarios))
    return Robustness(gains, tuple(scenarios), outcomes, len(bank.draws), tuple(notes))


@dataclass(frozen=True)
class RunawayCurve:
    """Probabilities against the setpoint's frequency."""

    frequency: np.ndarray
    """Hz"""
    unstable: np.ndarray
    """Probability that the loop adds error to what staying at zero leaves."""
    unsafe: np.ndarray
    """Probability that a muscle leaves the safe temperature."""
    error: np.ndarray
    """(frequency, 3): 5, 50 and 95 % quantile of RMS error over RMS setpoint."""

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {key: getattr(self, key).tolist() for key in self.__dataclass_fields__}

    def _repr_html_(self) -> str:
        rows = [
            (
                f"{f:.3g}",
                f"{error[1]:.2f} ({error[0]:.2f} to {error[2]:.2f})",
                f"{u:.0%}",
                f"{h:.0%}",
            )
            for f, error, u, h in zip(
                self.frequency, self.error, self.unstable, self.unsafe, strict=True
            )
        ]
        header = ("frequency [Hz]", "RMS error / RMS setpoint, 90 %", *SHARES)
        return f"<p><b>Runaway</b></p>{html_table(header, rows)}"


@double_precision
def runaway_curve(bank: Bank, gains: Gains, frequencies: Sequence[float] = SWEEP) -> RunawayCurve:
    """How setpoint sines of rising frequency are followed, each for LONG, by SWEPT_DRAWS at most."""
    law = build_law(gains, bank.draws.design)
    bank = Bank(bank.draws.take(slice(0, SWEPT_DRAWS)), bank.clock, bank.seed)
    rows = []
    for f in frequencies:
        course = setpoint_sine(gains.period, f, LONG)
        found = run(bank, law, Scenario(f"{f:g} Hz", "", course)).metrics
        asked = np.sqrt(np.mean(course.setpoint[int(course.judged_from) :] ** 2))
        relative = np.quantile(found.tracking_error / asked, INTERVAL)
        rows.append((found.unstable.mean(), found.unsafe.mean(), relative))
    unstable, unsafe, error = zip(*rows, strict=True)
    return RunawayCurve(
        np.array(frequencies), np.array(unstable), np.array(unsafe), np.array(error)
    )
