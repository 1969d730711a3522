"""What the report's template is given: sentences, tables and figures, section by section."""

from collections.abc import Sequence
from typing import Any

from muscle_bayes.study import tables, words
from muscle_bayes.study.numbers import plural
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
        "abstract": [text for text in _abstract(results) if text],
        "runs": tables.runs(results.stages["data"]["runs"], _roles(results)),
        "shown_runs": _one_of_each(results),
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
        "figures": results.figures,
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


def _one_of_each(results: Results) -> list[str]:
    """The first run of each protocol."""
    seen: dict[str, str] = {}
    for name, run in results.stages["data"]["runs"].items():
        seen.setdefault(run["protocol"], name)
    return list(seen.values())


def _predicted(results: Results) -> list[str]:
    """Runs whose predictions the report draws: one of the fixture's, and all of the muscle."""
    roles = results.plan.roles
    chosen = [*roles.fixture[:1], *roles.muscle, *roles.held_out]
    return [name for name in chosen if name in results.checks]


def _abstract(results: Results) -> list[str]:
    roles, fits = results.plan.roles, results.summaries
    told = [
        f"This report is about {plural(len(results.plan.logs), 'run')}: {len(roles.fixture)} without a "
        f"muscle and {len(roles.muscle)} with one were fitted, {len(roles.held_out)} held out."
    ]
    told += [
        words.converged(f"the fit {name}", one)
        for name, one in fits.items()
        if not one["converged"]
    ]
    if all(one["converged"] for one in fits.values()):
        told.append(f"The chains of all {len(fits)} fits converged.")
    for printed in results.plan.published:
        fit = "muscle" if printed.of == "muscle" else f"fixture-{printed.of}"
        if fit in fits:
            where = f"{printed.name} of {printed.source}"
            told.append(words.printed(fits[fit]["parameters"], printed.values, where))
    if results.friction is not None:
        told.append(words.friction(results.friction))
    told += [words.prediction(name, results.checks[name]) for name in roles.held_out]
    told += [words.creep(name, one) for name, one in results.drifts.items()]
    told.append(results.stages["discovery"]["told"])
    if (control := results.get("control")) is not None:
        told.append(words.gains(control))
    return told


def _fit(results: Results, name: str, of: tuple[str, ...]) -> dict[str, Any]:
    """Table of a fit beside the values printed for it, and what its chains say."""
    summary, plan = results.summaries[name], results.plan
    values = values_of(plan.published, *of)
    printed = next((one for one in plan.published if one.of == of[-1]), None)
    return {
        "table": tables.parameters(summary, results.units(name), printed, values),
        "converged": words.converged(f"the fit {name}", summary),
        "printed": [
            text
            for one in plan.published
            if one.of in of and (text := words.printed(summary["parameters"], one.values, one.name))
        ],
    }


def _untold(found: Numbers) -> dict[str, Any]:
    """What the data cannot tell."""
    known = found["identifiability"]
    return {
        "directions": [one["words"] for one in known["directions"] if one["undetermined"]],
        "trade_offs": [
            f"{a} and {b}: {r:+.2f}".replace("-", "−") for a, b, r in known["trade_offs"]
        ],
    }


def _fixture(results: Results) -> dict[str, Any] | None:
    found = results.get("fixture-checks")
    if found is None:
        return None
    laws = {law: _fit(results, f"fixture-{law}", (law,)) for law in ("coulomb", "linear")}
    friction = results.friction
    return {
        **laws,
        "law": results.plan.config.friction,
        "friction": "" if friction is None else words.friction(friction),
        "untold": _untold(found),
    }


def _muscle(results: Results) -> dict[str, Any] | None:
    found = results.get("muscle-checks")
    if found is None:
        return None
    fit = _fit(results, "muscle", (results.plan.config.friction, "muscle"))
    inertia = [
        words.inertia(name, run)
        for name, run in results.summaries["muscle"]["runs"].items()
        if run.get("inertia") is not None
    ]
    return {**fit, "inertia": inertia, "untold": _untold(found)}


def _discovery(results: Results) -> dict[str, Any]:
    found, revised = results.stages["discovery"], results.stages["revised"]
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
        "shown": results.plan.roles.held_out[-1:] or results.plan.roles.fitted[-1:],
    }
    if "revised" in results.posteriors:
        of = (results.plan.config.friction, "muscle")
        told["revised"] = _fit(results, "revised", of)["table"]
    return told


def _control(results: Results) -> dict[str, Any] | None:
    found = results.get("control")
    if found is None:
        return None
    return {
        "told": words.gains(found),
        "notes": found["notes"],
        "how": words.tuning(found),
        "gains": tables.gains(found),
        "risks": tables.risks(found),
        "scenarios": [row["scenario"] for row in found["rows"]],
    }


def _calibration(results: Results) -> dict[str, Any]:
    found = results.stages["calibration"]
    made = {"trial": tables.trial, "gradient": tables.gradient, "sampling": tables.sampling}
    told: dict[str, Any] = {
        name: None if found.get(name) is None else build(found[name])
        for name, build in made.items()
    }
    told["sbc"] = tables.sbc(found["sbc"]) if found["sbc"] else None
    told["sbc_figures"] = [f"sbc-{name}" for name in found["sbc"]]
    return told
