"""Ranks of simulation-based calibration: how far each quantity's ECDF is from a straight line."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binom

from muscle_bayes.criticism.sbc import RANKS, Calibration
from muscle_bayes.report.style import BLUE, GREY, VERMILLION, WIDTH, quiet_style

COLUMNS = 5
POINTWISE = 0.99
"""Probability of the band at each rank."""


def calibration_figure(found: Calibration, title: str) -> Figure:
    """One panel a quantity: share of data sets whose rank is at most r, minus r's own share.

    The grey band holds a uniform quantity's curve at each rank with probability POINTWISE; a curve
    that dips and rises is a posterior too narrow, one that leans is biased.
    """
    names = list(found.ranks)
    rows = -(-len(names) // COLUMNS)
    ranks = np.arange(RANKS + 1)
    uniform = (ranks + 1.0) / (RANKS + 1.0)
    tail = 0.5 * (1.0 - POINTWISE)
    low, high = (binom.ppf(q, found.sets, uniform) / found.sets for q in (tail, 1.0 - tail))
    chances = found.p_values()
    name, chance = found.smallest()
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.8 + 0.78 * rows))
        fig.suptitle(
            f"{title}: {found.sets} data sets, parameters drawn from {found.source}; "
            f"{found.converged} converged\n"
            f"least uniform: {name}, p = {chance:.2g} after Bonferroni's correction",
            x=0.01,
            ha="left",
            fontsize=9,
        )
        axes: Any = fig.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False)
        for axis in axes.flat[len(names) :]:
            axis.set_axis_off()
        for axis, one in zip(axes.flat, names, strict=False):
            counts = np.bincount(found.ranks[one], minlength=RANKS + 1)
            away = np.cumsum(counts) / found.sets - uniform
            poor = chances[one] * len(names) < 0.05
            axis.fill_between(ranks, low - uniform, high - uniform, color=GREY, alpha=0.3, lw=0)
            axis.plot(ranks, away, color=VERMILLION if poor else BLUE, drawstyle="steps-post")
            axis.set_title(f"{one}\np {chances[one]:.2g}", fontsize=7, fontweight="normal")
        for axis in axes[-1]:
            axis.set_xlabel("rank", fontsize=7)
        for axis in axes[:, 0]:
            axis.set_ylabel("ECDF minus\nuniform", fontsize=7)
    return fig
