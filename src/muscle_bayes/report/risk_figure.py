"""What gains risk: cost and runaway over the draws, as all gains are made smaller or larger together."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from muscle_bayes.report.style import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION, WIDTH, quiet_style


@dataclass(frozen=True)
class RiskCurve:
    """Of gains in a fixed proportion of each other, over draws that were kept apart."""

    proportional: Float[np.ndarray, " gain"]
    """duty / rad"""
    cost: Float[np.ndarray, "gain 3"]
    """5, 50 and 95 % quantile of the cost, mean over the scenarios"""
    cvar: Float[np.ndarray, " gain"]
    """95 % CVaR of the cost, mean over the scenarios"""
    unstable: Float[np.ndarray, " gain"]
    """probability that the loop adds error, in the worst scenario"""
    unsafe: Float[np.ndarray, " gain"]
    """probability that a muscle gets too hot, in the worst scenario"""

    def as_dict(self) -> dict[str, list]:
        """For JSON."""
        return {key: getattr(self, key).tolist() for key in self.__dataclass_fields__}


def risk_figure(curve: RiskCurve, marked: Mapping[str, float]) -> Figure:
    """Cost and probabilities against the proportional gain; `marked` gains as lines."""
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 3.0))
        above, below = fig.subplots(2, sharex=True, height_ratios=[1.5, 1.0])
        low, middle, high = curve.cost.T
        above.fill_between(curve.proportional, low, high, color=SKY, alpha=0.4, linewidth=0)
        above.plot(curve.proportional, middle, color=BLUE, marker="o", label="median cost, 90 %")
        above.plot(
            curve.proportional,
            curve.cvar,
            color=BLACK,
            marker="s",
            linestyle="--",
            label="95 % CVaR",
        )
        above.set(ylabel="cost [1]", xscale="log", yscale="log")
        style = {"marker": "s", "color": VERMILLION}
        below.plot(curve.proportional, curve.unstable, label="adds error", **style)  # type: ignore[arg-type]
        below.plot(curve.proportional, curve.unsafe, color=ORANGE, marker="o", label="too hot")
        below.set(ylabel="probability [1]", ylim=(-0.03, 1.03))
        below.set_xlabel("proportional gain [duty/rad], integral in proportion")
        for number, (name, gain) in enumerate(marked.items()):
            for axis in (above, below):
                axis.axvline(gain, color=GREY, linestyle=(0, (1 + 3 * number, 2)), linewidth=1.2)
            above.annotate(
                f" {name}",
                (gain, 0.97 - 0.09 * number),
                xycoords=("data", "axes fraction"),
                fontsize=7,
            )
        for axis in (above, below):
            axis.legend(ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)
    return fig
