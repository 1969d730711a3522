"""A posterior of the fixture's runs or of the muscle's."""

from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.sampling.fit import EFFORTS, fit
from muscle_bayes.progress import Report
from muscle_bayes.study.plan import Plan


def make(plan: Plan, name: str, report: Report) -> None:
    """Write posteriors/NAME.nc: `fixture-LAW`, or `muscle` with the fixture's J and D as prior."""
    given = None
    if name == "muscle":
        runs, friction = plan.fitted(plan.roles.muscle), plan.config.friction
        if plan.roles.fixture:
            given = Posterior.load(plan.posterior(f"fixture-{friction}"))
        effects = plan.config.effects
    else:
        runs = plan.fitted(plan.roles.fixture)
        friction = "linear" if name.endswith("linear") else "coulomb"
        effects = rotor_effects(plan.config.effects)
    posterior = fit(
        runs,
        friction,
        effects,
        effort=EFFORTS[plan.preset],
        given=given,
        seed=plan.config.seed,
        report=report,
    )
    posterior.save(plan.posterior(name))


def rotor_effects(effects: tuple[str, ...]) -> tuple[str, ...]:
    """Those that act without a muscle as well."""
    from muscle_bayes.physics.effect import MUSCLE_PORTS
    from muscle_bayes.physics.effects import effect_type

    return tuple(name for name in effects if effect_type(name).port not in MUSCLE_PORTS)
