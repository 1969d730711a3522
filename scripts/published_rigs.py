"""Fit the measured rigs and write docs/real-rigs.md: our posteriors beside published fits.

python scripts/published_rigs.py FOLDER, with the folders xl330-drop, emps and heating-wire in it.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from muscle_bayes.criticism.compare import compare
from muscle_bayes.data import read_run, read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.predictive import predict_runs
from muscle_bayes.inference.posteriors.summary import summarise
from muscle_bayes.inference.sampling.fit import QUICK, fit
from muscle_bayes.progress import shown_progress

PAGE = Path(__file__).parents[1] / "docs" / "real-rigs.md"
KEPT = Path(__file__).parents[1] / "reports" / "posteriors"
CYCLE = 158.6
"""End of the heated wire's first cycle, s."""


@dataclass(frozen=True)
class Published:
    """A published value, as the range in which ours is wanted."""

    parameter: str
    unit: str
    text: str
    low: float
    high: float


def about(parameter: str, unit: str, value: float, share: float) -> Published:
    """A published value with a relative tolerance; its sign is that of its own convention."""
    text = f"{value:g} (within {share:.0%})"
    return Published(parameter, unit, text, value * (1.0 - share), value * (1.0 + share))


XL330 = (
    Published("J", "kg m^2", "1.5e-3 to 1.8e-3 (within 30 %)", 0.7 * 1.5e-3, 1.3 * 1.8e-3),
    Published("D", "N m", "0.0070 to 0.0161", 0.0070, 0.0161),
    Published("viscous-friction.coefficient", "N m s", "0.0037 to 0.0182", 0.0037, 0.0182),
)
EMPS = (
    about("J", "kg", 95.1089, 0.03),
    about("viscous-friction.coefficient", "N s/m", 203.5034, 0.03),
    about("D", "N", 20.3935, 0.10),
    about("bias-torque.torque", "N", 3.1648, 0.20),
)


def fitted(name: str, runs: Any, effects: tuple[str, ...]) -> Posterior:
    """The posterior, kept for a look at it later."""
    with shown_progress() as report:
        posterior = fit(runs, "coulomb", effects, effort=QUICK, report=report)
    posterior.save(KEPT / f"{name}.nc")
    return posterior


def table(posterior: Posterior, published: tuple[Published, ...]) -> list[str]:
    """Our intervals beside the published values."""
    rows = [
        "| parameter | posterior mean | 5 % | 95 % | published | inside |",
        "|---|---|---|---|---|---|",
    ]
    found = summarise(posterior)["parameters"]
    for one in published:
        row = found[one.parameter]
        inside = "yes" if one.low <= row["mean"] <= one.high else "no"
        rows.append(
            f"| {one.parameter} [{one.unit}] | {row['mean']:.5g} | {row['q05']:.5g} "
            f"| {row['q95']:.5g} | {one.text} | {inside} |"
        )
    return [*rows, "", verdict(posterior), ""]


def verdict(posterior: Posterior) -> str:
    """Whether the chains converged, and if not, why not."""
    if posterior.converged:
        return "Converged."
    reasons = [f"- {one[0].upper()}{one[1:]}." for one in posterior.complaints]
    return "\n".join(["Not converged:", "", *reasons])


def wire(folder: Path) -> list[str]:
    """The heated wire's second cycle, predicted from its first."""
    path = folder / "heating-wire" / "two-cycles-200g.csv"
    run = read_run(path)
    posterior = fitted("heating-wire", [run.until(CYCLE)], ())
    (one,) = predict_runs(posterior, [run], seed=1)
    ahead = one.time > CYCLE
    ours = np.sqrt(np.mean((one.model.mean(axis=0) - one.observed)[ahead] ** 2))
    log = run.table
    parts = log[log.time < CYCLE], log[log.time >= CYCLE]
    cubics = [np.polyfit(part.temperature_a, part.reading, 3) for part in parts]
    second = parts[1]
    first_cubic, own_cubic = (
        np.sqrt(np.mean((np.polyval(cubic, second.temperature_a) - second.reading) ** 2))
        for cubic in cubics
    )
    return [
        "| prediction of the second cycle | RMSE [mm] |",
        "|---|---|",
        f"| ours, fitted to the first cycle | {ours:.4f} |",
        f"| static cubic of temperature, fitted to the first cycle | {first_cubic:.4f} |",
        f"| static cubic of temperature, fitted to the second cycle itself | {own_cubic:.4f} |",
        "",
        verdict(posterior),
        "",
    ]


def main(folder: Path) -> None:
    both = ("viscous-friction", "bias-torque")
    servo = fitted("xl330-drop", read_runs([folder / "xl330-drop"]), both)
    axis_runs = read_runs([folder / "emps"])
    axis = fitted("emps", axis_runs, both)
    bare = fitted("emps-no-viscous", axis_runs, both[1:])
    score = compare(axis, bare)
    lines = [
        "# Measured rigs: our posteriors beside published fits",
        "",
        "Written by `make real` from measurements that are not part of this project. "
        "Terms: [glossary](glossary.md).",
        "",
        "## Servo with a pendulum (xl330-drop)",
        "",
        *table(servo, XL330),
        "J is the inertia beyond m l^2; the mass of the arm was not recorded and is part of ours.",
        "",
        "## Driven ball-screw axis (emps)",
        "",
        *table(axis, EMPS),
        "The published offset counts as friction, ours as an applied force: their signs differ.",
        "",
        f"Without viscous friction the expected log predictive density falls by "
        f"{score.elpd_difference:.0f} ± {score.se:.0f} nat.",
        "",
        "## Heated wire (heating-wire)",
        "",
        *wire(folder),
    ]
    PAGE.write_text("\n".join(lines))


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]))
    except MuscleBayesError as error:
        print(f"Error: {error}", file=sys.stderr)
        sys.exit(2)
