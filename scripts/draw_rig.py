"""Draw the rig and the elements of the muscle as vectors: docs/figures/rig.svg and muscle.svg.

python scripts/draw_rig.py
"""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, FancyArrowPatch, Rectangle

from muscle_bayes.report.style import BLACK, BLUE, GREY, ORANGE, VERMILLION, quiet_style, save

FIGURES = Path(__file__).parents[1] / "docs" / "figures"


def coil(axis: Axes, start: tuple[float, float], end: tuple[float, float], turns: int) -> None:
    """A coiled muscle, or a spring, between two points."""
    along = np.subtract(end, start)
    across = np.array([-along[1], along[0]]) / np.hypot(*along)
    place = np.linspace(0.0, 1.0, 40 * turns)
    sway = (
        0.16
        * np.sin(2.0 * np.pi * turns * place)
        * np.minimum(1.0, 8 * np.minimum(place, 1 - place))
    )
    line = np.asarray(start) + place[:, None] * along + sway[:, None] * across
    axis.plot(*line.T, color=BLUE, linewidth=1.6)


def note(axis: Axes, text: str, at: tuple[float, float], to: tuple[float, float]) -> None:
    """A label with a thin line to what it names."""
    axis.annotate(
        text, to, at, fontsize=9, va="center", ha="center",
        arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.8},
    )  # fmt: skip


def rig() -> Figure:
    """Rotor, muscle in its heater, load on a cable, potentiometer."""
    with quiet_style():
        fig = Figure(figsize=(6.6, 3.1))
        axis = fig.subplots()
        axis.set(xlim=(-6.4, 6.6), ylim=(-3.2, 2.9), aspect="equal")
        axis.axis("off")
        axis.add_patch(Circle((0, 0), 1.3, facecolor="#EDEDED", edgecolor=BLACK))
        axis.add_patch(Circle((0, 0), 0.28, facecolor="white", edgecolor=BLACK))
        axis.plot([0, 0.9], [0, 0.5], color=BLACK, linewidth=1.0)
        axis.add_patch(Arc((0, 0), 1.5, 1.5, theta1=0, theta2=29, color=VERMILLION, linewidth=1.4))
        axis.text(1.0, 0.13, r"$\theta$", color=VERMILLION, fontsize=11)
        axis.plot([0, 1.0], [0, 0], color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
        pin, anchor = (-0.75, 0.75), (-5.6, 0.75)
        axis.add_patch(
            Rectangle((-4.9, 0.35), 3.3, 0.8, facecolor="#FBE3D2", edgecolor=ORANGE, linewidth=1.2)
        )
        coil(axis, anchor, pin, 9)
        for x, y in (pin, anchor):
            axis.add_patch(Circle((x, y), 0.09, color=BLACK))
        axis.add_patch(Rectangle((-5.95, 0.2), 0.35, 1.1, facecolor="#CCCCCC", edgecolor=BLACK))
        axis.plot([1.3, 1.3], [0, -1.9], color=BLACK, linewidth=1.1)
        axis.add_patch(Rectangle((0.85, -2.6), 0.9, 0.7, facecolor="#BBBBBB", edgecolor=BLACK))
        axis.add_patch(Circle((4.4, 0), 0.62, facecolor="#DCEBF5", edgecolor=BLUE))
        axis.plot([1.3, 3.78], [-0.06, -0.06], color=GREY, linewidth=3.5, alpha=0.6)
        axis.add_patch(
            FancyArrowPatch((4.05, -0.2), (4.75, 0.25), arrowstyle="->", mutation_scale=10)
        )
        note(axis, "coiled nylon muscle: shortens when hot", (-3.3, 2.35), (-3.2, 0.95))
        note(axis, "heater tube and thermocouple", (-3.6, -1.0), (-3.6, 0.35))
        note(axis, "rotor: inertia $J$, friction $D$", (1.2, 2.35), (0.35, 1.2))
        note(axis, "load on a cable", (3.3, -2.25), (1.78, -2.25))
        note(axis, "potentiometer\nlogs the angle", (4.4, 1.5), (4.4, 0.62))
    return fig


def muscle() -> Figure:
    """MODULUS, OFFSET and HYST in series."""
    with quiet_style():
        fig = Figure(figsize=(6.6, 1.9))
        axis = fig.subplots()
        axis.set(xlim=(-0.4, 12.2), ylim=(-1.9, 1.5), aspect="equal")
        axis.axis("off")
        coil(axis, (0.3, 0), (3.3, 0), 5)
        axis.add_patch(Rectangle((4.0, -0.35), 2.0, 0.7, facecolor="#FBE3D2", edgecolor=ORANGE))
        axis.text(5.0, 0.0, r"$\sigma_{\mathrm{offset}}(T)$", ha="center", va="center")
        for left, right, y in ((3.3, 4.0, 0), (6.0, 6.9, 0), (10.4, 11.2, 0)):
            axis.plot([left, right], [y, y], color=BLACK, linewidth=1.2)
        for x in (6.9, 10.4):
            axis.plot([x, x], [-0.7, 0.7], color=BLACK, linewidth=1.2)
        coil(axis, (6.9, 0.7), (10.4, 0.7), 5)
        axis.plot([6.9, 8.5], [-0.7, -0.7], color=BLACK, linewidth=1.2)
        axis.plot([8.2, 8.9, 8.9, 8.2], [-0.4, -0.4, -1.0, -1.0], color=BLACK, linewidth=1.2)
        axis.plot([8.5, 8.5], [-0.92, -0.48], color=BLACK, linewidth=2.2)
        axis.plot([8.9, 10.4], [-0.7, -0.7], color=BLACK, linewidth=1.2)
        for x in (0.3, 11.2):
            axis.add_patch(Circle((x, 0), 0.1, color=BLACK))
        axis.add_patch(FancyArrowPatch((11.3, 0), (12.1, 0), arrowstyle="->", mutation_scale=11))
        axis.text(11.7, 0.3, "$F$", ha="center")
        for x, text in ((1.8, "MODULUS: a spring"), (5.0, "OFFSET: thermal\ncontraction")):
            axis.text(x, -0.75, text, ha="center", va="top", fontsize=9)
        axis.text(8.65, -1.2, "HYST: a spring beside a damper", ha="center", va="top", fontsize=9)
    return fig


if __name__ == "__main__":
    save(rig(), FIGURES / "rig.svg")
    save(muscle(), FIGURES / "muscle.svg")
