"""The report's first page: what the study found, in numbers with units."""

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from muscle_bayes.markup import unit_of
from muscle_bayes.report.tables import Table, table
from muscle_bayes.report.words import agrees, converged, interval, number, percent
from muscle_bayes.study.published import values_of
from muscle_bayes.study.results import Results

Values = Mapping[str, NDArray[np.float64]]
LITTLE: Final = 0.5
"""Contraction from prior to posterior below which a parameter counts as hardly narrowed."""


def _time_constant(temperature: float) -> Callable[[Values], Any]:
    return lambda v: v["H"] * (temperature + v["T_hyst_offset"]) / v["K_hyst"]


def _contraction(v: Values) -> Any:
    return -100.0 * (v["A"] * (90.0**2 - 25.0**2) + v["B"] * (90.0 - 25.0))


QUANTITIES: Final[tuple[tuple[str, str, Callable[[Values], Any]], ...]] = (
    ("rotor inertia J", "", lambda v: v["J"]),
    ("friction D", "", lambda v: v["D"]),
    ("stiffness of the muscle (MODULUS)", "N/m", lambda v: v["K_modulus"]),
    ("stiffness of HYST", "N/m", lambda v: v["K_hyst"]),
    ("time constant of HYST at 25 °C", "s", _time_constant(25.0)),
    ("time constant of HYST at 90 °C", "s", _time_constant(90.0)),
    ("contraction from 25 to 90 °C", "% of length", _contraction),
)
"""Name, unit (where empty, the parameter's own) and formula of what people ask of a muscle."""


def answers(results: Results) -> dict[str, Any]:
    """Table and sentences of the first page; an empty list where a question does not apply."""
    return {
        "table": _quantities(results),
        "trust": _trust(results),
        "unknown": _unknown(results),
        "missing": _missing(results),
        "drift": _drift(results),
        "control": results.stages.get("control", {}).get("answers", []),
    }


def best_fit(results: Results) -> str:
    """The fit whose numbers the first page gives: the revised model's, else the muscle's, the fixture's."""
    law = results.plan.config.friction
    wanted = ("revised", "muscle", f"fixture-{law}")
    return next(name for name in wanted if name in results.posteriors)


def _quantities(results: Results) -> Table:
    name = best_fit(results)
    group = results.posteriors[name].tree["posterior"]
    draws = {str(key): one.to_numpy().ravel() for key, one in group.data_vars.items()}
    units = results.posteriors[name].units
    ranges = values_of(results.plan.published, results.plan.config.friction, "muscle")
    known = {key: np.asarray(ends) for key, ends in ranges.items() if len(ends) == 1}
    rows = []
    for what, unit, formula in QUANTITIES:
        try:
            values = formula(draws)
        except KeyError:
            continue  # these runs have no muscle
        low, middle, high = (float(x) for x in np.quantile(values, [0.05, 0.5, 0.95]))
        row = {"q05": low, "q95": high}
        printed, agreed = _published(formula, known, row)
        own = unit or unit_of(units.get(what.split()[-1], "1"))
        rows.append((what, number(middle), interval(row), own, printed, agreed))
    columns = ("quantity", "median", "90 % interval", "unit", "published", "inside")
    shown = 6 if any(row[4] for row in rows) else 4
    return table(columns[:shown], [row[:shown] for row in rows])


def _published(
    formula: Callable[[Values], Any], known: Values, row: Mapping[str, float]
) -> tuple[str, str]:
    """The same quantity by published values, and whether the interval holds it."""
    try:
        value = float(np.squeeze(formula(known)))
    except KeyError:
        return "", ""
    return number(value), "yes" if agrees(row, (value,)) else "no"


def _trust(results: Results) -> list[str]:
    failed = [
        converged(f"the fit {name}" + ", replaced by revised," * (name in results.replaced), one)
        for name, one in results.summaries.items()
        if not one["converged"]
    ]
    return failed or [f"The chains of all {len(results.summaries)} fits converged."]


def _unknown(results: Results) -> list[str]:
    """What the runs do not identify."""
    told = []
    for part in ("fixture", "muscle"):
        checks = results.stages.get(f"{part}-checks")
        if checks is None:
            continue
        known = checks["identifiability"]
        taken = ("J", "D") if part == "muscle" and results.plan.roles.fixture else ()
        weak = [
            f"{name} ({one['contraction']:.2f})"
            for name, one in known["parameters"].items()
            if one["contraction"] < LITTLE and name not in taken
        ]
        if weak:
            told.append(
                f"The {part}'s runs hardly narrow {', '.join(weak)}. In brackets: 1 is known exactly, "
                "0 is no better than the prior."
            )
        pairs = [f"{a} with {b}" for a, b, _ in known["trade_offs"]]
        if pairs:
            told.append(f"Known in combination only: {'; '.join(pairs)}.")
    return told or ["The runs identify every parameter of the model."]


def _missing(results: Results) -> list[str]:
    """What the model lacked, how sure that is, and how much of the gap it closed."""
    found = results.stages["discovery"]
    told = [found["told"]]
    for step in found.get("steps", ()):
        closed = [share for share in step.get("closed", {}).values() if share is not None]
        sentence = f"The probability of {step['added']} is {percent(step['probability'])}."
        if closed:
            sentence += (
                f" It closes {percent(float(np.median(closed)))} of the gap between misfit and noise "
                f"(median of {len(closed)} runs with a gap)."
            )
        told.append(sentence)
    return [*told, *(f"Not searched: {one}." for one in found.get("not_searched", ()))]


def _drift(results: Results) -> list[str]:
    """Creep while cold beyond the model, before and after what was found."""
    told = []
    later = results.stages["discovery"].get("drift", {})
    for name, one in results.drifts.items():
        overall = one["slope_difference"]
        if overall is None:
            continue
        sentence = (
            f"While cold, run {name} creeps {number(overall['mean'], 2)} {one['unit']}/min more than the "
            f"nominal model says (90 %: {interval(overall, 2)})."
        )
        after = (later.get(name) or {}).get("after")
        if after and results.stages["discovery"].get("steps"):
            sentence += (
                f" With what was found it is {number(after['mean'], 2)} {one['unit']}/min "
                f"(90 %: {interval(after, 2)})."
            )
        told.append(sentence)
    return told
