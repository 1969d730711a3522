"""Gains that meet the specifications with the highest probability over the draws."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from scipy.stats import qmc

from muscle_bayes.control.batch import Bank, run
from muscle_bayes.control.judging.specification import Specification, cvar
from muscle_bayes.control.laws.gains import Gains, law_of
from muscle_bayes.control.laws.templates import Template
from muscle_bayes.control.scenarios.scenario import Scenario
from muscle_bayes.progress import Report, silent


@dataclass(frozen=True)
class Effort:
    """How hard to look."""

    starts: int = 64
    """Sobol points of the global search, a power of two."""
    scouts: int = 24
    """Draws on which these are tried."""
    kept: int = 12
    """Best of them that are tried on all draws."""
    rounds: int = 3
    """Rounds of looking about the best, each half as wide."""
    tried: int = 24
    """Gains that are tried in a round."""


@dataclass(frozen=True)
class Tuning:
    """Gains found, and how."""

    gains: Gains
    probability: float
    """Share of the draws tuned on that meet every specification."""
    excess: float
    """95 % CVaR over them of the mean excess."""
    edges: tuple[str, ...]
    """Gains at an edge of the box."""

    def _repr_html_(self) -> str:
        told = f"meets all with probability {self.probability:.2f}, excess {self.excess:.3g}"
        edge = f"; at the edge of the search: {', '.join(self.edges)}" if self.edges else ""
        return f"<p><b>Tuning</b>: {escape(told + edge)}</p>{self.gains._repr_html_()}"


def _scores(
    bank: Bank,
    several: Sequence[Gains],
    scenarios: Sequence[Scenario],
    specs: Mapping[str, Specification],
) -> np.ndarray:
    """(gains, 4): share of draws that meet all, mean share over the scenarios, CVaR of the mean excess,
    and share of runaways."""
    law = law_of(several, bank.draws.design)
    found = [(specs[one.name], run(bank, law, one).metrics) for one in scenarios]
    worst = np.stack([spec.worst(metrics) for spec, metrics in found], axis=1)
    lost = np.mean([metrics.runaway for _, metrics in found], axis=(0, 2))
    met, missed = worst <= 0.0, np.maximum(worst, 0.0).mean(1)
    rows = [(m.all(0).mean(), m.mean(), cvar(e)) for m, e in zip(met, missed, strict=True)]
    return np.column_stack([rows, lost])


def _order(scores: np.ndarray) -> np.ndarray:
    """Best first: by fewest runaways, by the probability of all and of each, by the excess of misses."""
    return np.lexsort((scores[:, 2], -(scores[:, 0] + scores[:, 1]), scores[:, 3]))


def tune(
    bank: Bank,
    scenarios: Sequence[Scenario],
    specs: Mapping[str, Specification],
    template: Template,
    *,
    known: Sequence[Gains] = (),
    effort: Effort | None = None,
    seed: int = 0,
    report: Report = silent,
) -> Tuning:
    """Gains of a law that meet the specifications with the highest probability.

    That is the probability of meeting all scenarios' plus the mean of that of meeting each, so that a
    scenario which no joint masters does not hide the others; the CVaR of the excess decides ties. Gains
    under which fewer responses run away come first, whatever else they do.

    Scrambled Sobol points are tried on a few draws, the best of them on all beside the `known` gains of a
    simpler law, and then points scattered about the best, ever closer. The same draws and noise serve all
    gains.
    """
    effort, generator = effort or Effort(), np.random.default_rng(seed)
    name, stages = template.gains.law, effort.rounds + 2
    places = qmc.Sobol(len(template.box), rng=generator).random(effort.starts)
    scouts = Bank(bank.draws.take(slice(0, effort.scouts)), bank.clock, bank.seed)
    tried = _scores(scouts, [template.at(x) for x in places], scenarios, specs)
    places = places[_order(tried)[: effort.kept]]
    places = np.concatenate([places, *(template.place(one)[None] for one in known)])
    report(name, 1, stages)
    scores = _scores(bank, [template.at(x) for x in places], scenarios, specs)
    report(name, 2, stages)
    width = 0.15
    for number in range(effort.rounds):
        parents = places[_order(scores)[:3]]
        chosen = parents[generator.integers(len(parents), size=effort.tried)]
        near = np.clip(chosen + width * generator.standard_normal(chosen.shape), 0.0, 1.0)
        places = np.concatenate([places, near])
        more = _scores(bank, [template.at(x) for x in near], scenarios, specs)
        scores, width = np.concatenate([scores, more]), 0.5 * width
        report(name, number + 3, stages)
    best = _order(scores)[0]
    edges = tuple(template.edges(places[best]))
    every, _, excess, _ = map(float, scores[best])
    return Tuning(template.at(places[best]), every, excess, edges)
