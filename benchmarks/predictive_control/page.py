"""docs/predictive-control.md: what is left on the table, from the numbers alone."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float

from muscle_bayes.control.judging.judge import TIED, standard_error
from muscle_bayes.control.judging.metrics import Metrics
from muscle_bayes.control.judging.specification import Specification

PREDICTIVE: Final = "predictive"
BEST: Final = "best input"


@dataclass(frozen=True)
class Comparison:
    """Metrics by column and scenario, a row a joint; the same joints in all."""

    columns: Mapping[str, Mapping[str, Metrics]]
    best: Mapping[str, Metrics]
    """Of the best input, which knows joint and future."""
    specs: Mapping[str, Specification]
    law: str
    """The recommended one."""
    joints: int
    notes: tuple[str, ...]
    seconds: Float[np.ndarray, " plan"]
    """What each plan took."""

    def meets(self, column: str, scenario: str | None = None) -> Bool[np.ndarray, " joint"]:
        """Whether each joint keeps the limits of a scenario, or of all."""
        names = list(self.specs) if scenario is None else [scenario]
        if column == BEST:
            rows = [self._met_by_some(name) for name in names]
        else:
            rows = [self.specs[name].met(self.columns[column][name]) for name in names]
        return np.all(rows, axis=0)

    def _met_by_some(self, scenario: str) -> Bool[np.ndarray, " joint"]:
        """By the best input, or where its search ended in a worse optimum, by a controller."""
        rows = [self.specs[scenario].met(own[scenario]) for own in self.columns.values()]
        return np.any([*rows, self.specs[scenario].met_by_best(self.best[scenario])], axis=0)

    def gap(self, other: str, scenario: str | None = None) -> tuple[float, float]:
        """Probability under predictive control less that under another, and its Monte Carlo error."""
        own, rival = self.meets(PREDICTIVE, scenario), self.meets(other, scenario)
        apart = own.astype(float) - rival.astype(float)
        return float(apart.mean()), float(apart.std() / np.sqrt(self.joints))

    def verdict(self, other: str, scenario: str | None = None) -> str:
        """`higher`, `tied` or `lower`: predictive control's probability against the other's."""
        gap, error = self.gap(other, scenario)
        if gap == 0.0 or abs(gap) <= TIED * error:
            return "tied"
        return "higher" if gap > 0.0 else "lower"


def page(found: Comparison, command: str) -> str:
    """The page, in Markdown."""
    every = [*found.columns, BEST]
    shares = {name: float(found.meets(name).mean()) for name in every}
    told = ", ".join(
        f"{name} {share:.0%} (±{standard_error(share, found.joints):.1%})"
        for name, share in shares.items()
    )
    parts = [
        "# Predictive control as a yardstick: results (simulated)\n",
        "Terms: [glossary](glossary.md). Laws and limits: [laws on new joints](control-results.md).\n",
        f"Written by `{command}`; do not edit. The first {found.joints} of the new joints, on which no "
        "law was tuned. Numbers in brackets are Monte Carlo errors or 90 % of the joints.\n",
        f"**Every specification is met by: {told}.**\n",
        _against(found, found.law),
        _left(found),
        "\n## What is compared\n",
        *_explained(found),
        *(f"- {note}" for note in found.notes),
        "\n## Probability of meeting it\n",
        _probabilities(found, every),
        "\n## How well\n",
        "Jumps: settling or recovery, whichever is later. Others: RMS error over RMS setpoint.\n",
        _metrics(found, every),
    ]
    return "\n".join(parts) + "\n"


def _against(found: Comparison, other: str) -> str:
    """Where predictive control is better, and where it is not, in sentences."""
    verdicts = {name: found.verdict(other, name) for name in found.specs}
    lines = []
    for what, word in (("higher", "better"), ("lower", "worse"), ("tied", "not better")):
        names = [name for name, verdict in verdicts.items() if verdict == what]
        if names:
            where = "in every scenario" if len(names) == len(verdicts) else f"in {', '.join(names)}"
            lines.append(f"Predictive control is {word} than {other} {where}.")
    gap, error = found.gap(other)
    lines.append(f"Over all specifications the difference is {gap:+.0%} (±{error:.1%}).")
    own, rival = found.meets(PREDICTIVE), found.meets(other)
    lines.append(
        f"It meets all on {int((own & ~rival).sum())} joints on which {other} does not; "
        f"the reverse holds on {int((rival & ~own).sum())}."
    )
    return " ".join(lines) + "\n"


def _left(found: Comparison) -> str:
    best, law = (float(found.meets(name).mean()) for name in (BEST, found.law))
    return (
        f"Left on the table by {found.law}, against an input that knows joint and future: "
        f"{best - law:.0%} of the joints."
    )


def _explained(found: Comparison) -> list[str]:
    milliseconds = 1e3 * np.quantile(found.seconds, (0.5, 0.99))
    return [
        "- `predictive`: every 0.51 s it plans 26.5 s ahead with the median joint of those tuned on. The "
        "plan minimises the squared error, with duties within 0 to 255.",
        "- It keeps temperatures below 98.5 C, three seconds in advance. It sees what a law sees: angle, "
        "thermocouples, setpoint of now.",
        "- Kalman filters find the heating that the model lacks. A torque makes up for the rest of the "
        "model's error, once friction no longer explains it.",
        "- `best input`: duties that know the joint and the future, by a local search. Where a controller "
        "does what they do not, its share counts for theirs.",
        f"- A plan takes {milliseconds[0]:.1f} ms, 99 % take at most {milliseconds[1]:.1f} ms. That "
        "delay is not simulated.",
    ]


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _probabilities(found: Comparison, every: Sequence[str]) -> str:
    rows = []
    for name in [*found.specs, None]:
        shares = [float(found.meets(column, name).mean()) for column in every]
        cells = [f"{share:.3f} ({standard_error(share, found.joints):.3f})" for share in shares]
        gap, error = found.gap(found.law, name)
        told = f"{gap:+.3f} ({error:.3f}), {found.verdict(found.law, name)}"
        rows.append((name or "**all**", *cells, told))
    return _table(("scenario", *every, f"predictive less {found.law}"), rows)


def _metrics(found: Comparison, every: Sequence[str]) -> str:
    rows = []
    for name, spec in found.specs.items():
        jumps = "settling_time" in spec.limits
        cells = []
        for column in every:
            metrics = found.best[name] if column == BEST else found.columns[column][name]
            value = np.asarray(metrics.tracking)
            if jumps:
                value = np.fmax(np.asarray(metrics.settling_time), metrics.recovery_time)
            low, middle, high = np.quantile(value, (0.05, 0.5, 0.95), method="nearest")
            cells.append(f"{_value(middle)} ({_value(low)} to {_value(high)})")
        rows.append((f"{name} [s]" if jumps else name, *cells))
    return _table(("scenario", *every), rows)


def _value(number: float) -> str:
    return f"{number:.3g}" if np.isfinite(number) else "never"
