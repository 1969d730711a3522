"""One page on what was found, to be read aloud."""

from collections.abc import Mapping

import numpy as np

from muscle_bayes.discovery.result import Curve, Discovery, Step
from muscle_bayes.discovery.weigh import NONE, UNKNOWN

SIGNAL_WORDS = {
    "q": "angle or position",
    "speed": "speed",
    "load": "load",
    "strain": "strain sigma of the muscle",
    "hyst": "strain sigma_hyst of HYST",
    "temperature": "temperature",
}
"""What a function may depend on, in words."""
WINDOWS = 5
"""Windows of the misfit map that are told."""


def verdict_text(found: Discovery) -> str:
    """The verdict as a sentence."""
    if found.not_searched and not found.steps:
        state = "a misfit is left" if found.located.significant else "nothing was found so far"
        return f"The search did not end: {state}."
    if found.verdict == NONE:
        left = found.final.misfit
        if not left.significant:
            return "Nothing is missing that these runs could show."
        if left.steps < found.smallest:
            return (
                f"Nothing is claimed: the largest misfit is small, {left.steps:.2g} steps of the sensor "
                f"RMS (less than {found.smallest:g} is not searched)."
            )
        none, unknown = (found.probabilities[name] for name in (NONE, UNKNOWN))
        return (
            "Nothing is claimed. A misfit is left that nothing tried explains "
            f"(p = {left.p_value:.2g}); it may be chance (none: {none:.0%}, unknown: {unknown:.0%})."
        )
    if found.verdict == UNKNOWN and not found.steps:
        return "Something is missing, but nothing tried explains it: unknown."
    parts = [
        f"unknown ({step.port}, depends on {', '.join(step.signals)})"
        if step.added == UNKNOWN
        else step.added
        for step in found.steps
    ]
    return f"Missing from the model: {', then '.join(parts)}.{_shares(found)}"


def _shares(found: Discovery) -> str:
    """What each step closes of the gap that any model closes on unseen readings."""
    told = [*found.steps, *([found.remainder] if found.remainder else [])]
    if any(step.share is None for step in told):
        return ""
    parts = [f"{step.effect.partition('(')[0]} {step.share:.0%}" for step in found.steps]
    if found.remainder is not None:
        rest = found.remainder
        parts.append(f"rest {rest.share:.0%} ({rest.port}, depends on {', '.join(rest.signals)})")
    return f" Of the gap on unseen readings: {', '.join(parts)}."


def summary(found: Discovery, origins: Mapping[str, str]) -> str:
    """Markdown: verdict, where the misfit was, what was added, what it changed, what is left."""
    lines = ["# What is missing from the model?", ""]
    if synthetic := sorted(name for name, origin in origins.items() if origin == "synthetic"):
        every = len(synthetic) == len(origins)
        which = "All runs are" if every else f"{', '.join(synthetic)}:"
        lines += [f"**{which} SYNTHETIC data, written by a simulator.**", ""]
    lines += [verdict_text(found), ""]
    if found.visible is not None:
        lines += ["## What these runs could show", "", found.visible.text(), ""]
    lines += ["## Where the misfit was", ""]
    lines += _located(found)
    lines += ["## How likely", ""]
    order = sorted(found.probabilities.items(), key=lambda item: -item[1])
    lines += [f"- {name}: {p:.1%}" for name, p in order if p >= 0.005] + [""]
    lines += [f"- {check}." for check in found.checks] + [""]
    for tie in found.ties:
        lines += [f"These runs cannot distinguish: {', '.join(tie)}.", ""]
    for step in found.steps:
        lines += _step(step, found)
    lines += ["## What is left", ""]
    left = found.final.misfit
    lines += [
        f"Largest misfit left: p = {left.p_value:.2g} over all windows of all runs. "
        f"The search ended because {found.stopped_because}.",
        "",
        *[f"Not searched: {one}." for one in found.not_searched],
    ]
    if (following := found.next_experiment) is not None:
        loads = ", ".join(f"{1000 * load:g} g" for load in following.loads)
        lines += [
            "## Next experiment",
            "",
            f"To tell {' from '.join(following.separates)}: {following.protocol}, {loads} "
            f"(`next-experiment.toml`); expected log odds {following.information:.1f} nat.",
            "",
        ]
    return "\n".join(lines)


def _seconds(time: float) -> str:
    """Whole seconds of long runs, hundredths of short ones."""
    return f"{time:.0f}" if time >= 100.0 else f"{time:.4g}"


def _located(found: Discovery) -> list[str]:
    if not found.located.windows:
        return [f"Nowhere: p = {found.located.p_value:.2g} over all windows of all runs.", ""]
    lines = [
        f"- {one.run}, {_seconds(one.start)} to {_seconds(one.end)} s, {one.where}: "
        f"{one.rms:.2g} {one.unit} RMS, {one.share:.0%} of the excess (p = {one.p_value:.2g})"
        for one in found.located.windows[:WINDOWS]
    ]
    more = len(found.located.windows) - WINDOWS
    return [*lines, *([f"- and {more} windows more"] if more > 0 else []), ""]


def _closed(step: Step, run: str, floor: float) -> str:
    share = step.closed(run, floor)
    return "no gap" if share is None else f"{share:.0%}"


def _curve(step: Step, curve: Curve) -> str:
    """A function in words: its coefficients would tell nobody anything."""
    bottom, top = np.argmin(curve.median), np.argmax(curve.median)
    unit = "" if curve.unit == "1" else f" {curve.unit}"
    what = "The damper's logarithm" if step.port == "damper" else f"The {step.port}"
    ends = [f"{curve.median[i]:+.3g}{unit} at {curve.signal[i]:.3g}" for i in (bottom, top)]
    return (
        f"{what} changes by {ends[0]} to {ends[1]}, the {SIGNAL_WORDS[step.signals[0]]} being from "
        f"{curve.signal[0]:.3g} to {curve.signal[-1]:.3g} (`unknown.png`)"
    )


def _step(step: Step, found: Discovery) -> list[str]:
    numbers = ", ".join(
        f"{name} {one.median:.3g} {'' if one.unit == '1' else one.unit}".rstrip()
        + f" (90 %: {one.low:.3g} to {one.high:.3g})"
        for name, one in step.parameters.items()
    )
    if step.curve is not None:
        numbers = _curve(step, step.curve)
    lines = [
        f"## Added: {step.added} (port {step.port})",
        "",
        f"Probability at this step {step.probability:.1%}. {numbers}. Readings left out "
        f"({step.gate.by}) are predicted better by {step.gate.gain:.0f} nat "
        f"(standard error {step.gate.se:.0f}).",
        "",
        "| run | RMSE before | after | noise alone | gap closed | within 90 % band |",
        "|---|---|---|---|---|---|",
    ]
    for run, check in step.after.checks.items():
        mark = " (held out)" if run in found.held_out else ""
        before, floor = step.before.checks[run], found.floor[run]
        lines.append(
            f"| {run}{mark} | {before.rmse:.3g} | {check.rmse:.3g} | {floor:.3g} "
            f"{check.unit} | {_closed(step, run, floor)} | {check.coverage90:.0%} |"
        )
    if step.weakened:
        lines += ["", f"No longer determined beside it: {', '.join(step.weakened)}."]
    return [*lines, ""]
