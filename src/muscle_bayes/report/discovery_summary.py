"""One page on what was found, to be read aloud."""

from collections.abc import Mapping
from typing import Any

from muscle_bayes.discovery.result import Discovery
from muscle_bayes.discovery.weigh import NONE, UNKNOWN
from muscle_bayes.report.tables import added, markdown, probabilities
from muscle_bayes.report.words import step

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
    lines += [markdown(probabilities({"probabilities": found.probabilities})), ""]
    lines += [f"- {check}." for check in found.checks] + [""]
    for tie in found.ties:
        lines += [f"These runs cannot distinguish: {', '.join(tie)}.", ""]
    for one in found.as_dict()["steps"]:
        lines += _step(one, found.floor)
    lines += ["## What is left", ""]
    left = found.final.misfit
    lines += [
        f"Largest misfit left: p = {left.p_value:.2g} over all windows of all runs. "
        f"The search ended because {found.stopped_because}.",
        "",
        *[f"Not searched: {one}." for one in found.not_searched],
    ]
    if (following := found.next_experiment) is not None:
        lines += ["## Next experiment", "", str(following), ""]
        if following.sequence:
            lines += ["The logger's sequence is in `next-experiment.toml`.", ""]
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


def _step(told: Mapping[str, Any], floor: Mapping[str, float]) -> list[str]:
    lines = [f"## Added: {told['added']} (port {told['port']})", "", step(told), ""]
    lines += ["Drawn in `unknown.png`.", ""] if told["curve"] is not None else []
    lines += [markdown(added(told, floor))]
    if told["undetermined"]:
        lines += ["", f"No longer determined beside it: {', '.join(told['undetermined'])}."]
    return [*lines, ""]
