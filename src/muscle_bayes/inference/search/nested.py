"""One model that holds every candidate effect: each candidate is the same program, others off."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from muscle_bayes.inference.model.damper_axes import LAW, from_axes, log_volume, to_axes
from muscle_bayes.inference.model.density import (
    constrain,
    precision_through,
    site_priors,
    unconstrain,
)
from muscle_bayes.inference.model.lane_model import Physical, Values, part_names
from muscle_bayes.inference.model.problem import Data, Layout, Problem
from muscle_bayes.inference.running.program import program
from muscle_bayes.inference.running.programs import constrained_at
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.effects.empirical import PREFIX, SIGNALS, function_type
from muscle_bayes.physics.muscle import MuscleParameters


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
    slots: int = 8
    """Entries of a point for effects' parameters, more where a model has more: few shapes to compile."""

    @property
    def layout(self) -> Layout:
        """Of the problem."""
        return self.problem.layout

    @property
    def data(self) -> Data:
        """Of the problem."""
        return self.problem.data

    @property
    def shared(self) -> int:
        """Entries that all candidates share."""
        return int(sum(_sizes(self.layout)[~_of_effects(self.layout)]))

    @cached_property
    def _choices(self) -> dict[tuple[str, ...], Choice]:
        """Those made so far."""
        return {}

    def choice(self, effects: Sequence[str]) -> Choice:
        """The model with these effects on, in any order."""
        key = tuple(effects)
        if key not in self._choices:
            self._choices[key] = self._chosen(key)
        return self._choices[key]

    def _chosen(self, effects: Sequence[str]) -> Choice:
        layout, sizes = self.layout, _sizes(self.layout)
        position = dict(
            zip((n for n, _ in layout.shapes), np.cumsum([0, *sizes]).tolist(), strict=False)
        )
        names, leaves = self.slots_of(effects), _leaf_names(layout)
        unused = max(self.slots - len(names), 0)
        acting = {general(name) for name in effects}
        least = {
            f"{regime}.least": jnp.asarray(float(self.least.get(regime, 0.0)))
            for regime in sorted(set(layout.regimes))
        }
        return Choice(
            on=jnp.array([float(name in acting) for name in layout.effects]),
            slot=jnp.array([position[n] for n in names] + [int(sizes.sum())] * unused, jnp.int32),
            leaf=jnp.array([leaves.index(n) for n in names] + [len(leaves)] * unused, jnp.int32),
            constants=_constants(layout, effects) | least,
        )

    def slots_of(self, effects: Sequence[str]) -> list[str]:
        """Names of the quantities in the slots of `choice(effects)` that are used."""
        return [
            f"{general(name)}.{key}" for name in effects for key in effect_type(name).parameters
        ]

    def point(self, values: Values, effects: Sequence[str]) -> Float[np.ndarray, " n"]:
        """The point of these sampled values with these effects on."""
        choice, layout = self.choice(effects), self.layout
        shared = {
            n for (n, _), own in zip(layout.shapes, _of_effects(layout), strict=True) if not own
        }
        given = {n: values[n] for n in shared | set(self.slots_of(effects))}
        zeros = constrained_at(np.zeros(int(_sizes(layout).sum())), layout, self.data)
        full = unconstrain({**zeros, **given}, layout, self.data)
        slots = jnp.append(full, 0.0).at[choice.slot].get(mode="fill", fill_value=0.0)
        return np.concatenate([full[_shared_entries(layout)], slots])

    def own_slots(
        self, effect: str, own: Float[np.ndarray, " k"], point: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, " k"]:
        """What the slots hold of one effect whose unconstrained parameters are `own`, beside a point's
        shared entries."""
        names = self.slots_of((effect,))
        if names != list(LAW):
            return own
        full = np.zeros(int(_sizes(self.layout).sum()))
        full[_shared_entries(self.layout)] = point[: self.shared]
        places = np.asarray(self.choice((effect,)).slot[: len(names)])
        return np.asarray(_on_axes(full, own, places, self.layout, self.data))

    def shared_names(self) -> list[str]:
        """Name of each shared entry; runs' own carry the run's index."""
        names = []
        for (name, shape), of_effect in zip(
            self.layout.shapes, _of_effects(self.layout), strict=True
        ):
            if not of_effect:
                names += [f"{name}[{i}]" for i in range(shape[0])] if shape else [name]
        return names


def general(effect: str) -> str:
    """Name under which the layout holds an effect: a function's without signal and range."""
    return effect.partition("(")[0]


def is_function(effect: str) -> bool:
    """Whether it is a function that nobody has named."""
    return effect.startswith(f"{PREFIX}-")


@program
def _on_axes(
    full: Float[Array, " n"],
    own: Float[Array, " k"],
    places: Int[Array, " k"],
    layout: Layout,
    data: Data,
) -> Float[Array, " k"]:
    """Places along the axes of those sites of a vector that are `own`."""
    sites = from_axes(full, layout, data).at[places].set(own)
    return to_axes(sites, layout, data)[places]


def _constants(layout: Layout, effects: Sequence[str]) -> dict[str, Array]:
    """Constants of the layout's functions: of those that are on, signal and range."""
    chosen = {general(name): function_type(name) for name in effects if is_function(name)}
    constants = {}
    for name in filter(is_function, layout.effects):
        kind = chosen.get(name)
        for signal in SIGNALS:
            constants[f"{name}.w_{signal}"] = float(kind is not None and kind.signal == signal)
        constants[f"{name}.low"] = 0.0 if kind is None else kind.low
        constants[f"{name}.high"] = 1.0 if kind is None else kind.high
    return {key: jnp.asarray(value) for key, value in constants.items()}


@lru_cache(maxsize=64)
def _sizes(layout: Layout) -> np.ndarray:
    return np.array([int(np.prod(shape)) for _, shape in layout.shapes])


@lru_cache(maxsize=64)
def _of_effects(layout: Layout) -> np.ndarray:
    return np.array([name.split(".")[0] in layout.effects for name, _ in layout.shapes])


@lru_cache(maxsize=64)
def _shared_entries(layout: Layout) -> np.ndarray:
    """Places in the full vector of the entries that all candidates share."""
    return np.flatnonzero(np.repeat(~_of_effects(layout), _sizes(layout)))


@lru_cache(maxsize=64)
def _leaf_names(layout: Layout) -> list[str]:
    """Names of the leaves of Physical, in their order."""
    sampled = {name for name, _ in layout.shapes}
    muscle = MuscleParameters(*MuscleParameters.__annotations__)
    effects = tuple(
        {key: f"{name}.{key}" for key in effect_type(name).parameters} for name in layout.effects
    )
    parts = {name: name for name in part_names(layout)}
    return jax.tree.leaves(
        Physical(
            "J" if "J" in sampled else None,
            "D" if "D" in sampled else None,
            muscle if "F_modulus_min" in sampled else None,
            effects,
            parts,
        )
    )


def shared_leaves(layout: Layout) -> np.ndarray:
    """Places of the leaves of Physical that all candidates share."""
    return np.flatnonzero([n.split(".")[0] not in layout.effects for n in _leaf_names(layout)])


def _full(point: Float[Array, " n"], choice: Choice, layout: Layout) -> Float[Array, " full"]:
    """The layout's unconstrained vector: effects that have no slot at 0."""
    sizes, entries = _sizes(layout), _shared_entries(layout)
    full = jnp.zeros(int(sizes.sum())).at[entries].set(point[: entries.size])
    return full.at[choice.slot].set(point[entries.size :], mode="drop")


def values_at(point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data) -> Values:
    """Sampled values at a point: effects that are not on have their off values."""
    values = dict(constrain(_full(point, choice, layout), layout, data))
    for index, name in enumerate(layout.effects):
        for key, parameter in effect_type(name).parameters.items():
            acting = choice.on[index] > 0.5
            values[f"{name}.{key}"] = jnp.where(acting, values[f"{name}.{key}"], parameter.off)
    for regime in sorted(set(layout.regimes)):  # in one order: else each process compiles anew
        least = choice.constants[f"{regime}.least"]
        values[f"{regime}.discrepancy"] = jnp.hypot(values[f"{regime}.discrepancy"], least)
    return values | choice.constants


def log_prior_at(
    point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data
) -> Float[Array, ""]:
    """Log prior density of a point, of shared entries and used slots."""
    sites = _log_prior_of_sites(_sites_at(point, choice, layout, data), choice, layout, data)
    return sites + log_volume(_full(point, choice, layout), layout, data)


def prior_precision_at(
    point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data
) -> Float[Array, "n n"]:
    """Precision of that prior."""
    frozen: dict[str, Any] = {"choice": choice, "layout": layout, "data": data}
    return precision_through(
        partial(_sites_at, **frozen), partial(_log_prior_of_sites, **frozen), point
    )


def _sites_at(point: Array, choice: Choice, layout: Layout, data: Data) -> Array:
    """Unconstrained values of all sites, then what unused slots hold."""
    unused = choice.slot >= int(_sizes(layout).sum())
    full = from_axes(_full(point, choice, layout), layout, data)
    return jnp.append(full, jnp.where(unused, point[-choice.slot.size :], 0.0))


def _log_prior_of_sites(sites: Array, choice: Choice, layout: Layout, data: Data) -> Array:
    sizes = _sizes(layout)
    full, unused = sites[: -choice.slot.size], sites[-choice.slot.size :]
    places = {name: place for place, name in enumerate(layout.effects)}
    place = [places.get(name.split(".")[0], len(places)) for name, _ in layout.shapes]
    sampled = [float(name not in choice.constants) for name, _ in layout.shapes]
    acting = jnp.append(choice.on, 1.0)[np.repeat(place, sizes)] * np.repeat(sampled, sizes)
    return jnp.sum(acting * site_priors(full, layout, data)) - 0.5 * jnp.sum(unused**2)
