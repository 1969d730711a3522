"""From a posterior of single muscles to draws of whole joints."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from html import escape
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from muscle_bayes.control.design import Design
from muscle_bayes.control.heater import Heater
from muscle_bayes.control.joint import Joint
from muscle_bayes.conventions import Friction
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.muscle_prior import MUSCLE_PARAMETERS
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.records.rig import with_parameters
from muscle_bayes.markup import html_table
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.friction import FRICTION_LAWS
from muscle_bayes.physics.muscle import MuscleParameters

HEATER = ("gain", "cooling", "lag")
"""Names of a heater's numbers among a joint's values, as `heater.NAME`."""


@dataclass(frozen=True, repr=False)
class JointDraws:
    """Draws of everything that is unknown about a joint.

    `values` holds J, D, Table 2's nine, each effect's parameters as `effect.parameter`, and the
    heater's; every array has a leading draw axis.
    """

    design: Design
    friction: Friction
    effects: tuple[str, ...]
    values: Mapping[str, np.ndarray]

    def __len__(self) -> int:
        return len(self.values["J"])

    def __repr__(self) -> str:
        return f"JointDraws({len(self)} joints, {self.friction} friction, effects {self.effects})"

    def _repr_html_(self) -> str:
        rows = [
            (name, *(f"{q:.4g}" for q in np.quantile(value, (0.5, 0.05, 0.95))))
            for name, value in self.values.items()
        ]
        table = html_table(("quantity", "median", "5 %", "95 %"), rows)
        return f"<p>{escape(repr(self))}</p>{table}"

    def take(self, index: Any) -> "JointDraws":
        """These draws only."""
        return replace(self, values={key: value[index] for key, value in self.values.items()})

    def split(self, first: int) -> tuple["JointDraws", "JointDraws"]:
        """The first so many draws, and the others: to tune on, and kept apart."""
        return self.take(slice(0, first)), self.take(slice(first, None))

    def mean(self) -> "JointDraws":
        """One draw: the posterior mean, a point estimate."""
        means = {key: value.mean(keepdims=True) for key, value in self.values.items()}
        return replace(self, values=means)

    def without(self, effect: str) -> "JointDraws":
        """The same joints as a model without that effect would have them. Raises MuscleBayesError."""
        if effect not in self.effects:
            raise MuscleBayesError(f"these draws have no effect {effect!r} to leave out")
        values = {k: v for k, v in self.values.items() if k.split(".")[0] != effect}
        kept = tuple(name for name in self.effects if name != effect)
        return replace(self, effects=kept, values=values)

    def joint(self, values: Mapping[str, Array]) -> Joint:
        """The joint of one draw; may be traced."""
        muscle = MuscleParameters(**{key: values[key] for key in MUSCLE_PARAMETERS})
        friction = FRICTION_LAWS[self.friction](values["D"])
        plant = with_parameters(self.design.plant(), values["J"], friction, muscle)
        for name in self.effects:
            chosen = {key: values[f"{name}.{key}"] for key in effect_type(name).parameters}
            plant = plant + effect_type(name)(**chosen)
        room = jnp.asarray(self.design.fixture.room_temperature)
        tube = {key: values[f"heater.{key}"] for key in HEATER}
        heater = Heater(**tube, room=room)
        return Joint(plant, heater, *self.design.sensors())

    def one(self, index: int = 0) -> Joint:
        """The joint of draw number `index`."""
        return self.joint({key: jnp.asarray(value[index]) for key, value in self.values.items()})


def joint_draws(
    posterior: Posterior,
    heater: Mapping[str, np.ndarray],
    count: int,
    *,
    design: Design | None = None,
    fixture: Posterior | None = None,
    seed: int = 0,
) -> JointDraws:
    """`count` joints in random order: muscle and effects from `posterior`, and heater draws.

    J and D come from `fixture` where it is given, drawn independently: it may have the linear
    friction of the thesis' controller study. Raises MuscleBayesError where the posterior has no muscle.
    """
    needed = ("J", "D", *MUSCLE_PARAMETERS)
    group = posterior.tree["posterior"].to_dataset()
    if missing := [name for name in needed if name not in group]:
        raise MuscleBayesError(
            f"the posterior has no {', '.join(missing)}. Fix: fit runs with a muscle, "
            "`muscle-bayes fit STAIRCASE_RUN... --given FIXTURE.nc --out MUSCLE.nc`"
        )
    generator = np.random.default_rng(seed)
    names = [*needed, *(n for n in posterior.parameters if n.split(".")[0] in posterior.effects)]
    flat = {name: group[name].to_numpy().reshape(-1) for name in names}
    values = _resampled(flat, count, generator)
    friction = posterior.friction
    if fixture is not None:
        bearing = fixture.tree["posterior"].to_dataset()
        flat = {name: bearing[name].to_numpy().reshape(-1) for name in ("J", "D")}
        values |= _resampled(flat, count, generator)
        friction = fixture.friction
    heated = {f"heater.{key}": np.asarray(heater[key]) for key in HEATER}
    values |= _resampled(heated, count, generator)
    return JointDraws(design or Design(), friction, posterior.effects, values)


def _resampled(flat: dict[str, np.ndarray], count: int, generator) -> dict[str, np.ndarray]:
    """`count` joint draws without replacement; with it only where there are too few."""
    size = len(next(iter(flat.values())))
    enough = count <= size
    chosen = generator.permutation(size)[:count] if enough else generator.integers(size, size=count)
    return {name: np.asarray(value, float)[chosen] for name, value in flat.items()}
