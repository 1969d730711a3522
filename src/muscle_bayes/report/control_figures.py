"""What a control engineer looks at: responses with bands, speed against heat, loop gains."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from muscle_bayes.control.batch import SHOWN_EVERY, Bank
from muscle_bayes.control.judging.judge import Judgement, TradeOff, trade_off
from muscle_bayes.control.judging.specification import HOTTEST
from muscle_bayes.control.linear import Loop
from muscle_bayes.control.scenarios.scenario import Scenario
from muscle_bayes.report.style import BLACK, BLUE, GREY, PALETTE, VERMILLION, WIDTH, quiet_style

COMPARED: Final = "thesis"
"""The law that the recommended one is drawn against."""
_BANDS: Final = ((BLUE, 0.30), (VERMILLION, 0.22))
"""Colour and opacity of the 90 % band of the first and of the second law."""


def control_figures(
    result: Judgement, bank: Bank, found: Mapping[str, Loop], factors: Sequence[float]
) -> dict[str, Figure]:
    """Responses, speed against heat, and the recommended law's loops where there are any."""
    law = result.recommended
    both = [law, *([COMPARED] if COMPARED in result.gains and law != COMPARED else [])]
    curves = {
        name: trade_off(bank, gains, result.scenarios[:2], HOTTEST, factors)
        for name, gains in result.gains.items()
    }
    figures = {
        "responses": responses_figure(result, both),
        "pareto": pareto_figure(curves, HOTTEST),
    }
    return figures | ({"loop": loop_figure(found, law)} if found else {})


def responses_figure(result: Judgement, laws: Sequence[str]) -> Figure:
    """Angle over time in every scenario: setpoint, and median and 90 % of joints under one or two laws.

    Args:
        result: of laws that were judged, by `muscle_bayes.control.judging.judge.judge`.
        laws: one or two of them, the first in front.

    Returns:
        A matplotlib figure with a panel a scenario: angle [deg] over time [s].
    """
    rows = -(-len(result.scenarios) // 3)
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.7 + 1.75 * rows))
        axes = fig.subplots(rows, 3, squeeze=False).reshape(-1)
        for axis, scenario in zip(axes, result.scenarios, strict=False):
            _panel(axis, result, scenario, laws)
        for axis in axes[len(result.scenarios) :]:
            axis.set_visible(False)
        handles, labels = axes[0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside upper left", ncols=3)
        fig.supxlabel("time [s]", fontsize=9)
        fig.supylabel(r"$\theta$ [deg]", fontsize=9)
    return fig


def _panel(axis: Axes, result: Judgement, scenario: Scenario, laws: Sequence[str]) -> None:
    setpoint = np.degrees(np.asarray(scenario.course.setpoint[::SHOWN_EVERY]))
    period = result.gains[laws[0]].period
    time = np.arange(setpoint.size) * SHOWN_EVERY * period
    for (colour, opacity), law in reversed(list(zip(_BANDS, laws, strict=False))):
        angle = np.degrees(result.outcomes[law][scenario.name].angle)
        low, middle, high = np.nanquantile(angle, (0.05, 0.5, 0.95), axis=0)
        axis.fill_between(
            time, low, high, color=colour, alpha=opacity, linewidth=0, label=f"{law}, 90 %"
        )
        axis.plot(time, middle, color=colour, linewidth=1.0, label=f"{law}, median")
    axis.plot(time, setpoint, color=BLACK, linewidth=0.9, linestyle=(0, (4, 2)), label="setpoint")
    lines = _caption(result, scenario.name, laws)
    axis.set_title(f"{scenario.name}{'\n' * len(laws)}", fontsize=8, pad=10)
    told = axis.text(0.0, 1.02, "\n".join(lines), transform=axis.transAxes, fontsize=7, color=GREY)
    told.set_in_layout(False)
    shown = 60.0 if _swings_fast(scenario) else time[-1]
    axis.set_xlim(0.0, shown)
    reach = 1.9 * np.abs(setpoint).max()
    axis.set_ylim(-reach if setpoint.min() < 0 else -0.5 * reach, reach)


def _caption(result: Judgement, scenario: str, laws: Sequence[str]) -> list[str]:
    """What the shares are of, and the share of joints under each law."""
    shares = [f"{law} {result.probability(law, scenario)[0]:.0%}" for law in laws]
    spec = result.specs[scenario]
    if not spec.infeasible:
        return [f"meets: {shares[0]}", *shares[1:]]
    # What was wanted is out of reach of any input; this is what is asked then.
    return [f"no runaway, at most {spec.limits['peak_temperature']:g} °C:", *shares]


def _swings_fast(scenario: Scenario) -> bool:
    """Whether more than ten swings would be shown."""
    for values in (scenario.course.setpoint, scenario.course.load):
        if np.count_nonzero(np.diff(np.sign(values - np.mean(values)))) > 20:
            return True
    return False


def pareto_figure(curves: Mapping[str, TradeOff], limit: float) -> Figure:
    """Settling time of the step against the probability of overheating, as gains are multiplied.

    Args:
        curves: of every law, by `muscle_bayes.control.judging.judge.trade_off`.
        limit: temperature that counts as overheating [C].

    Returns:
        A matplotlib figure; large markers are the tuned gains.
    """
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 3.8))
        axis = fig.subplots()
        for (law, curve), colour in zip(curves.items(), cycle((*PALETTE, GREY)), strict=False):
            seen = np.isfinite(curve.speed[:, 1])
            middle = curve.speed[seen, 1]
            axis.plot(middle, curve.hot[seen], color=colour, marker="o", markersize=3, label=law)
            own = np.argmin(np.abs(np.log(curve.factor)))
            if seen[own]:
                axis.plot(
                    curve.speed[own, 1], curve.hot[own], color=colour, marker="o", markersize=9
                )
        axis.set_xlabel("settling time of the step [s], median of joints")
        axis.set_ylabel(f"probability of more than {limit:g} °C")
        top = max(0.1, *(float(curve.hot.max()) for curve in curves.values()))
        axis.set_ylim(-0.03 * top, 1.05 * top)
        axis.set_xlim(left=0.0)
        axis.legend()
    return fig


def loop_figure(loops: Mapping[str, Loop], law: str) -> Figure:
    """Bode diagram of the loop gain and sensitivity, with 90 % bands over joints, at several angles.

    Args:
        loops: by the operating point's name, by `muscle_bayes.control.linear.loops`.
        law: its name, for the title.

    Returns:
        A matplotlib figure: magnitude, phase [deg] and sensitivity over frequency [rad/s].
    """
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 6.0))
        above, middle, below = fig.subplots(3, sharex=True)
        for (name, loop), colour in zip(loops.items(), PALETTE, strict=False):
            phase = np.degrees(np.unwrap(np.angle(loop.gain), axis=1))
            for axis, value in (
                (above, np.abs(loop.gain)),
                (middle, phase),
                (below, np.abs(1.0 / (1.0 + loop.gain))),
            ):
                low, centre, high = np.quantile(value, (0.05, 0.5, 0.95), axis=0)
                axis.fill_between(loop.frequency, low, high, color=colour, alpha=0.3, linewidth=0)
                axis.plot(loop.frequency, centre, color=colour, label=name)
        above.axhline(1.0, color=GREY, linestyle=":")
        middle.axhline(-180.0, color=GREY, linestyle=":")
        below.axhline(2.0, color=GREY, linestyle=":")
        above.set(
            yscale="log", xscale="log", ylabel="|L|", title=f"{law}: median and 90 % of joints"
        )
        middle.set(ylabel="phase of L [deg]")
        below.set(yscale="log", ylabel="|S|", xlabel="frequency [rad/s]")
        above.legend()
    return fig
