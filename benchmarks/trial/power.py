"""How often an effect is named, by its strength."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.trial.counts import Rate
from muscle_bayes.report.style import BLUE, WIDTH, quiet_style

LEAST = 0.03
"""Strength at which weaker effects are drawn."""


def power_figure(numbers: dict[str, Any], parts: int = 5) -> Figure:
    """How often an effect is named, by its strength: each effect's cases, and all together in bins."""
    power = numbers["power"]
    every = sorted((strength, named) for some in power.values() for strength, named in some)
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 2.8 + 0.17 * len(power)))
        above, below = fig.subplots(2, 1, sharex=True, height_ratios=[1.6, 0.6 + 0.17 * len(power)])
        for group in np.array_split(np.arange(len(every)), min(parts, max(len(every), 1))):
            if not group.size:
                continue
            rate = Rate.of("", "", [every[index][1] for index in group])
            middle = float(np.median([max(every[index][0], LEAST) for index in group]))
            above.plot([middle] * 2, [rate.low, rate.high], color=BLUE, linewidth=1.0)
            above.plot(middle, rate.share, "o", color=BLUE)
        above.set(ylim=(-0.05, 1.05), ylabel="share named")
        above.set_title("detection rate of single effects, 95 % intervals")
        for row, some in enumerate(power.values()):
            for strength, named in some:
                face = BLUE if named else "none"
                below.plot(max(strength, LEAST), row, "o", color=BLUE, markerfacecolor=face)
        below.set_yticks(range(len(power)), list(power))
        below.set(xscale="log", ylim=(len(power) - 0.4, -0.6))
        below.set_xlabel("misfit of the model without it, in the error of a reading")
        below.set_title("each case: filled where the effect was named first or in its tie")
        fig.suptitle("Power of discovery, synthetic data", x=0.01, ha="left", fontsize=9)
    return fig
