"""Laws side by side on joints that were not tuned on: metrics, probabilities and a recommendation."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from html import escape
from typing import Any, Final, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from muscle_bayes.control.batch import Bank, Outcome, run
from muscle_bayes.control.judging.specification import Specification, cvar
from muscle_bayes.control.laws.gains import Gains, fits_the_board, law_of
from muscle_bayes.control.scenarios.scenario import Scenario
from muscle_bayes.json_file import plain
from muscle_bayes.markup import html_table
from muscle_bayes.progress import Report, silent

UNITS: Final = {
    "rise_time": "s",
    "settling_time": "s",
    "overshoot": "rad",
    "steady_error": "rad",
    "recovery_time": "s",
    "tracking": "1",
    "peak_temperature": "C",
    "energy": "s at full power",
}
RESAMPLES: Final = 400
"""Of the draws, for the Monte Carlo error of a difference."""
RELIABLE: Final = 0.9
"""Share of joints that meet a scenario's limits below which the recommendation names the scenario."""
TIED: Final = 2.0
"""Standard errors within which two numbers are tied."""


def standard_error(share: float, count: int) -> float:
    """Monte Carlo error of a probability, by Agresti and Coull's estimate: not 0 at 0 and 1."""
    near = (share * count + 2.0) / (count + 4.0)
    return float(np.sqrt(near * (1.0 - near) / (count + 4.0)))


@dataclass(frozen=True)
class Judgement:
    """What gains of several laws do over the same draws, with the same noise."""

    gains: Mapping[str, Gains]
    scenarios: tuple[Scenario, ...]
    specs: Mapping[str, Specification]
    outcomes: Mapping[str, Mapping[str, Outcome]]
    """By law and scenario."""
    draws: int
    notes: tuple[str, ...] = ()
    """What was assumed."""
    possible: Mapping[str, Bool[np.ndarray, " draw"]] = field(default_factory=dict)
    """By scenario: whether any input keeps the limits, on the first draws; only where that is not sure."""

    def meets(self, law: str, scenario: str | None = None) -> Bool[np.ndarray, " draw"]:
        """Whether each draw keeps the limits of a scenario, or of all."""
        chosen = [one.name for one in self.scenarios] if scenario is None else [scenario]
        rows = [self.specs[name].met(self.outcomes[law][name].metrics) for name in chosen]
        return np.all(rows, axis=0)

    def probability(self, law: str, scenario: str | None = None) -> tuple[float, float]:
        """Probability of keeping the limits of a scenario, or of all, and its Monte Carlo error."""
        share = float(self.meets(law, scenario).mean())
        return share, standard_error(share, self.draws)

    def where_possible(self, law: str, scenario: str) -> tuple[float, float, int]:
        """Probability of keeping a scenario's limits on joints on which some input keeps them.

        Its Monte Carlo error, and the number of joints. KeyError where `possible` lacks the scenario.
        """
        chosen = self.possible[scenario]
        kept = self.meets(law, scenario)[: chosen.size][chosen]
        share = float(kept.mean()) if kept.size else 0.0
        return share, standard_error(share, kept.size), kept.size

    def excess(self, law: str, scenario: str) -> Float[np.ndarray, " draw"]:
        """By how much each draw misses the scenario's worst limit, relative to it."""
        return np.maximum(self.specs[scenario].worst(self.outcomes[law][scenario].metrics), 0.0)

    def difference(self, law: str, other: str, scenario: str, seed: int = 0) -> tuple[float, float]:
        """CVaR of a law's excess less that of another, and its Monte Carlo error (paired bootstrap)."""
        first, second = self.excess(law, scenario), self.excess(other, scenario)
        rows = np.random.default_rng(seed).integers(self.draws, size=(RESAMPLES, self.draws))
        apart = [cvar(first[row]) - cvar(second[row]) for row in rows]
        return cvar(first) - cvar(second), float(np.std(apart))

    def compared(self, law: str, other: str) -> dict[str, str]:
        """Of every scenario whether the law's CVaR is `lower`, `tied` or `higher`."""
        found = {}
        for one in self.scenarios:
            apart, error = self.difference(law, other, one.name)
            tied = abs(apart) <= TIED * error or apart == 0.0
            found[one.name] = "tied" if tied else "lower" if apart < 0.0 else "higher"
        return found

    def runaways(self, law: str) -> int:
        """Runaways of all draws and scenarios."""
        return int(sum(one.metrics.runaway.sum() for one in self.outcomes[law].values()))

    @property
    def recommended(self) -> str:
        """The law with the highest probability of meeting all, plus the mean of that of each scenario."""

        def score(law: str) -> float:
            each = [self.probability(law, one.name)[0] for one in self.scenarios]
            return self.probability(law)[0] + float(np.mean(each))

        return max(self.gains, key=score)

    def sentence(self) -> str:
        """The recommendation, and where it loses."""
        law = self.recommended
        share, error = self.probability(law)
        lost = []
        for other in self.gains:
            if other == law:
                continue
            higher = [k for k, v in self.compared(law, other).items() if v == "higher"]
            if higher:
                lost.append(f"It loses to {other} in {', '.join(higher)}.")
        worse = " ".join(lost) or "No other law beats it in any scenario."
        chances = {one.name: self.probability(law, one.name)[0] for one in self.scenarios}
        weak = [name for name, chance in chances.items() if chance < RELIABLE]
        told = "".join(
            f" Weak spot: {name} {chances[name]:.0%}{self._of_possible(law, name)}."
            for name in weak
        )
        others = [chance for name, chance in chances.items() if name not in weak]
        least = f" Every other scenario: at least {min(others):.0%}." if weak and others else ""
        return (
            f"Use {law}: {share:.0%} (±{error:.1%}) of new joints meet every specification. "
            f"Its gains are {self.gains[law].sentence()}.{told}{least} "
            f"{worse}"
        )

    def _of_possible(self, law: str, scenario: str) -> str:
        if scenario not in self.possible:
            return ""
        share, error, count = self.where_possible(law, scenario)
        return f" ({share:.0%} ±{error:.1%} of the {count} joints on which some input can)"

    def metrics(self, law: str, scenario: str) -> dict[str, dict[str, Any]]:
        """Of every metric that the scenario has: median, 90 % interval, and share that reaches it."""
        rows = {}
        for name, value in self.outcomes[law][scenario].metrics._asdict().items():
            if name not in UNITS or np.isnan(value).all():
                continue
            low, middle, high = np.quantile(value, (0.05, 0.5, 0.95), method="nearest")
            row = {"median": middle, "q05": low, "q95": high, "share": np.isfinite(value).mean()}
            rows[name] = {key: float(one) for key, one in row.items()} | {"unit": UNITS[name]}
        return rows

    def as_dict(self) -> dict[str, Any]:
        """For JSON; infinite times become null."""
        laws = {
            law: {
                "gains": gains.model_dump(exclude_none=True),
                "probability": self.probability(law)[0],
                "error": self.probability(law)[1],
                "runaways": self.runaways(law),
                "scenarios": {
                    one.name: {
                        "probability": self.probability(law, one.name)[0],
                        "cvar": cvar(self.excess(law, one.name)),
                        "metrics": self.metrics(law, one.name),
                        "where_possible": self.where_possible(law, one.name)[0]
                        if one.name in self.possible
                        else None,
                    }
                    for one in self.scenarios
                },
            }
            for law, gains in self.gains.items()
        }
        return plain(
            {
                "recommended": self.recommended,
                "sentence": self.sentence(),
                "draws": self.draws,
                "notes": self.notes,
                "specifications": {name: asdict(one) for name, one in self.specs.items()},
                "laws": laws,
            }
        )

    def _repr_html_(self) -> str:
        notes = "".join(f"<br>{escape(note)}" for note in self.notes)
        rows = [
            (name or "all", *(f"{self.probability(law, name)[0]:.3f}" for law in self.gains))
            for name in (*(one.name for one in self.scenarios), None)
        ]
        table = html_table(("scenario", *self.gains), rows)
        return f"<p><b>Laws on {self.draws} new joints</b>: {escape(self.sentence())}{notes}</p>{table}"


def judge(
    bank: Bank,
    gains: Mapping[str, Gains],
    scenarios: Sequence[Scenario],
    specs: Mapping[str, Specification],
    *,
    notes: Sequence[str] = (),
    possible: Mapping[str, Bool[np.ndarray, " draw"]] | None = None,
    report: Report = silent,
) -> Judgement:
    """Every law on every draw of the bank in every scenario."""
    outcomes: dict[str, dict[str, Outcome]] = {}
    total = len(gains) * len(scenarios)
    for law, one in gains.items():
        outcomes[law] = {}
        for scenario in scenarios:
            outcomes[law][scenario.name] = run(bank, law_of(one, bank.draws.design), scenario)
            done = sum(map(len, outcomes.values()))
            report("judging", done, total)
    return Judgement(
        dict(gains),
        tuple(scenarios),
        specs,
        outcomes,
        len(bank),
        tuple(notes),
        dict(possible or {}),
    )


class TradeOff(NamedTuple):
    """What becomes of speed and heat as all gains of a law are multiplied alike."""

    factor: Float[np.ndarray, " gain"]
    speed: Float[np.ndarray, "gain 3"]
    """5, 50 and 95 % quantile of the step's settling time [s]."""
    hot: Float[np.ndarray, " gain"]
    """Probability that a muscle exceeds the limit in any scenario."""


def trade_off(
    bank: Bank, gains: Gains, scenarios: Sequence[Scenario], limit: float, factors: Sequence[float]
) -> TradeOff:
    """Speed in the first scenario, and probability of more than `limit` [C] in any, against gains."""
    own = {"proportional": gains.proportional, "integral": gains.integral}
    scaled = {f: gains.model_copy(update={k: f * x for k, x in own.items()}) for f in factors}
    several = {f: one for f, one in scaled.items() if fits_the_board(one, bank.draws.design)}
    law = law_of(list(several.values()), bank.draws.design)
    found = [run(bank, law, one).metrics for one in scenarios]
    hot = np.any([one.peak_temperature > limit for one in found], axis=0).mean(1)
    speed = np.quantile(found[0].settling_time, (0.05, 0.5, 0.95), axis=1, method="nearest").T
    return TradeOff(np.array(list(several)), speed, hot)
