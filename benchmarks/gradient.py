"""Value and gradient of the joint log posterior of three staircases, by all competitors in one run.

python -m benchmarks.gradient writes results/gradient.json beside this file. Nothing is timed whose
density or gradient is wrong.
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from benchmarks import RESULTS
from benchmarks.competitors.c_floor import CFloor
from benchmarks.competitors.casadi_cvodes import CasadiCvodes
from benchmarks.competitors.generic_diffrax import GenericDiffrax, ReverseDiffrax
from benchmarks.competitors.lsoda import Lsoda
from benchmarks.competitors.ours import Ours
from benchmarks.competitors.protocol import Competitor, Coordinates, Gradient
from benchmarks.machine import machine
from benchmarks.ode import COARSE_ERROR, damping_for
from benchmarks.problem import posed, reference_point
from benchmarks.reference import error, independent, reference
from benchmarks.timing import Timing, timings
from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.model.problem import Problem

PACKAGES = ("jax", "jaxlib", "diffrax", "numpy", "scipy", "casadi")
TOLERANCES = tuple(10.0 ** -(half / 2) for half in range(8, 23))
"""Tried from loose to tight, two a decade from 1e-4 to 1e-11."""
AGREEMENT = 0.1
"""Largest difference of coordinates from ours [counts RMS] of a competitor that is timed."""
DENSITY_TOLERANCE = {"equal": 0.2, "coarse": 1.0}
"""Largest difference of its log posterior from ours."""
GRADIENT_TOLERANCE = {"equal": 0.05, "coarse": 0.15}
"""Largest |gradient - ours| / |ours|. Near the mode, where the point lies, gradients of all readings
cancel to about a hundredth of each, and so errors count a hundredfold."""


@dataclass
class Entry:
    """One line of the results."""

    competitor: str
    level: str
    """`own`: steps on the schedule; `equal`: no worse than ours; `coarse`: COARSE_ERROR."""
    settings: str
    error: float
    """Against the reference [counts RMS]."""
    apart: float
    """From our coordinates [counts RMS]."""
    density: float
    """Log posterior less ours."""
    gradient: float
    """|gradient - ours| / |ours|."""
    first: float
    """To set it up and call it once, with compilation [s]; what another level has compiled is there."""
    failure: str = ""
    timing: Timing | None = None


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _judged(
    make: Callable[[], Competitor], level: str, vector: Array, true: Coordinates, ours: Gradient
) -> tuple[Entry, Competitor]:
    """A competitor, its error, density and gradient, and what disqualifies it."""
    begun = time.perf_counter()
    one = make()
    value, gradient = one(vector)
    first = time.perf_counter() - begun
    q, problem = one.coordinates(vector), one.problem
    entry = Entry(
        one.name,
        level,
        one.settings,
        error(q, true, problem),
        error(q, Ours(problem).coordinates(vector), problem),
        value - ours[0],
        float(np.linalg.norm(gradient - ours[1]) / np.linalg.norm(ours[1])),
        first,
    )
    limits = "equal" if level == "own" else level
    if not entry.apart <= AGREEMENT:
        entry.failure = "coordinates differ"
    elif not abs(entry.density) <= DENSITY_TOLERANCE[limits]:
        entry.failure = "log posterior differs"
    elif not entry.gradient <= GRADIENT_TOLERANCE[limits]:
        entry.failure = "gradient differs"
    return entry, one


def _entered(
    make: Callable[[float], Competitor],
    level: str,
    wanted: float,
    vector: Array,
    true: Coordinates,
    ours: Gradient,
) -> tuple[Entry, Competitor]:
    """The competitor at the loosest tolerance with which it errs by no more than wanted and is right.

    If there is none, with its reason to fail at the tightest.
    """
    entered: tuple[Entry, Competitor] | None = None
    for tolerance in TOLERANCES:
        one = make(tolerance)
        try:
            found = error(one.coordinates(vector), true, one.problem)
        except RuntimeError:  # CasADi's when an integration fails
            found = np.inf
        _say(f"{one.name}, {one.settings}: {found:.2g} counts")
        if not found <= wanted:
            continue
        entered = _judged(partial(make, tolerance), level, vector, true, ours)
        _say(f"  {entered[0]}")
        if not entered[0].failure:
            return entered
    if entered is None:
        nowhere = Entry(one.name, level, "any", np.inf, np.inf, np.nan, np.nan, np.nan)
        nowhere.failure = "not this accurate at any tolerance tried"
        return nowhere, one
    return entered


def _prior_median(problem: Problem) -> Float[Array, " n"]:
    """A point far from the mode."""
    values = {
        name: jnp.median(problem.data.priors[name].sample(jax.random.key(0), (2001,)), axis=0)
        for name, _ in problem.layout.shapes
    }
    return unconstrain(values, problem.layout, problem.data)


def run() -> dict:
    """Check every competitor, time those that are right."""
    problem = posed()
    vector = reference_point(problem)
    true = reference(problem, vector)
    begun = time.perf_counter()
    ours = Ours(problem)
    exact = ours(vector)
    first = time.perf_counter() - begun
    own = error(ours.coordinates(vector), true, problem)
    entered: list[tuple[Entry, Competitor]] = [
        (Entry(ours.name, "own", ours.settings, own, 0.0, 0.0, 0.0, first), ours),
        _judged(partial(CFloor, problem), "own", vector, true, exact),
    ]
    wanted = {"equal": own, "coarse": COARSE_ERROR}
    for level, limit in wanted.items():
        for kind in (GenericDiffrax, ReverseDiffrax, CasadiCvodes, Lsoda):
            make = partial(kind, problem, damping_for(limit))
            entered.append(_entered(make, level, limit, vector, true, exact))
    right = {f"{e.competitor}/{e.level}": (e, one) for e, one in entered if not e.failure}
    calls: dict[str, Callable[[], object]] = {
        name: partial(one, vector) for name, (_, one) in right.items()
    }
    floor = CFloor(problem)
    inputs = list(zip(floor.lanes, floor.inputs(vector), strict=True))
    calls["C loop alone"] = lambda: [floor.sensitivities(*pair) for pair in inputs]
    calls["our simulation alone"] = partial(ours.sensitivities, vector)
    away = _prior_median(problem)
    calls["ours, prior median"] = partial(ours, away)
    calls["floor, prior median"] = partial(floor, away)
    measured = timings(calls)
    for name, (entry, _) in right.items():
        entry.timing = measured[name]
    others = ("C loop alone", "our simulation alone", "ours, prior median", "floor, prior median")
    return {
        "machine": machine(PACKAGES),
        "intervals": [lane.intervals for lane in floor.lanes],
        "unknowns": int(vector.size),
        "own_error": own,
        "coarse_error": COARSE_ERROR,
        "references_apart": error(independent(problem, vector), true, problem),
        "agreement": AGREEMENT,
        "density_tolerance": DENSITY_TOLERANCE,
        "gradient_tolerance": GRADIENT_TOLERANCE,
        "entries": [
            asdict(entry) | {"timing": entry.timing and entry.timing._asdict()}
            for entry, _ in entered
        ],
        "others": {name: measured[name]._asdict() for name in others},
    }


def main() -> None:
    """Run, and write the results."""
    with jax.enable_x64(True):
        results = run()
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "gradient.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
