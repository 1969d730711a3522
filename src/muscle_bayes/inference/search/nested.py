"""One model that holds every candidate effect: each candidate is the same program, others off."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpyro.distributions import biject_to

from muscle_bayes.inference.model.density import (
    constrain,
    entries_named,
    log_prior_entries,
)
from muscle_bayes.inference.model.lane_model import Physical, Values, part_names
from muscle_bayes.inference.model.problem import Data, Layout, Problem
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.effects.empirical import PREFIX, SIGNALS, function_type
from muscle_bayes.physics.muscle import MuscleParameters

SLOT_STEP = 8
"""Entries of the vector for effects' parameters come in multiples of this, for few shapes to compile."""


class Choice(NamedTuple):
    """Which effects are on, as arrays: candidates share compiled code."""

    on: Float[Array, " effect"]
    """1 for each effect of the layout that acts, else 0: at its off value."""
    slot: Int[Array, " slot"]
    """Entry of the full vector that each slot holds; its length where the slot is not used."""
    leaf: Int[Array, " slot"]
    """Leaf of the plant's parameters that each slot moves; their number where it is not used."""
    constants: dict[str, Float[Array, ""]]
    """Signals and ranges of the functions; each regime's least discrepancy, as `REGIME.least`."""


@dataclass(frozen=True)
class Nested:
    """A problem posed with every candidate effect.

    A point is a vector of the entries that all candidates share, followed by slots with those of the
    effects that are on. Functions are named with signal and range (`empirical.function_name`); of
    each port one at a time can be on.
    """

    problem: Problem
    least: Mapping[str, float] = field(default_factory=dict)
    """Of each regime, the size of a lasting discrepancy that is always allowed [log's unit]: an effect
    that explains less says nothing about the plant."""

    def on(self, problem: Problem) -> "Nested":
        """The same model on other data."""
        return replace(self, problem=problem)

    @property
    def layout(self) -> Layout:
        return self.problem.layout

    @property
    def data(self) -> Data:
        return self.problem.data

    @property
    def shared(self) -> int:
        """Entries that all candidates share."""
        return int(sum(_sizes(self.layout)[~_of_effects(self.layout)]))

    def choice(self, effects: Sequence[str]) -> Choice:
        """The model with these effects on, in any order."""
        layout, position = self.layout, _positions(self.layout)
        names, leaves = self.slots_of(effects), _effect_leaves(layout)
        slots = -(-max(len(names), 1) // SLOT_STEP) * SLOT_STEP
        unused = slots - len(names)
        size, count = int(sum(_sizes(layout))), len(_leaf_names(layout))
        acting = {general(name) for name in effects}
        return Choice(
            on=jnp.array([float(name in acting) for name in layout.effects]),
            slot=jnp.array([position[name] for name in names] + [size] * unused, jnp.int32),
            leaf=jnp.array([leaves[name] for name in names] + [count] * unused, jnp.int32),
            constants=_constants(layout, effects) | self._least(),
        )

    def _least(self) -> dict[str, Array]:
        return {
            f"{regime}.least": jnp.asarray(float(self.least.get(regime, 0.0)))
            for regime in sorted(set(self.layout.regimes))
        }

    def slots_of(self, effects: Sequence[str]) -> list[str]:
        """Names of the quantities in the slots of `choice(effects)` that are used."""
        return [
            f"{general(name)}.{key}" for name in effects for key in effect_type(name).parameters
        ]

    def point(self, values: Values, effects: Sequence[str]) -> Float[np.ndarray, " n"]:
        """The point of these sampled values with these effects on."""
        parts = []
        for name, of_effect in zip(
            [name for name, _ in self.layout.shapes], _of_effects(self.layout), strict=True
        ):
            if not of_effect:
                parts.append(np.ravel(self._free(name, values[name])))
        slots = np.zeros(self.choice(effects).slot.size)
        for index, name in enumerate(self.slots_of(effects)):
            slots[index] = self._free(name, values[name])
        return np.concatenate([*parts, slots])

    def _free(self, name: str, value: Any) -> np.ndarray:
        """A sampled quantity's unconstrained value."""
        transform = biject_to(self.data.priors[name].support)
        return np.asarray(transform.inv(jnp.asarray(value)))

    def entries_named(self, ending: str) -> Int[np.ndarray, " entry"]:
        """Entries of a point that all candidates share and whose names end so."""
        shapes = zip(self.layout.shapes, _of_effects(self.layout), strict=True)
        return entries_named(ending, [one for one, of_effect in shapes if not of_effect])

    def shared_names(self) -> list[str]:
        """Name of each shared entry; runs' own carry the run's index."""
        names = []
        for (name, shape), of_effect in zip(
            self.layout.shapes, _of_effects(self.layout), strict=True
        ):
            if not of_effect:
                count = int(np.prod(shape))
                names += [name] if not shape else [f"{name}[{i}]" for i in range(count)]
        return names


def general(effect: str) -> str:
    """Name under which the layout holds an effect: a function's without signal and range."""
    return effect.partition("(")[0]


def _constants(layout: Layout, effects: Sequence[str]) -> dict[str, Array]:
    """Constants of the layout's functions: of those that are on, signal and range."""
    chosen = {
        general(name): function_type(name) for name in effects if name.startswith(f"{PREFIX}-")
    }
    constants = {}
    for name in layout.effects:
        if not name.startswith(f"{PREFIX}-"):
            continue
        kind = chosen.get(name)
        for signal in SIGNALS:
            constants[f"{name}.w_{signal}"] = float(kind is not None and kind.signal == signal)
        constants[f"{name}.low"] = 0.0 if kind is None else kind.low
        constants[f"{name}.high"] = 1.0 if kind is None else kind.high
    return {key: jnp.asarray(value) for key, value in constants.items()}


def _sizes(layout: Layout) -> np.ndarray:
    return np.array([int(np.prod(shape)) for _, shape in layout.shapes])


def _of_effects(layout: Layout) -> np.ndarray:
    return np.array([name.split(".")[0] in layout.effects for name, _ in layout.shapes])


def _positions(layout: Layout) -> dict[str, int]:
    starts = np.concatenate([[0], np.cumsum(_sizes(layout))])
    return {name: int(at) for (name, _), at in zip(layout.shapes, starts[:-1], strict=True)}


def _shared_entries(layout: Layout) -> np.ndarray:
    return np.flatnonzero(np.repeat(~_of_effects(layout), _sizes(layout)))


def _leaf_names(layout: Layout) -> list[str]:
    """Names of the leaves of Physical, in their order."""
    muscle = None
    if any(name == "F_modulus_min" for name, _ in layout.shapes):
        muscle = MuscleParameters(*MuscleParameters.__annotations__)
    effects = tuple(
        {key: f"{name}.{key}" for key in effect_type(name).parameters} for name in layout.effects
    )
    parts = {name: name for name in part_names(layout)}
    sampled = {name for name, _ in layout.shapes}
    inertia, friction = (name if name in sampled else None for name in ("J", "D"))
    return jax.tree.leaves(Physical(inertia, friction, muscle, effects, parts))


def _effect_leaves(layout: Layout) -> dict[str, int]:
    return {
        name: index
        for index, name in enumerate(_leaf_names(layout))
        if name.split(".")[0] in layout.effects
    }


def shared_leaves(layout: Layout) -> np.ndarray:
    """Places of the leaves of Physical that all candidates share."""
    return np.flatnonzero(
        [name.split(".")[0] not in layout.effects for name in _leaf_names(layout)]
    )


def _full(point: Float[Array, " n"], choice: Choice, layout: Layout) -> Float[Array, " full"]:
    """The layout's unconstrained vector: effects that have no slot at 0."""
    entries = _shared_entries(layout)
    full = jnp.zeros(int(sum(_sizes(layout)))).at[entries].set(point[: entries.size])
    return full.at[choice.slot].set(point[entries.size :], mode="drop")


def values_at(point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data) -> Values:
    """Sampled values at a point: effects that are not on have their off values."""
    values = dict(constrain(_full(point, choice, layout), layout, data))
    for index, name in enumerate(layout.effects):
        for key, parameter in effect_type(name).parameters.items():
            acting = choice.on[index] > 0.5
            values[f"{name}.{key}"] = jnp.where(acting, values[f"{name}.{key}"], parameter.off)
    for regime in set(layout.regimes):
        least = choice.constants[f"{regime}.least"]
        values[f"{regime}.discrepancy"] = jnp.hypot(values[f"{regime}.discrepancy"], least)
    return values | choice.constants


def _acting(choice: Choice, layout: Layout) -> Float[Array, " full"]:
    """1 for entries of the layout's vector that mean something in this model, else 0."""
    always = len(layout.effects)
    effects = {name: place for place, name in enumerate(layout.effects)}
    places = [effects.get(name.split(".")[0], always) for name, _ in layout.shapes]
    sampled = [float(name not in choice.constants) for name, _ in layout.shapes]
    sizes = _sizes(layout)
    on = jnp.append(choice.on, 1.0)
    return on[np.repeat(places, sizes)] * np.repeat(sampled, sizes)


def log_prior_at(
    point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data
) -> Float[Array, ""]:
    """Log prior density of a point, of shared entries and used slots."""
    full = _full(point, choice, layout)
    total = jnp.sum(_acting(choice, layout) * log_prior_entries(full, layout, data))
    unused = choice.slot >= full.size
    total -= 0.5 * jnp.sum(jnp.where(unused, point[-choice.slot.size :] ** 2, 0.0))
    return total
