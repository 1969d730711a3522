"""What a trial of discovery counted."""

from typing import Any

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.stats import binomtest

from muscle_bayes.discovery.weigh import NONE
from muscle_bayes.physics.effects import CATALOGUE
from muscle_bayes.report.style import BLACK, BLUE, GREY, WIDTH, quiet_style

NOTHING = "nothing"
"""What the confusion matrix calls a case without hidden effect."""


def trial_figure(numbers: dict[str, Any]) -> Figure:
    """Confusion matrix, and how often statements of a probability were true."""
    table = numbers["confusion"]
    said = sorted({name for row in table.values() for name in row}, key=_place)
    hidden = sorted(table, key=_place)
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 1.4 + 0.17 * max(len(hidden), 8) + 1.9))
        left, right = fig.subplots(2, 1, height_ratios=[0.9 + 0.17 * max(len(hidden), 8), 1.8])
        for row, name in enumerate(hidden):
            total = sum(table[name].values())
            for column, answer in enumerate(said):
                count = table[name].get(answer, 0)
                if count:
                    corner, alpha = (column - 0.5, row - 0.5), 0.15 + 0.5 * count / total
                    left.add_patch(Rectangle(corner, 1.0, 1.0, color=BLUE, alpha=alpha))
                    left.text(column, row, str(count), ha="center", va="center", fontsize=7)
        left.set(xlim=(-0.6, len(said) - 0.4), ylim=(len(hidden) - 0.4, -0.6))
        left.set_xticks(range(len(said)), said, rotation=60, ha="right")
        left.set_yticks(range(len(hidden)), [_told(name) for name in hidden])
        left.set_title("detectable effect hidden (rows), said first (columns): cases")
        right.plot([0, 1], [0, 1], color=GREY, linestyle="--", linewidth=1.0)
        for one in numbers["reliability"]:
            hits = round(one["true"] * one["statements"])
            came = binomtest(hits, one["statements"]).proportion_ci()  # Clopper and Pearson, 95 %
            right.plot([one["said"]] * 2, came, color=BLUE, linewidth=1.0)
            right.plot(one["said"], one["true"], "o", color=BLUE)
            right.annotate(
                f"{one['statements']}",
                (one["said"], one["true"]),
                xytext=(5, -9),
                textcoords="offset points",
                color=BLACK,
                fontsize=7,
            )
        right.set(
            xlim=(0, 1.08), ylim=(-0.08, 1.05), xlabel="probability given", ylabel="share true"
        )
        right.set_title(
            f"reliability: answers, 95 % intervals\n"
            f"calibration error {numbers['calibration_error']:.3f}"
        )
        fig.suptitle(
            f"Trial of discovery on {numbers['cases']} synthetic data sets",
            x=0.01,
            ha="left",
            fontsize=9,
        )
    return fig


def _place(name: str) -> tuple[int, str]:
    """Order in which right answers lie on the diagonal: effects, what no catalogue has, nothing."""
    return 0 if name in CATALOGUE else 2 if name in (NOTHING, NONE) else 1, name


def _told(hidden: str) -> str:
    known = hidden in CATALOGUE or hidden == NOTHING
    return hidden if known else f"{hidden} (not in the catalogue)"
