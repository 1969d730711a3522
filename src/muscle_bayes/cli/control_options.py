"""What `robustness` and `tune` share: posterior, joint, heater, draws."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from muscle_bayes.control.draws import JointDraws

PosteriorArgument = Annotated[
    Path, typer.Argument(metavar="POSTERIOR.nc", help="Of a muscle, by `muscle-bayes fit`.")
]
HeaterOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--heater",
        metavar="RUN",
        help="Run whose temperatures identify the heater's gain, cooling and lag; repeatable.",
    ),
]
FixtureOption = Annotated[
    Path | None,
    typer.Option(
        "--fixture",
        metavar="FIXTURE.nc",
        help="J and D from this posterior, with its friction; the thesis' study had linear.",
    ),
]
JointOption = Annotated[
    Path | None,
    typer.Option("--joint", metavar="JOINT.toml", help="Geometry and sensors; default: the bench."),
]


def load_joints(
    posterior: Path,
    heater: list[Path] | None,
    fixture: Path | None,
    joint: Path | None,
    count: int,
    seed: int,
) -> tuple["JointDraws", list[str]]:
    """Draws of joints, and what has to be told about where they come from."""
    from muscle_bayes.control.design import Design, read_design
    from muscle_bayes.control.draws import joint_draws
    from muscle_bayes.control.heater_fit import assumed_heater, fit_heater
    from muscle_bayes.data import read_runs
    from muscle_bayes.inference.posteriors.posterior import Posterior

    fitted = Posterior.load(posterior)
    bearing = None if fixture is None else Posterior.load(fixture)
    tubes = fit_heater(read_runs(heater), seed=seed) if heater else assumed_heater(seed)
    untold = [name for name, told in tubes.told.items() if not told]
    notes = [
        f"heater {tubes.source}" + (f"; not identified: {', '.join(untold)}" if untold else "")
    ]
    notes.append("loops are simulated; no joint was measured")
    for one, path in ((fitted, posterior), (bearing, fixture)):
        if one is not None and not one.converged:
            notes.append(f"{path} HAS NOT CONVERGED: {'; '.join(one.complaints)}")
    design = Design() if joint is None else read_design(joint)
    draws = joint_draws(fitted, tubes.draws, count, design=design, fixture=bearing, seed=seed)
    return draws, notes
