"""How far data narrow each parameter."""

from matplotlib.figure import Figure

from muscle_bayes.inference.posteriors.identifiability import Identifiability
from muscle_bayes.report.style import BLUE, GREY, WIDTH, quiet_style


def identifiability_figure(found: Identifiability) -> Figure:
    """A bar a parameter: 1 - width of the posterior's 90 % interval over that of the prior's.

    Args:
        found: as `identify` gives it.

    Returns:
        A matplotlib figure.
    """
    names = list(found.parameters)[::-1]
    rows = [found.parameters[name] for name in names]
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.6 + 0.155 * len(names)))
        axis = fig.subplots()
        bars = axis.barh(
            names, [max(row.contraction, 0.0) for row in rows], color=BLUE, height=0.62
        )
        for place, (bar, row) in enumerate(zip(bars, rows, strict=True)):
            if row.edge:
                bar.set(hatch="////", edgecolor="white")
            text = f"{row.contraction:z.2f}" + (f", at its {row.edge} bound" if row.edge else "")
            axis.text(max(row.contraction, 0.0) + 0.01, place, text, va="center", fontsize=7)
        axis.axvline(1.0, color=GREY, linewidth=0.8)
        axis.set(xlim=(0.0, 1.25), xlabel="contraction from prior to posterior [1]")
        axis.tick_params(axis="y", labelsize=7)
        axis.grid(visible=False, axis="y")
    return fig
