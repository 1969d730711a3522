"""What discovery found."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from html import escape
from typing import Any

import numpy as np

from muscle_bayes.criticism.coverage import RunCheck
from muscle_bayes.discovery.candidates import Visibility
from muscle_bayes.discovery.gate import Gate
from muscle_bayes.discovery.locate import Located, MisfitMap
from muscle_bayes.discovery.weigh import Naming
from muscle_bayes.inference.posteriors.predict import Prediction
from muscle_bayes.json_file import plain
from muscle_bayes.markup import html_table


@dataclass(frozen=True)
class Judged:
    """A model's predictions of every run, and how good they are."""

    effects: tuple[str, ...]
    predictions: Mapping[str, Prediction]
    checks: Mapping[str, RunCheck]
    misfit: MisfitMap
    """Of the runs that were fitted."""


@dataclass(frozen=True)
class Estimate:
    """A parameter of an effect: median, and the bounds of its central 90 %."""

    median: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Curve:
    """What a function that nobody has named adds to its port: median and central 90 %, pointwise.

    On the damper port the value is multiplied by exp of it.
    """

    signal: np.ndarray
    """What it depends on, over the range that runs have seen."""
    median: np.ndarray
    low: np.ndarray
    high: np.ndarray
    unit: str


@dataclass(frozen=True)
class Step:
    """One effect added."""

    added: str
    """Name of the effect; `unknown` for a function that nobody has named."""
    effect: str
    """The same as `fit --effect` takes it."""
    port: str
    signals: tuple[str, ...]
    """What an unknown function depends on; empty for named effects."""
    probability: float
    tie: tuple[str, ...]
    """Effects that explain the same as well, likeliest first."""
    parameters: Mapping[str, Estimate]
    curve: Curve | None
    """Of a function that nobody has named."""
    gate: Gate
    before: Judged
    after: Judged
    weakened: tuple[str, ...]
    """Parameters that the effect leaves undetermined."""
    share: float | None = None
    """Of the squared misfit that any model closes on unseen readings, what adding the effect closed."""

    def closed(self, run: str, floor: float) -> float | None:
        """Share of a run's squared misfit above the noise floor that adding the effect removed.

        None where chance alone leaves as much: two standard errors of a mean of n squares,
        floor^2 2 sqrt(2 / n).
        """
        before, after = (j.checks[run] for j in (self.before, self.after))
        gap = before.rmse**2 - floor**2
        if gap < 2.0 * np.sqrt(2.0 / before.pit.size) * floor**2:
            return None
        return (before.rmse**2 - after.rmse**2) / gap


@dataclass(frozen=True)
class NextExperiment:
    """What to record, and what it should tell."""

    plan: str
    separates: tuple[str, ...]
    information: float
    """Expected log odds between the two likeliest [nat]."""
    sequence: str = ""
    """TOML for the logger; empty where the bench cannot do it alone."""

    def __str__(self) -> str:
        return (
            f"To tell {' from '.join(self.separates)}: {self.plan}; "
            f"expected log odds {self.information:.1f} nat."
        )

    def _repr_html_(self) -> str:
        shown = f"<details><summary>sequence</summary><pre>{escape(self.sequence)}</pre></details>"
        told = f"<p><b>Next experiment</b>: {escape(str(self))}</p>"
        return told + (shown if self.sequence else "")


@dataclass(frozen=True, repr=False)
class Discovery:
    """The result of a search for missing effects."""

    verdict: str | tuple[str, ...]
    probabilities: Mapping[str, float]
    """Of the first step: every effect, none and unknown."""
    naming: Naming
    """The first step's comparison of named effects."""
    visible: Visibility | None
    """What these runs could show at all; None where the search ended before."""
    located: MisfitMap
    """Of the model that was started from."""
    nominal: Judged
    steps: tuple[Step, ...]
    held_out: tuple[str, ...]
    floor: Mapping[str, float]
    """RMS of noise alone in each run's mean readings [the log's unit]."""
    next_experiment: NextExperiment | None
    stopped_because: str
    checks: tuple[str, ...]
    """Of Laplace's approximation against sampled posteriors, and what these say."""
    not_searched: tuple[str, ...]
    """What an interrupt or the budget left out."""
    remainder: "Step | None"
    """A function that describes what named effects leave, where they close nearly all of the gap."""
    smallest: float
    """Misfit that counts, in steps of the sensor."""
    seed: int

    @property
    def ties(self) -> tuple[tuple[str, ...], ...]:
        """Effects that the data cannot tell apart, step by step."""
        return tuple(step.tie for step in self.steps if step.tie)

    @property
    def effects(self) -> tuple[str, ...]:
        """Of the revised model, as `fit --effect` takes them."""
        return self.final.effects

    @property
    def final(self) -> Judged:
        return self.steps[-1].after if self.steps else self.nominal

    def as_dict(self) -> dict[str, Any]:
        """DISCOVERY.json."""
        following, held = self.next_experiment, self.held_out
        found = {
            "verdict": self.verdict,
            "probabilities": self.probabilities,
            "ties": self.ties,
            "located": [_window(one) for one in self.located.windows],
            "misfit_p_value": self.located.p_value,
            "steps": [_step(step, held, self.floor) for step in self.steps],
            "noise_floor": self.floor,
            "left": [_window(one) for one in self.final.misfit.windows],
            "next_experiment": None if following is None else asdict(following),
            "stopped_because": self.stopped_because,
            "visible": None if self.visible is None else asdict(self.visible),
            "checks": self.checks,
            "not_searched": self.not_searched,
            "remainder": self.remainder and _step(self.remainder, held, self.floor),
            "smallest_misfit_steps": self.smallest,
            "held_out": held,
            "seed": self.seed,
        }
        return plain(found)

    def __repr__(self) -> str:
        return f"Discovery({_verdict(self.verdict)}; {self.stopped_because})"

    def _repr_html_(self) -> str:
        order = sorted(self.probabilities.items(), key=lambda item: -item[1])[:6]
        table = html_table(("missing", "probability"), [(name, f"{p:.1%}") for name, p in order])
        told = f"{_verdict(self.verdict)}. {self.stopped_because}"
        following = "" if self.next_experiment is None else self.next_experiment._repr_html_()
        return f"<p><b>Discovery</b>: {escape(told)}</p>{table}{following}"


def _verdict(verdict: str | tuple[str, ...]) -> str:
    return verdict if isinstance(verdict, str) else " + ".join(verdict)


def _window(one: Located) -> dict[str, Any]:
    keys = {"start": "start_s", "end": "end_s", "steps": "sensor_steps"}
    return {keys.get(key, key): value for key, value in asdict(one).items()}


def _shown(judged: Judged, runs: list[str]) -> dict[str, Any]:
    keys = ("rmse", "unit", "coverage90", "pit_distance")
    return {run: {key: getattr(judged.checks[run], key) for key in keys} for run in runs}


def _step(step: Step, held: tuple[str, ...], floor: Mapping[str, float]) -> dict[str, Any]:
    fitted = [run for run in step.after.checks if run not in held]
    kept = [run for run in step.after.checks if run in held]
    return {
        "added": step.added,
        "effect": step.effect,
        "port": step.port,
        "signals": step.signals,
        "probability": step.probability,
        "tie": step.tie,
        "parameters": {name: asdict(one) for name, one in step.parameters.items()},
        "curve": None if step.curve is None else asdict(step.curve),
        "before": _shown(step.before, fitted),
        "after": _shown(step.after, fitted),
        "held_out": {"before": _shown(step.before, kept), "after": _shown(step.after, kept)},
        "gate": {**asdict(step.gate), "passed": step.gate.passed},
        "closed": {run: step.closed(run, floor[run]) for run in step.after.checks},
        "undetermined": step.weakened,
        "share": step.share,
    }
