"""The study's summary: numbers as JSON, figures as PNG, and a page that a person reads."""

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from muscle_bayes.criticism.compare import compare
from muscle_bayes.criticism.coverage import check_run
from muscle_bayes.criticism.drift import drift
from muscle_bayes.inference.identifiability import identify
from muscle_bayes.inference.predictive import predict_from_prior, predict_runs
from muscle_bayes.inference.summary import summarise
from muscle_bayes.report.posterior_figures import posterior_figure
from muscle_bayes.report.predictive_figures import (
    drift_figure,
    predictive_figure,
    prior_predictive_figure,
)
from muscle_bayes.report.style import save
from muscle_bayes.study.published import TABLE_1, TABLE_2

if TYPE_CHECKING:
    from muscle_bayes.study.pipeline import Study

Numbers = dict[str, Any]


def write_report(study: "Study") -> None:
    """Write summary.json, figures/ and summary.md of a study whose fits are done."""
    numbers = _numbers(study)
    study.out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(numbers, indent=1, default=float)
    (study.out / "summary.json").write_text(text + "\n")
    (study.out / "summary.md").write_text(_page(numbers))


def _numbers(study: "Study") -> Numbers:
    coulomb, linear = study.posterior("fixture-coulomb"), study.posterior("fixture-linear")
    muscle = study.posterior("muscle")
    figures = study.out / "figures"
    save(posterior_figure(coulomb, TABLE_1["coulomb"], "fixture"), figures / "fixture.png")
    save(posterior_figure(muscle, TABLE_1["coulomb"] | TABLE_2, "muscle"), figures / "muscle.png")
    origin = {run.name: run.metadata.origin for run in study.runs}
    staircases, sawtooths = study.of_protocol("staircase"), study.of_protocol("sawtooth")
    for name, runs in (("fixture", study.of_protocol("spring")), ("muscle", staircases)):
        # All runs as in the fit, for the programs compiled there; two are enough to look at.
        prior = predict_from_prior(runs, seed=study.seed)
        figure = prior_predictive_figure(prior[:2], origin[runs[0].name])
        save(figure, figures / f"prior-{name}.png")
    checks, drifts = {}, {}
    for runs, source in ((study.of_protocol("spring"), coulomb), (staircases + sawtooths, muscle)):
        for prediction in predict_runs(source, runs, seed=study.seed) if runs else ():
            check = check_run(prediction)
            checks[prediction.run] = check.as_dict()
            figure = predictive_figure(prediction, check, origin[prediction.run])
            save(figure, figures / f"{prediction.run}.png")
            if prediction.run in {run.name for run in sawtooths}:
                found = drift(prediction, study.seed)
                drifts[prediction.run] = found.as_dict()
                figure = drift_figure(prediction, found, origin[prediction.run])
                save(figure, figures / f"{prediction.run}-drift.png")
    return {
        "origin": sorted(set(origin.values())),
        "preset": study.preset,
        "seed": study.seed,
        "checksums": {run.name: run.checksum for run in study.runs},
        "versions": json.loads(muscle.tree.attrs["versions"]),
        "fixture": {"coulomb": summarise(coulomb), "linear": summarise(linear)},
        "friction": compare(coulomb, linear).as_dict(),
        "muscle": summarise(muscle),
        "identifiability": {
            "fixture": identify(coulomb).text(),
            "muscle": identify(muscle).text(),
        },
        "checks": checks,
        "held_out": [run.name for run in sawtooths],
        "drift": drifts,
    }


def _parameter_table(summary: Numbers, published: Mapping[str, float]) -> list[str]:
    rows = [
        "| parameter | posterior mean | 5 % | 95 % | thesis | inside 90 % | R-hat | ESS |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, row in summary["parameters"].items():
        value = published.get(name)
        inside = "" if value is None else "yes" if row["q05"] <= value <= row["q95"] else "no"
        shown = "" if value is None else f"{value:.6g}"
        rows.append(
            f"| {name} | {row['mean']:.6g} | {row['q05']:.6g} | {row['q95']:.6g} | {shown} "
            f"| {inside} | {row['rhat']:.3f} | {row['ess_bulk']:.0f} |"
        )
    return rows


def _verdict(summary: Numbers) -> str:
    if summary["converged"]:
        return "The chains converged."
    return "**The chains have not converged:** " + "; ".join(summary["complaints"]) + "."


def _inertia_lines(summary: Numbers) -> list[str]:
    lines = []
    for name, run in summary["runs"].items():
        if (inertia := run.get("inertia")) is not None:
            kept = "kept" if inertia["kept"] else "left out"
            if not math.isfinite(inertia["rms"]):
                lines.append(
                    f"- {name}: what leaving out the rotor's inertia changes is not known."
                )
                continue
            lines.append(
                f"- {name}: the rotor's inertia is {kept}; leaving it out changes readings by "
                f"{inertia['rms']:.2g} {run['unit']} RMS, at most {inertia['largest']:.2g}."
            )
    return [*lines, ""] if lines else []


def _check_table(numbers: Numbers) -> list[str]:
    rows = [
        "| run | held out | RMSE | unit | 50 % covers | 90 % covers |",
        "|---|---|---|---|---|---|",
    ]
    for name, check in numbers["checks"].items():
        held = "yes" if name in numbers["held_out"] else "no"
        rows.append(
            f"| {name} | {held} | {check['rmse']:.3g} | {check['unit']} "
            f"| {check['coverage50']:.0%} | {check['coverage90']:.0%} |"
        )
    return rows


def _drift_lines(numbers: Numbers) -> list[str]:
    lines: list[str] = []
    for name, found in numbers["drift"].items():
        unit, overall = found["unit"], found["slope_difference"]
        if overall is None:
            lines += [f"{name}: {found['reason']}", ""]
            continue
        lines += [
            f"{name}, measured minus predicted slope while cold: {overall['mean']:+.3g} "
            f"[{overall['q05']:+.3g}, {overall['q95']:+.3g}] {unit}/min (90 % interval).",
            "",
            f"| from [s] | to [s] | load [kg] | measured [{unit}/min] | predicted "
            f"| difference, 90 % | shift, measured - predicted [{unit}], 90 % |",
            "|---|---|---|---|---|---|---|",
        ]
        for phase in found["phases"]:
            slope, shift = phase["slope"], phase["shift"]
            lines.append(
                f"| {phase['start']:.0f} | {phase['end']:.0f} | {phase['load']:.3g} "
                f"| {slope['measured']:.3g} | {slope['predicted']['mean']:.3g} "
                f"| {_interval(slope['difference'])} | {_interval(shift['difference'])} |"
            )
        lines += ["", f"![Drift of {name}](figures/{name}-drift.png)", ""]
    return lines


def _interval(estimate: Numbers) -> str:
    return f"{estimate['mean']:+.3g} [{estimate['q05']:+.3g}, {estimate['q95']:+.3g}]"


def _page(numbers: Numbers) -> str:
    synthetic = "synthetic" in numbers["origin"]
    friction = numbers["friction"]
    lines = [
        "# Study: fixture, muscle and held-out sawtooth",
        "",
        "**These data are SYNTHETIC: written by an independent simulator, not measured.**"
        if synthetic
        else "Measured data.",
        f"Preset {numbers['preset']}, seed {numbers['seed']}. Written by `make study`; "
        "every number here comes from `summary.json` beside it.",
        "",
        "## Fixture, Coulomb friction",
        "",
        *_parameter_table(numbers["fixture"]["coulomb"], TABLE_1["coulomb"]),
        "",
        _verdict(numbers["fixture"]["coulomb"]),
        "",
        "![Fixture posterior](figures/fixture.png)",
        "",
        "## Coulomb against linear friction",
        "",
        f"Expected log predictive density, Coulomb minus linear: "
        f"{friction['elpd_difference']:.1f} +- {friction['se']:.1f}; better: "
        f"**{friction['better']}**.",
        "",
        *_parameter_table(numbers["fixture"]["linear"], TABLE_1["linear"]),
        "",
        _verdict(numbers["fixture"]["linear"]),
        "",
        "## Muscle",
        "",
        *_parameter_table(numbers["muscle"], TABLE_1["coulomb"] | TABLE_2),
        "",
        _verdict(numbers["muscle"]),
        "",
        *_inertia_lines(numbers["muscle"]),
        "![Muscle posterior](figures/muscle.png)",
        "",
        "What the data do not tell:",
        "",
        "```text",
        numbers["identifiability"]["muscle"],
        "```",
        "",
        "## Predictions against readings",
        "",
        *_check_table(numbers),
        "",
        *(f"![{name}](figures/{name}.png)\n" for name in numbers["checks"]),
        "## What the priors alone allow",
        "",
        "![Prior predictive, spring](figures/prior-fixture.png)",
        "",
        "![Prior predictive, staircase](figures/prior-muscle.png)",
        "",
        "## Drift of HYST at room temperature, held-out sawtooth",
        "",
        *_drift_lines(numbers),
        "## Made with",
        "",
        ", ".join(f"{name} {number}" for name, number in numbers["versions"].items()) + ".",
        "",
        *(f"- `{name}`: sha256 {checksum}" for name, checksum in numbers["checksums"].items()),
        "",
    ]
    return "\n".join(lines)
