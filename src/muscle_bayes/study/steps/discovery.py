"""Where the model misfits, and which effect it lacks."""

from typing import Any

from muscle_bayes.criticism.drift import drift
from muscle_bayes.data import Run
from muscle_bayes.discovery.discover import applicable, discover
from muscle_bayes.discovery.result import Discovery
from muscle_bayes.json_file import write_json
from muscle_bayes.progress import Report
from muscle_bayes.report.discovery_figures import (
    before_after_figure,
    discovery_figure,
    misfit_figure,
    probability_figure,
)
from muscle_bayes.report.discovery_summary import verdict_text
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.steps.figures import Drawn, origin_of
from muscle_bayes.whole_file import write_whole


def make(plan: Plan, name: str, report: Report) -> None:
    """Write results/discovery.json, results/effects.json, figures, and next-experiment.toml after a tie."""
    roles, config = plan.roles, plan.config
    runs = plan.fitted((*roles.fixture, *roles.muscle, *roles.held_out))
    tried = config.candidates or applicable(runs, config.effects)
    found = discover(
        runs,
        hold_out=roles.held_out,
        friction=config.friction,
        effects=config.effects,
        candidates=tried,
        seed=config.seed,
        report=report,
    )
    drawn = Drawn(plan)
    _draw(found, drawn, {run.name: run.metadata.origin for run in runs}, origin_of(runs))
    if found.next_experiment is not None and found.next_experiment.sequence:
        sequence = found.next_experiment.sequence.encode()
        write_whole(plan.out / "next-experiment.toml", sequence)
    # Of its own, so that the revised model is sampled again only when other effects are found.
    write_json(plan.result("effects"), {"effects": list(found.effects)})
    write_json(
        plan.result(name),
        found.as_dict()
        | {
            "told": verdict_text(found),
            "tried": list(tried),
            "left_p_value": found.final.misfit.p_value,
            "drift": _drifts(found, runs, config.seed),
            "figures": drawn.listed,
        },
    )


def _drifts(found: Discovery, runs: list[Run], seed: int) -> dict[str, Any]:
    """Creep while cold of held-out runs under the nominal and under the revised model."""
    held = [run.name for run in runs if run.name in found.held_out and run.has_muscle]
    return {
        name: {
            when: drift(judged.predictions[name], seed).as_dict()["slope_difference"]
            for when, judged in (("before", found.nominal), ("after", found.final))
        }
        for name in held
    }


def _draw(found: Discovery, drawn: Drawn, origins: dict[str, str], origin: str) -> None:
    if worst := found.located.windows:
        run = worst[0].run
        drawn.add(
            "discovery",
            discovery_figure(found, run, origins[run]),
            f"Run {run} before and after the search: readings minus model, with windows of significant "
            "misfit shaded, and the probability of what may be missing.",
            origin,
        )
    drawn.add(
        "misfit",
        misfit_figure(found, origins),
        "Readings minus model of every fitted run, before and, if an effect was added, after."
        + (
            " Shaded: windows whose misfit exceeds what noise and uncertain parameters allow."
            if found.located.windows
            else " No window misfits by more than noise allows."
        ),
        origin,
    )
    drawn.add(
        "probabilities",
        probability_figure(found),
        "Probability of each effect of the catalogue being what the model lacks, of nothing being missing, "
        "and of something unknown.",
        origin,
    )
    for run in found.nominal.predictions:
        drawn.add(
            f"discovery-{run}",
            before_after_figure(found, run, origins[run]),
            f"Run {run}{', held out,' if run in found.held_out else ''} under the nominal"
            f"{' and the revised model' if found.steps else ' model'}, each at its most probable point, "
            "with 50 and 90 % bands.",
            origins[run],
        )
