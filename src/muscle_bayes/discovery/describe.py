"""Under which conditions a run misfits, in words."""

from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float

from muscle_bayes.discovery.conditions import SIGNALS, Trace

QUANTILES = np.linspace(0.1, 0.9, 9)
"""Thresholds that are tried, as quantiles of a signal over the run."""
HELD = 0.7
"""Share of the excess that a condition must hold."""
CONTRAST = 0.15
"""By how much that share must exceed the condition's share of the readings."""


def where(trace: Trace, excess: Float[np.ndarray, " interval"], inside: slice) -> str:
    """One condition or two that hold most of a window's excess in few of the run's readings.

    The best by share of excess minus share of readings; "throughout" where none stands out.
    """
    weight = np.zeros(trace.time.size)
    weight[inside] = np.maximum(excess[inside], 0.0)
    if weight.sum() <= 0.0:
        return "throughout"
    weight /= weight.sum()
    single = [
        (_contrast(mask, weight), name, mask)
        for name, mask in _conditions(trace)
        if mask @ weight >= HELD
    ]
    single.sort(key=lambda one: -one[0])
    best = single[0] if single and single[0][0] >= CONTRAST else None
    if best is None:
        return "throughout"
    for first, second in combinations(single[:12], 2):
        if first[1].split()[0] == second[1].split()[0]:
            continue
        both = first[2] & second[2]
        if both @ weight >= HELD and _contrast(both, weight) > best[0] + CONTRAST / 3:
            best = (_contrast(both, weight), f"{first[1]} and {second[1]}", both)
    return best[1]


def _contrast(mask: Bool[np.ndarray, " interval"], weight: np.ndarray) -> float:
    return float(mask @ weight - mask.mean())


def _conditions(trace: Trace) -> list[tuple[str, Bool[np.ndarray, " interval"]]]:
    found = []
    for name, signal in trace.signals.items():
        if np.ptp(signal) <= 0.0:
            continue
        unit = f" {SIGNALS[name]}" if SIGNALS[name] else ""
        for text in sorted({_rounded(name, x) for x in np.quantile(signal, QUANTILES)} | {"0"}):
            level = float(text)
            if signal.min() < level < signal.max():
                found.append((f"{name} > {text}{unit}", signal > level))
                found.append((f"{name} < {text}{unit}", signal < level))
    return found


def _rounded(name: str, level: float) -> str:
    """A threshold in two figures, whole numbers for cycles."""
    return f"{round(level)}" if name == "cycle" else f"{float(f'{level:.2g}'):g}"
