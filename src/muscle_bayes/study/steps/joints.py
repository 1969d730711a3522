"""Draws of the joint that gains are tuned for."""

from muscle_bayes.control.plant.design import Design, read_design
from muscle_bayes.control.plant.draws import JointDraws, joint_draws
from muscle_bayes.control.plant.heater_fit import HeaterPosterior, assumed_heater, fit_heater
from muscle_bayes.data import Run
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.population import fit_population
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.roles import drives

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
    moved = [run for run in plan.runs(plan.roles.held_out) if drives(run)]
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
