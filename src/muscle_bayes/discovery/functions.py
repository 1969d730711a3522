"""Smooth functions on every port, for what no named effect explains."""

from collections.abc import Sequence

import numpy as np

from muscle_bayes.discovery.conditions import Trace
from muscle_bayes.discovery.fit import Fitted, Start, Tick, annealed, fit_all
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


def ports(nested: Nested) -> tuple[str, ...]:
    """Names of the functions of every port that these runs have, as a nested model takes them."""
    muscle = any(name == "F_modulus_min" for name, _ in nested.layout.shapes)
    return tuple(f"{PREFIX}-{p}" for p in PORT_SIGNALS if muscle or p not in MUSCLE_PORTS)


def function_names(lines: Sequence[Trace], having: Sequence[str]) -> list[str]:
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
    """A range that holds nearly all values, widened to a coarse grid: 1, 2 or 5 times a power of ten."""
    low, high = np.quantile(values, (0.005, 0.995))
    if low == high:
        low, high = values.min(), values.max()
    rough = (high - low) / 10.0
    unit = 10.0 ** np.floor(np.log10(rough))
    steps = np.array([1.0, 2.0, 5.0, 10.0])
    step = unit * steps[np.searchsorted(steps, rough / unit)]
    return float(np.floor(low / step) * step), float(np.ceil(high / step) * step)


def fit_functions(
    nested: Nested,
    base: Fitted,
    names: Sequence[str],
    noise: dict[str, float],
    *,
    most: int = 5,
    workers: int = 1,
    tick: Tick = lambda: None,
) -> dict[str, Fitted]:
    """Functions beside `base`: all judged by what a linear step promises, the `most` best fitted.

    They act nearly linearly, so a descent begins where they are off.
    """
    own = base.point[: base.used]
    slots = {name: nested.choice((*base.effects, name)).slot.size for name in names}
    rows = [
        Start(
            (*base.effects, n), np.r_[own, np.zeros(nested.shared + slots[n] - own.size)], base.data
        )
        for n in names
    ]
    seen = fit_all(nested, rows, steps=0, workers=workers, tick=tick)

    def promise(one: Fitted) -> float:
        gradient = np.asarray(one.look.gradient)[: one.used]
        return float(gradient @ one.precision.solve(gradient))

    order = sorted(range(len(names)), key=lambda i: -promise(seen[i]))[:most]
    starts = annealed(
        nested,
        [seen[i].start for i in order],
        noise,
        [names[i] for i in order],
        workers=workers,
        tick=tick,
    )
    plain = [seen[i].start for i in order]
    fits = fit_all(nested, [*starts, *plain], behind=300.0, workers=workers, tick=tick)
    best: dict[str, Fitted] = {}
    for one in fits:
        name = one.effects[-1]
        if name not in best or one.log_evidence > best[name].log_evidence:
            best[name] = one
    return best
