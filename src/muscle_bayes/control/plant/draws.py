"""Draws of whole joints: two muscles that have not been built yet, their heaters, room and supply."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from html import escape
from typing import Any, Final

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from muscle_bayes.control.plant.design import Design
from muscle_bayes.control.plant.heater import Heater
from muscle_bayes.control.plant.joint import Joint
from muscle_bayes.control.plant.rest import relaxed_hyst, remembering_rest
from muscle_bayes.conventions import Friction
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.muscle_prior import MUSCLE_PARAMETERS
from muscle_bayes.inference.population import Population
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.records.rig import with_parameters
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.markup import html_table
from muscle_bayes.physics.bisection import bisect
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.friction import FRICTION_LAWS
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.state import Drive

HEATER: Final = ("gain", "cooling", "lag")
"""Names of a heater's numbers among a joint's values, as `heater.NAME`."""

MOST_MOUNTED: Final = 0.3
"""Largest strain by which mounting shortens one muscle and lengthens the other."""


@dataclass(frozen=True)
class Surroundings:
    """What differs from day to day and from tube to tube."""

    room: float = 3.0
    """The room's temperature is uniform within this of the design's [K]."""
    supply: float = 0.02
    """Standard deviation of the supply's voltage, relative; heating goes with its square."""
    tubes: float = 0.05
    """Standard deviation of the logarithm of gain and cooling between tubes."""
    mounting: float = 0.02
    """Standard deviation of the angle at which the joint rests in the cold [rad]: muscles are mounted so
    that it rests at zero, as well as that goes."""
    meter_lag: tuple[float, float] = (1.0, 0.5)
    """Median [s], and standard deviation of the logarithm, of the thermocouples' lag."""


@dataclass(frozen=True, repr=False)
class JointDraws:
    """Draws of everything that is unknown about a joint.

    `values` holds J, D, each effect's parameters as `effect.parameter`, `room` [C] and `meter_lag` [s],
    with a leading draw axis; Table 2's nine and the heater's also have an axis over the sides A and B.
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
        """The first so many draws, and the others: to tune on, and kept for the test."""
        return self.take(slice(0, first)), self.take(slice(first, None))

    def median(self) -> "JointDraws":
        """One draw, with the median of every value and both sides alike: a point estimate."""

        def middle(value: np.ndarray) -> np.ndarray:
            return np.broadcast_to(np.median(value), (1, *value.shape[1:])).copy()

        return replace(self, values={key: middle(value) for key, value in self.values.items()})

    def joint(self, values: Mapping[str, Array]) -> Joint:
        """The joint of one draw; may be traced."""
        friction = FRICTION_LAWS[self.friction](values["D"])
        plant = with_parameters(self.design.plant(), values["J"], friction, None)
        for place, name in enumerate(("side_a", "side_b")):
            muscle = MuscleParameters(**{key: values[key][place] for key in MUSCLE_PARAMETERS})
            side = replace(plant.muscles[place], parameters=muscle, room_temperature=values["room"])
            plant = replace(plant, **{name: side})
        for name in self.effects:
            chosen = {key: values[f"{name}.{key}"] for key in effect_type(name).parameters}
            plant = plant + effect_type(name)(**chosen)
        tube = {key: values[f"heater.{key}"] for key in HEATER}
        sensor, meter = self.design.sensors()
        meter = replace(meter, lag=values["meter_lag"])
        return Joint(plant, Heater(**tube, room=values["room"]), sensor, meter)

    def one(self, index: int = 0) -> Joint:
        """The joint of draw number `index`."""
        return self.joint({key: jnp.asarray(value[index]) for key, value in self.values.items()})


def joint_draws(
    population: Population,
    heater: Mapping[str, np.ndarray],
    count: int,
    *,
    design: Design | None = None,
    fixture: Posterior | None = None,
    surroundings: Surroundings | None = None,
    seed: int = 0,
) -> JointDraws:
    """`count` joints of two new muscles each.

    Effects come from the population's specimens, J, D and friction from `fixture` where it is given. Raises
    MuscleBayesError where there is neither inertia nor friction to be had.
    """
    generator = np.random.default_rng(seed)
    design, around = design or Design(), surroundings or Surroundings()
    first, second = (
        population.new_muscles(count, seed=int(s)) for s in generator.integers(2**31, size=2)
    )
    values = {key: np.stack([first[key], second[key]], 1) for key in MUSCLE_PARAMETERS}
    shared = [key for key in first if key not in MUSCLE_PARAMETERS]
    values |= {key: first[key] for key in shared}
    friction = population.friction
    if fixture is not None:
        group = fixture.tree["posterior"].to_dataset()
        rows = generator.integers(group["J"].size, size=count)
        values |= {name: group[name].to_numpy().reshape(-1)[rows] for name in ("J", "D")}
        friction = fixture.friction
    if missing := {"J", "D"} - {*values}:
        raise MuscleBayesError(
            f"the population has no {', '.join(sorted(missing))}. Fix: give --fixture FIXTURE.nc"
        )
    values |= _tubes(heater, count, around, generator)
    room = design.fixture.room_temperature
    values["room"] = room + around.room * generator.uniform(-1.0, 1.0, count)
    middle, spread = around.meter_lag
    values["meter_lag"] = middle * np.exp(spread * generator.standard_normal(count))
    joints = JointDraws(design, friction, population.effects, values)
    return _mounted(joints, around.mounting * generator.standard_normal(count))


@double_precision
def _mounted(joints: JointDraws, angles: np.ndarray) -> JointDraws:
    """The joints with what one muscle is mounted longer and the other shorter by, so that they rest at
    `angles` [rad]: the same strain off one C and on the other."""

    def strain(values: Mapping[str, Array], angle: Array) -> Array:
        def force(strain: Array) -> Array:
            moved = {**values, "C": values["C"] + strain * jnp.array([1.0, -1.0])}
            joint = joints.joint(moved)
            cold = Drive(jnp.full(2, joint.heater.room), jnp.zeros(()), jnp.zeros(()))
            plant = remembering_rest(joint.plant, cold)
            hyst = relaxed_hyst(plant, angle, cold)
            return -plant.force(angle, jnp.zeros(()), hyst, cold)

        most = jnp.asarray(MOST_MOUNTED)
        return bisect(force, -most, most)

    values = {key: jnp.asarray(value) for key, value in joints.values.items()}
    moved = np.asarray(jax.jit(jax.vmap(strain))(values, jnp.asarray(angles)))
    lengths = joints.values["C"] + moved[:, None] * np.array([1.0, -1.0])
    return replace(joints, values={**joints.values, "C": lengths})


def _tubes(
    heater: Mapping[str, np.ndarray], count: int, around: Surroundings, generator
) -> dict[str, np.ndarray]:
    """Two tubes a joint, on one supply: each draw's, and what differs from tube to tube."""
    rows = generator.integers(len(heater["gain"]), size=count)
    voltage = 1.0 + around.supply * generator.standard_normal(count)
    values = {}
    for key in HEATER:
        apart = around.tubes if key != "lag" else 0.0
        each = np.exp(apart * generator.standard_normal((count, 2)))
        values[f"heater.{key}"] = np.asarray(heater[key])[rows, None] * each
    values["heater.gain"] *= voltage[:, None] ** 2
    return values
