"""Gains of an antagonistic joint: tuned over new joints, tested on others."""

from dataclasses import dataclass
from typing import Final

from muscle_bayes.control.judging.judge import Judgement
from muscle_bayes.control.laws.gains import LawName, gains_header, gains_toml
from muscle_bayes.control.laws.templates import TUNED
from muscle_bayes.control.linear import loops
from muscle_bayes.control.plant.design import Design, read_design
from muscle_bayes.control.plant.draws import JointDraws, joint_draws
from muscle_bayes.control.plant.heater_fit import HeaterPosterior, assumed_heater, fit_heater
from muscle_bayes.control.scenarios.thesis import STEP, thesis_scenarios
from muscle_bayes.control.study import TunedLaws, tuned_laws
from muscle_bayes.control.tune import Effort
from muscle_bayes.data import Run
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.population import fit_population
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.json_file import write_json
from muscle_bayes.progress import Report
from muscle_bayes.report.control_figures import control_figures
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.steps.figures import Drawn, origin_of
from muscle_bayes.whole_file import write_whole

_MIRRORED = ("rotor_radius", "anchor_x", "anchor_y")


def mirrored(run: Run) -> Design:
    """The muscle's own rig with a second one mounted on the other side like the first."""
    fixture, muscle = run.metadata.fixture, run.metadata.element_a
    sides = {f"{key}_b": getattr(fixture, f"{key}_a") for key in _MIRRORED}
    told = {"fixture": fixture.model_copy(update=sides), "element_a": muscle, "element_b": muscle}
    design = Design().model_copy(update=told)
    if run.metadata.potentiometer is None:
        return design
    return design.model_copy(update={"potentiometer": run.metadata.potentiometer})


def heater_of(plan: Plan, seed: int) -> HeaterPosterior:
    """The heater's posterior from the runs that were held out, else from those fitted, else assumed."""
    moved = [run for run in plan.runs(plan.roles.held_out) if run.has_muscle]
    for runs in (moved, plan.runs(plan.roles.muscle)):
        if not runs:
            continue
        try:
            return fit_heater(runs, seed=seed)
        except MuscleBayesError:
            continue  # these never leave it certain what a heater does
    return assumed_heater(seed)


def draws_of(plan: Plan, count: int) -> tuple[JointDraws, list[str]]:
    """Draws of joints, and what has to be told about where they come from.

    Inertia and friction are those that the muscle was fitted with: the fixture's, with the friction that
    the study takes.
    """
    seed = plan.config.seed
    tubes = heater_of(plan, seed)
    notes = [tubes.note(), "loops are simulated, no joint was measured"]
    design = mirrored(plan.run(plan.roles.muscle[0]))
    if plan.joint is not None:
        design = read_design(plan.joint)
        notes.append(f"joint: {plan.joint.name}")
    else:
        notes.append("joint: the muscle's rig with its mirror image on the other side")
    revised = plan.found("revised")["fit"]
    for name in dict.fromkeys((revised, "muscle")):
        try:
            population = fit_population({name: Posterior.load(plan.posterior(name))}, seed=seed)
            draws = joint_draws(population, tubes.draws, count, design=design, seed=seed)
        except MuscleBayesError as error:
            notes.append(f"the {name} model is not used: {str(error).partition(' Fix:')[0]}")
            continue
        told = f"muscle: the {name} model; the spread between muscles is assumed, not measured"
        return draws, [*notes, told]
    raise MuscleBayesError("; ".join(notes))


@dataclass(frozen=True)
class Size:
    """How much is spent on the controller."""

    tuned_on: int
    """joints"""
    tested: int
    """other joints, that gains are tested on"""
    laws: tuple[LawName, ...]
    effort: Effort


SIZES: Final = {
    "quick": Size(24, 48, ("pi",), Effort(starts=32, scouts=12, kept=8, tried=16)),
    "full": Size(96, 400, TUNED, Effort()),
}
FACTORS: Final = (0.1, 0.25, 0.5, 1.0, 2.0)


def make(plan: Plan, name: str, report: Report) -> None:
    """Write results/control.json, gains.toml, gains.h and figures."""
    size, seed = SIZES[plan.preset], plan.config.seed
    joints, notes = draws_of(plan, size.tuned_on + size.tested)
    found = tuned_laws(
        joints,
        size.tuned_on,
        thesis_scenarios(),
        laws=size.laws,
        effort=size.effort,
        notes=notes,
        seed=seed,
        report=report,
    )
    result = found.judgement
    gains = result.gains[result.recommended]
    head = "\n".join([result.sentence(), *result.notes])
    write_whole(plan.out / "gains.toml", gains_toml(gains, head).encode())
    write_whole(plan.out / "gains.h", gains_header(gains, joints.design, head).encode())
    report("figures", 0, 1)
    drawn = Drawn(plan)
    _draw(drawn, found, origin_of(plan.runs(plan.roles.fitted)) + " Simulated loops.")
    told = {"answers": answers(result, found.edges), "edges": found.edges, "figures": drawn.listed}
    write_json(plan.result(name), result.as_dict() | told)


def answers(result: Judgement, edges: dict[str, tuple[str, ...]]) -> list[str]:
    """The recommendation in sentences, with what is out of reach."""
    lost = [f"{key}: {one.infeasible}." for key, one in result.specs.items() if one.infeasible]
    limits = [f"{law}: {', '.join(at)}." for law, at in edges.items() if at]
    return [
        result.sentence(),
        *([f"Out of any input's reach: {' '.join(lost)}"] if lost else []),
        *([f"At an edge of the search: {' '.join(limits)}"] if limits else []),
    ]


CAPTIONS: Final = {
    "responses": "Responses of joints that were not tuned on, in every scenario: median and 90 % under the "
    "recommended gains and under gains by the thesis' method; below each name, the share that meets "
    "what is asked.",
    "pareto": "Speed against heat, as all gains of a law are multiplied alike; large markers: as tuned.",
    "loop": "Loop gain and sensitivity under the recommended gains, median and 90 % of joints; without dry "
    "friction.",
}


def _draw(drawn: Drawn, found: TunedLaws, origin: str) -> None:
    result, bank = found.judgement, found.bank
    near = loops(bank.draws, result.gains[result.recommended], 0.5 * STEP, count=20)
    looped = {f"held at {0.5 * STEP:.2g} rad": near} if len(near.gain) else {}
    for name, figure in control_figures(result, bank, looped, FACTORS).items():
        drawn.add(f"control-{name}", figure, CAPTIONS[name], origin)
