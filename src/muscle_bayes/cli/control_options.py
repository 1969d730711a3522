"""What `robustness` and `tune` share: population, joint, heater, draws, scenarios, specifications."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muscle_bayes.cli.common import option
from muscle_bayes.errors import MuscleBayesError, did_you_mean

if TYPE_CHECKING:
    from muscle_bayes.control.plant.draws import JointDraws
    from muscle_bayes.control.scenarios.scenario import Scenario

PosteriorArgument = Annotated[
    Path,
    typer.Argument(
        metavar="MUSCLE.nc",
        help="Population, by `muscle-bayes population`, or posterior of one muscle, by `muscle-bayes fit`.",
    ),
]
HeaterOption = Annotated[
    list[Path] | None,
    option(
        "RUN",
        "Run whose temperatures identify the heater's gain, cooling and lag; repeatable.",
        "--heater",
    ),
]
FixtureOption = Annotated[
    Path | None,
    option(
        "FIXTURE.nc",
        "J, D and friction from this posterior; default: as the muscle was fitted.",
        "--fixture",
    ),
]
JointOption = Annotated[
    Path | None, option("JOINT.toml", "Geometry and sensors; default: the bench.", "--joint")
]
ScenarioOption = Annotated[
    list[str] | None, option("NAME", "Only these scenarios, a file's or by name; repeatable.")
]
SpecOption = Annotated[
    list[str] | None,
    option("METRIC=LIMIT", "At most this where a scenario has it, in SI units; repeatable."),
]


def load_joints(
    muscle: Path,
    heater: list[Path] | None,
    fixture: Path | None,
    joint: Path | None,
    count: int,
    seed: int,
) -> tuple["JointDraws", list[str]]:
    """Draws of joints, and what has to be told about where they come from."""
    from muscle_bayes.control.plant.design import Design, read_design
    from muscle_bayes.control.plant.draws import joint_draws
    from muscle_bayes.control.plant.heater_fit import assumed_heater, fit_heater
    from muscle_bayes.data import read_runs
    from muscle_bayes.inference.population import load_population
    from muscle_bayes.inference.posteriors.posterior import Posterior

    population, notes = load_population(muscle)
    bearing = None if fixture is None else Posterior.load(fixture)
    tubes = fit_heater(read_runs(heater), seed=seed) if heater else assumed_heater(seed)
    notes.append(tubes.note())
    notes.append("loops are simulated; no joint was measured")
    if bearing is not None and not bearing.converged:
        notes.append(f"{fixture} HAS NOT CONVERGED: {'; '.join(bearing.complaints)}")
    design = Design() if joint is None else read_design(joint)
    draws = joint_draws(population, tubes.draws, count, design=design, fixture=bearing, seed=seed)
    return draws, notes


def chosen_scenarios(
    names: list[str] | None, period: float, called: str = "--scenario"
) -> "list[Scenario]":
    """Scenarios by name or from files; the thesis' nine where none is named.

    `called` is what the command calls them.
    """
    from muscle_bayes.control.scenarios.scenario_file import read_scenario
    from muscle_bayes.control.scenarios.thesis import harder_scenarios, thesis_scenarios

    standard = list(thesis_scenarios(period))
    known = {one.name: one for one in (*standard, *harder_scenarios(period))}
    chosen = []
    for name in names or []:
        if name in known:
            chosen.append(known[name])
        elif name.endswith(".toml"):
            chosen.append(read_scenario(Path(name), period))
        else:
            raise MuscleBayesError(
                f"{called} {name} is not known.{did_you_mean(name, known)} "
                f"Fix: use a file, or one of {', '.join(known)}."
            )
    return chosen or standard


def chosen_limits(texts: list[str] | None) -> dict[str, float]:
    """Limits from METRIC=LIMIT. Raises MuscleBayesError where one is none."""
    from muscle_bayes.control.judging.specification import HOTTEST, STEP_WANTED, TRACKING_WANTED

    known = {*STEP_WANTED, *TRACKING_WANTED, "peak_temperature"}
    limits = {}
    for text in texts or []:
        name, _, number = text.partition("=")
        try:
            limit = float(number)
        except ValueError:
            limit = -1.0
        if name not in known:
            raise MuscleBayesError(
                f"--spec {text}: unknown metric {name!r}.{did_you_mean(name, known)} "
                "Fix: use settling_time or recovery_time [s], overshoot or steady_error [rad], "
                "tracking [1], peak_temperature [C]."
            )
        if not 0.0 < limit < float("inf"):
            raise MuscleBayesError(
                f"--spec {text}: the limit is no positive number. "
                f"Fix: write METRIC=LIMIT, such as peak_temperature={HOTTEST:g}."
            )
        limits[name] = limit
    return limits
