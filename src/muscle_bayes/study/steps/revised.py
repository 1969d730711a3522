"""The posterior of the model with the effects that discovery added."""

import hashlib

from muscle_bayes.discovery.nominal import seen_parts
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.summary import summarise
from muscle_bayes.inference.records.open_delay import with_open_delay
from muscle_bayes.inference.sampling.fit import EFFORTS, fit
from muscle_bayes.json_file import write_json
from muscle_bayes.progress import Report
from muscle_bayes.report.posterior_figures import forest_figure
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.published import middles, values_of
from muscle_bayes.study.stages import base_fits
from muscle_bayes.study.steps.figures import Drawn, origin_of
from muscle_bayes.study.steps.fit import rotor_effects


def make(plan: Plan, name: str, report: Report) -> None:
    """Write results/revised.json, and posteriors/revised.nc if effects were found.

    Effects that act on a muscle alone are fitted to the muscle's runs with the fixture's J and D as
    prior, others to all runs together. Of held-out runs the first part is fitted, as discovery did: an
    effect may show there alone.
    """
    effects = tuple(plan.found("effects")["effects"])
    before = base_fits(plan)[-1]
    roles = plan.roles
    nominal_effects = with_open_delay(plan.runs(roles.fitted), plan.config.effects)
    if effects == nominal_effects:
        write_json(plan.result(name), {"fit": before, "effects": list(effects), "figures": {}})
        return
    apart = bool(roles.fixture and roles.muscle and not rotor_effects(effects))
    seen = seen_parts(plan.fitted((*roles.fitted, *roles.held_out)), roles.held_out)
    runs = [run for run in seen if run.has_muscle] if apart else seen
    friction = plan.config.friction
    posterior = fit(
        runs,
        friction,
        effects,
        effort=EFFORTS[plan.preset],
        given=Posterior.load(plan.posterior(f"fixture-{friction}")) if apart else None,
        seed=plan.config.seed,
        report=report,
    )
    posterior.save(plan.posterior("revised"))
    drawn = Drawn(plan)
    nominal = Posterior.load(plan.posterior(before))
    printed = middles(values_of(plan.published, friction, "muscle"))
    drawn.add(
        "forest",
        forest_figure({"nominal": nominal, "revised": posterior}, printed),
        f"What adding {' and '.join(effects)} does to the parameters: before (circles) and after "
        "(squares), median, 50 and 90 % intervals."
        + (" Dashed: the published value." if printed else ""),
        origin_of(runs),
    )
    # The checksum tells later stages that the posterior is another one.
    checksum = hashlib.sha256(plan.posterior("revised").read_bytes()).hexdigest()
    write_json(
        plan.result(name),
        {
            "fit": "revised",
            "replaces": [before] if apart else list(base_fits(plan)),
            "effects": list(effects),
            "runs": [run.name for run in runs if run.name not in roles.held_out],
            "first_parts": [run.name for run in runs if run.name in roles.held_out],
            "checksum": checksum,
            "summary": summarise(posterior),
            "figures": drawn.listed,
        },
    )
