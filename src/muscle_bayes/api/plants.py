"""A run's plant with given parameters, to be simulated."""

from collections.abc import Mapping, Sequence

import jax.numpy as jnp
from jaxtyping import ArrayLike

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import Run, refuse_unread
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.muscle_prior import MUSCLE_PARAMETERS
from muscle_bayes.inference.records.parts import parts_of
from muscle_bayes.inference.records.rig import rig, with_parameters
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.effects.own import AnyEffectType, effect_names
from muscle_bayes.physics.friction import friction_law
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.plant import Plant


def plant_of(
    run: Run,
    values: Mapping[str, ArrayLike],
    friction: Friction = "coulomb",
    effects: Sequence[str | AnyEffectType] = (),
) -> Plant:
    """The plant that a run was taken from, with these parameters.

    Geometry comes from the run's metadata. JAX may trace the values, so that a simulation can be
    differentiated for them.

    Args:
        run: as `read_runs` gives it.
        values: J [kg m^2 or kg] and D [N m or N; N m s or N s/m where friction is linear]. Table 2's
            nine where the run has a muscle. What the metadata leave open is `table.key`, such as
            element_a.rate; an effect's parameter is `effect.parameter`. Others, such as a posterior's
            noise, may be there and are not used.
        friction: "coulomb" or "linear", as in `fit`.
        effects: names of effects, or classes of your own, in the order in which they act.

    Returns:
        The plant.

    Raises:
        MuscleBayesError: where a parameter is missing, and for unknown friction and effects.

    Example:
        >>> import muscle_bayes as mb
        >>> (run,) = mb.load_example("spring-1")
        >>> mb.plant_of(run, {"J": 1.24e-3, "D": 5.46e-3}).rotor_inertia
        0.00124
    """
    refuse_unread([run])
    effects = effect_names(effects)
    stated = run.metadata.fixture.inertia is not None
    needed = [*([] if stated else ["J"]), "D", *(MUSCLE_PARAMETERS if run.has_muscle else ())]
    parts = {
        f"{place}.{key}" for place, p in parts_of(run.metadata).items() for key in p.estimated()
    }
    needed += sorted(parts)
    needed += [f"{name}.{key}" for name in effects for key in effect_type(name).parameters]
    if missing := [name for name in needed if name not in values]:
        raise MuscleBayesError(f"{run.name}: no value for {', '.join(missing)}. Fix: give it.")
    muscle = (
        MuscleParameters(**{name: values[name] for name in MUSCLE_PARAMETERS})
        if run.has_muscle
        else None
    )
    law = friction_law(friction)(values["D"])
    own = {name: jnp.asarray(values[name]) for name in parts}
    plant = with_parameters(rig(run.metadata), values.get("J"), law, muscle, own)
    for name in effects:
        kind = effect_type(name)
        plant = plant + kind(**{key: values[f"{name}.{key}"] for key in kind.parameters})
    return plant
