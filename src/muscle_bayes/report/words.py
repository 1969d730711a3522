"""Numbers as a reader wants them, and sentences that state or compare them, all made from results."""

from collections.abc import Mapping, Sequence
from typing import Any

from muscle_bayes.markup import RAISED

MINUS = "−"
SIGNALS = {
    "q": ("angle or position", "rad or m"),
    "speed": ("speed", "rad/s or m/s"),
    "load": ("load", "kg"),
    "strain": ("strain sigma of the muscle", "1"),
    "hyst": ("strain sigma_hyst of HYST", "1"),
    "temperature": ("temperature", "C"),
}
"""What a function may depend on, in words, and its unit."""


def number(value: float | None, digits: int = 4) -> str:
    """A number to so many significant digits; powers of ten where it is very small or large."""
    if value is None:
        return "unknown"
    if value == 0.0:
        return "0"
    size = abs(value)
    if 1e-3 <= size < 1e5:
        text = f"{value:#.{digits}g}".rstrip(".")
        text = text if "e" not in text else f"{value:.0f}"
        return text.replace("-", MINUS)
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}·10{str(int(exponent)).translate(RAISED)}".replace("-", MINUS)


def interval(row: Mapping[str, Any], digits: int = 4) -> str:
    """The central 90 %."""
    return f"{number(row['q05'], digits)} to {number(row['q95'], digits)}"


def percent(share: float) -> str:
    """A share in percent."""
    return f"{100.0 * share:.0f} %"


def plural(count: int, noun: str) -> str:
    """Count and noun."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


Numbers = Mapping[str, Any]


def notice(origins: Sequence[str]) -> str:
    """What the first page says of where the data come from."""
    if set(origins) == {"synthetic"}:
        return (
            "These data are synthetic: a simulator wrote them, nothing here was measured. They show what "
            "the method finds where the truth is known; they are no evidence about a real muscle."
        )
    if set(origins) == {"measured"}:
        return "These data were measured."
    return "Some of these data are synthetic, written by a simulator: the table of runs says which."


def converged(name: str, summary: Numbers) -> str:
    """Whether a fit's draws may be used."""
    if summary["converged"]:
        return f"The chains of {name} converged."
    return f"The chains of {name} have NOT converged: {'; '.join(summary['complaints'])}."


def printed(parameters: Numbers, values: Mapping[str, Sequence[float]], where: str) -> str:
    """How many published values the posterior holds for possible."""
    shared = [name for name in values if name in parameters]
    if not shared:
        return ""
    out = [name for name in shared if not agrees(parameters[name], values[name])]
    inside = len(shared) - len(out)
    text = (
        f"{inside} of {plural(len(shared), 'value')} in {where} lie in the posterior's central 90 %"
    )
    return text + (f"; outside: {', '.join(out)}." if out else ".")


def agrees(row: Numbers, ends: Sequence[float]) -> bool:
    """Whether the central 90 % of a parameter reaches into a published range."""
    return row["q05"] <= ends[-1] and ends[0] <= row["q95"]


def friction(found: Numbers) -> str:
    """Which law of friction predicts better."""
    first, second = found["names"]
    text = (
        f"Expected log predictive density, {first} minus {second} friction: "
        f"{found['elpd_difference']:+.1f} nat (standard error {found['se']:.1f}). "
    )
    if found["better"] == "neither":
        return text + "That is within two standard errors: these runs prefer neither."
    return text + f"These runs prefer {found['better']} friction."


def creep(name: str, found: Numbers) -> str:
    """Whether a run creeps while cold by more than the model says."""
    overall = found["slope_difference"]
    if overall is None:
        return f"Run {name} says nothing of creep while cold: {found['reason']}"
    ends = interval(overall, 3)
    includes = overall["q05"] <= 0.0 <= overall["q95"]
    return (
        f"While cold, run {name} creeps by {number(overall['mean'], 3)} {found['unit']}/min more than "
        f"predicted (90 % interval {ends}), an interval that "
        + ("includes no difference." if includes else "does not include what the model says.")
    )


def located(found: Numbers) -> str:
    """Whether and where the nominal model misfits."""
    p = number(found["misfit_p_value"], 2)
    if not found["located"]:
        return f"No window of any run misfits more than noise allows (p = {p} over all windows)."
    return (
        f"{plural(len(found['located']), 'window')} of the fitted runs misfit more than noise and "
        f"uncertain parameters allow (p = {p} for the most significant, over all windows)."
    )


def ending(found: Numbers) -> str:
    """Why the search for effects ended, and what is left."""
    left = number(found["left_p_value"], 2)
    return f"The search ended because {found['stopped_because']}. Largest misfit left: p = {left}."


def revision(found: Numbers) -> str:
    """Which model the later stages use."""
    if found["fit"] != "revised":
        return "No effect was added, so the revised model is the nominal one."
    parts = [f"the first part of {run}" for run in found["first_parts"]]
    return (
        f"The revised model has {', '.join(found['effects'])}. "
        f"It is fitted to {', '.join([*found['runs'], *parts])}. "
        + converged("the revised model", found["summary"])
    )


def tuning(found: Numbers) -> str:
    """What gains were tested on."""
    return f"All laws were tested on {plural(found['draws'], 'new joint')} that none was tuned on."


def inertia(name: str, run: Numbers) -> str:
    """What leaving out the rotor's inertia does to a slow run."""
    found = run["inertia"]
    if found["rms"] is None or found["rms"] != found["rms"]:
        return f"{name}: what leaving out the rotor's inertia changes is not known."
    kept = "kept" if found["kept"] else "left out"
    return (
        f"{name}: the rotor's inertia is {kept}; leaving it out changes readings by "
        f"{number(found['rms'], 2)} {run['unit']} RMS, at most {number(found['largest'], 2)}."
    )


def curve(found: Numbers) -> str:
    """A function that nobody has named in words: its coefficients would tell nobody anything."""
    told, port = found["curve"], found["port"]
    unit = "" if told["unit"] == "1" else f" {told['unit']}"
    what = "The damper's logarithm" if port == "damper" else f"The {port}"
    by_value = sorted(zip(told["median"], told["signal"], strict=True))
    low, high = (f"{value:+.3g}{unit} at {at:.3g}" for value, at in (by_value[0], by_value[-1]))
    return (
        f"{what} changes by {low} to {high}, the {SIGNALS[found['signals'][0]][0]} being from "
        f"{told['signal'][0]:.3g} to {told['signal'][-1]:.3g}"
    )


def step(found: Numbers) -> str:
    """What an added effect is, how sure that is, and what it brings."""
    values = "; ".join(
        f"{name} {number(one['median'])} {'' if one['unit'] == '1' else one['unit']}".rstrip()
        + f" (90 %: {number(one['low'])} to {number(one['high'])})"
        for name, one in found["parameters"].items()
    )
    if found["curve"] is not None:
        values = curve(found)
    gate = found["gate"]
    signals = f", a function of {', '.join(found['signals'])}" if found["signals"] else ""
    return (
        f"Added: {found['added']} on the port {found['port']}{signals}, with probability "
        f"{percent(found['probability'])}. {values}. Readings left out ({gate['by']}) are predicted better "
        f"by {number(gate['gain'], 3)} nat (standard error {number(gate['se'], 2)})."
    )
