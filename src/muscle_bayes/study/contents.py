"""What the report's template is given: sentences, tables and figures, section by section."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from muscle_bayes.report import tables, words
from muscle_bayes.report.words import plural
from muscle_bayes.study.answers import answers
from muscle_bayes.study.published import values_of
from muscle_bayes.study.results import Numbers, Results
from muscle_bayes.study.stages import LeftOut

LEFT_OUT_OF_QUICK = (
    "The quick preset asks for fewer draws of every posterior and tunes gains on fewer joints and "
    "scenarios than the full one."
)


def contents(results: Results, left_out: Sequence[LeftOut]) -> dict[str, Any]:
    """REPORT.json. A section that does not apply is null; `left_out` tells why."""
    plan = results.plan
    return {
        "title": plan.config.title or f"Study of {plural(len(plan.logs), 'run')}",
        "synthetic": results.origins == ["synthetic"],
        "notice": words.notice(results.origins),
        "about": plan.config.about,
        "preset": plan.preset,
        "seed": str(plan.config.seed),
        "command": plan.started_as,
        "shortened": LEFT_OUT_OF_QUICK if plan.preset == "quick" else "",
        "left_out": [{"name": one.name, "why": one.why} for one in left_out],
        "answers": answers(results),
        "runs": tables.runs(results.stages["data"]["runs"], _roles(results)),
        "shown_runs": [*plan.roles.held_out[-1:], *plan.roles.fitted[-1:]][:1],
        "fixture": _fixture(results),
        "muscle": _muscle(results),
        "checks": tables.checks(results.checks),
        "predicted": _predicted(results),
        "drift": [
            {"run": name, "told": words.creep(name, one), "table": tables.creep(one)}
            for name, one in results.drifts.items()
        ],
        "discovery": _discovery(results),
        "control": _control(results),
        "calibration": _calibration(results),
        "figures": _figures(results),
        "residuals": {
            name: one["residuals"] for name, one in results.checks.items() if "residuals" in one
        },
        "versions": [[name, str(one)] for name, one in results.versions.items()],
        "checksums": [
            [name, run["checksum_sha256"]] for name, run in results.stages["data"]["runs"].items()
        ],
    }


def _roles(results: Results) -> dict[str, str]:
    roles = results.plan.roles
    told = dict.fromkeys(roles.fixture, "fixture") | dict.fromkeys(roles.muscle, "muscle")
    told |= dict.fromkeys(roles.held_out, "held out")
    told |= {name: f"fitted until {end:g} s" for name, end in roles.until.items()}
    return {name: told.get(name, "described only") for name in results.plan.logs}


def _predicted(results: Results) -> list[str]:
    """Runs whose predictions the report draws: held out, or one of the fixture's and of the muscle's."""
    roles = results.plan.roles
    chosen = roles.held_out or (*roles.fixture[:1], *roles.muscle[:1])
    return [name for name in chosen if name in results.checks]


def _fit(results: Results, name: str, of: tuple[str, ...]) -> dict[str, Any]:
    """Table of a fit beside the values printed for it, and what its chains say."""
    summary, plan = results.summaries[name], results.plan
    values = values_of(plan.published, *of)
    printed = next((one.name for one in plan.published if one.of == of[-1]), None)
    return {
        "table": tables.parameters(summary, results.posteriors[name].units, printed, values),
        "converged": words.converged(f"the fit {name}", summary),
        "printed": [
            text
            for one in plan.published
            if one.of in of and (text := words.printed(summary["parameters"], one.values, one.name))
        ],
    }


def _figures(results: Results) -> dict[str, Any]:
    """Figures with the smaller of vector and picture for the HTML."""
    out = results.plan.out
    return {
        key: one
        | {"html": min(("svg", "png"), key=lambda kind: _size(out / f"{one['path']}.{kind}"))}
        for key, one in results.figures.items()
    }


def _size(path: Path) -> float:
    return path.stat().st_size if path.exists() else float("inf")


def _undetermined(found: Numbers, given: Sequence[str] = ()) -> dict[str, Any]:
    """What the data do not identify; what other runs have given is left out."""
    known = found["identifiability"]
    return {
        "directions": [
            one["words"]
            for one in known["directions"]
            if one["undetermined"] and next(iter(one["loadings"]), "") not in given
        ],
        "trade_offs": [
            f"{a} and {b}: {r:+.2f}".replace("-", "−") for a, b, r in known["trade_offs"]
        ],
    }


def _fixture(results: Results) -> dict[str, Any] | None:
    found = results.stages.get("fixture-checks")
    if found is None:
        return None
    laws = {law: _fit(results, f"fixture-{law}", (law,)) for law in ("coulomb", "linear")}
    friction = results.friction
    return {
        **laws,
        "law": results.plan.config.friction,
        "friction": "" if friction is None else words.friction(friction),
        "undetermined": _undetermined(found),
    }


def _muscle(results: Results) -> dict[str, Any] | None:
    found = results.stages.get("muscle-checks")
    if found is None:
        return None
    fit = _fit(results, "muscle", (results.plan.config.friction, "muscle"))
    given = ("J", "D") if results.plan.roles.fixture else ()
    inertia = [
        words.inertia(name, run)
        for name, run in results.summaries["muscle"]["runs"].items()
        if run.get("inertia") is not None
    ]
    return {**fit, "inertia": inertia, "undetermined": _undetermined(found, given)}


def _discovery(results: Results) -> dict[str, Any]:
    found, revised = results.stages["discovery"], results.stages["revised"]
    roles = results.plan.roles
    told = {
        "told": found["told"],
        "located": words.located(found),
        "windows": tables.windows(found),
        "probabilities": tables.probabilities(found),
        "tried": ", ".join(found["tried"]),
        "ties": [", ".join(tie) for tie in found["ties"]],
        "steps": [
            {
                "told": words.step(step),
                "table": tables.added(step, found["noise_floor"]),
                "weakened": ", ".join(step["undetermined"]),
            }
            for step in found["steps"]
        ],
        "ending": words.ending(found),
        "revision": words.revision(revised),
        "revised": None,
        "shown": (roles.held_out[-1:] or roles.fitted[-1:]) if found["steps"] else (),
    }
    if "revised" in results.posteriors:
        of = (results.plan.config.friction, "muscle")
        told["revised"] = _fit(results, "revised", of)["table"]
    return told


def _control(results: Results) -> dict[str, Any] | None:
    found = results.stages.get("control")
    if found is None:
        return None
    return {
        "told": " ".join(found["answers"]),
        "notes": found["notes"],
        "how": words.tuning(found),
        "gains": tables.gains(found),
        "risks": tables.risks(found),
        "figures": list(found["figures"]),
    }


def _calibration(results: Results) -> dict[str, Any]:
    found = results.stages["calibration"]
    made = {"trial": tables.trial, "gradient": tables.gradient, "sampling": tables.sampling}
    told: dict[str, Any] = {
        name: None if found.get(name) is None else build(found[name])
        for name, build in made.items()
    }
    trial = found.get("trial")
    told["trial_size"] = "" if trial is None else f"{trial['cases']} cases were searched."
    told["sbc"] = tables.sbc(found["sbc"]) if found["sbc"] else None
    told["sbc_figures"] = [f"sbc-{name}" for name in found["sbc"]]
    return told
