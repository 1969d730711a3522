"""Smooth functions on every port, for what no named effect explains."""

from collections.abc import Sequence

import numpy as np

from muscle_bayes.discovery.conditions import Trace
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.physics.effect import MUSCLE_PORTS
from muscle_bayes.physics.effects.empirical import PORT_SIGNALS, PREFIX, function_name

TRACED = {
    "q": ("angle", "position"),
    "speed": ("speed", "velocity"),
    "load": ("load",),
    "strain": ("sigma",),
    "hyst": ("sigma_hyst",),
    "temperature": ("T",),
}
"""Names of a port's signals in a run's trace."""
STEPS = np.array([1.0, 2.0, 5.0, 10.0])
"""Ranges end at these multiples of a power of ten, so that similar rigs have the same."""


def ports(nested: Nested) -> tuple[str, ...]:
    """Names of the functions of every port that these runs have, as a nested model takes them."""
    muscle = any(name == "F_modulus_min" for name, _ in nested.layout.shapes)
    return tuple(f"{PREFIX}-{p}" for p in PORT_SIGNALS if muscle or p not in MUSCLE_PORTS)


def candidates(lines: Sequence[Trace], having: Sequence[str]) -> list[str]:
    """Every port with every signal that varies in the runs, over the range it has there."""
    found = []
    for port, signals in PORT_SIGNALS.items():
        if f"{PREFIX}-{port}" not in having:
            continue
        for signal in signals:
            seen = [
                line.signals[name]
                for line in lines
                for name in TRACED[signal]
                if name in line.signals
            ]
            values = np.concatenate(seen) if seen else np.zeros(1)
            if np.ptp(values) > 0.0:
                found.append(function_name(port, signal, *_rounded(values)))
    return found


def _rounded(values: np.ndarray) -> tuple[float, float]:
    """A range that holds nearly all values, widened to a coarse grid."""
    low, high = np.quantile(values, (0.005, 0.995))
    if low == high:
        low, high = values.min(), values.max()
    rough = (high - low) / 10.0
    unit = 10.0 ** np.floor(np.log10(rough))
    step = unit * STEPS[np.searchsorted(STEPS, rough / unit)]
    return float(np.floor(low / step) * step), float(np.ceil(high / step) * step)
