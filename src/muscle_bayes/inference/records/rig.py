"""From a run's metadata to a plant whose unknown parameters are still to be filled in."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.data.describing.metadata import Measured, Metadata
from muscle_bayes.data.run import Run
from muscle_bayes.inference.records.parts import parts_of
from muscle_bayes.physics.elements import Arm, Element, Instant, Muscle, NoElement
from muscle_bayes.physics.friction import CoulombFriction, FrictionLaw
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.outputs import Output, Position, Temperature, Tension, Velocity
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.unknown import UNKNOWN, Part

IN_PROPORTION = ("gain", "rate")
"""Parameters of parts without which there is no force at all."""
SIDES: tuple[Literal["a", "b"], ...] = ("a", "b")
OUTPUTS: dict[Measured, Output] = {
    "position": Position(),
    "velocity": Velocity(),
    "force": Tension(),
}
"""By what a log's position column holds."""


def rig(metadata: Metadata) -> Plant:
    """The plant of a run with what is to be estimated still unknown (NaN)."""
    fixture = metadata.fixture
    linear = fixture.motion == "linear"
    parts = parts_of(metadata)
    return Plant(
        rotor_inertia=UNKNOWN if fixture.inertia is None else fixture.inertia,
        friction=CoulombFriction(jnp.nan),
        side_a=parts["element_a"],
        side_b=parts["element_b"],
        load_lever=1.0 if linear else (fixture.disc_radius or 0.0),
        stops=tuple(fixture.stops) if fixture.stops is not None else (-math.inf, math.inf),
        actuator=parts["drive"],
    )


def parts_in(plant: Plant) -> dict[str, Part]:
    """The parts of a plant by the tables of the metadata that describe them."""
    return {"element_a": plant.side_a, "element_b": plant.side_b, "drive": plant.actuator}


def filled[P: Part](place: str, part: P, values: Mapping[str, Array]) -> P:
    """A part with the values of its unknowns, which go by "table.key"."""
    own = {key: values[name] for key in part.unknowns if (name := f"{place}.{key}") in values}
    return part.filled(own) if own else part


def with_parameters(
    plant: Plant,
    rotor_inertia: Array | float | None,
    friction: FrictionLaw,
    muscle: MuscleParameters | None,
    values: Mapping[str, Array] = {},
) -> Plant:
    """The plant with its unknowns filled in; muscles on both sides share their parameters.

    Args:
        plant: as `rig` gives it.
        rotor_inertia: J, None where metadata state it.
        friction: its law, with D.
        muscle: Table 2's parameters, None where there is no muscle.
        values: of the other parts, by table and key, such as "element_a.rate".
    """

    def fill(place: str, part: Part) -> Part:
        if isinstance(part, Muscle) and muscle is not None:
            return dataclasses.replace(part, parameters=muscle)
        return filled(place, part, values)

    side_a, side_b, actuator = (fill(place, part) for place, part in parts_in(plant).items())
    return dataclasses.replace(
        plant,
        rotor_inertia=_where_unknown(plant.rotor_inertia, rotor_inertia),
        friction=friction,
        side_a=side_a,
        side_b=side_b,
        actuator=actuator,
    )


def _where_unknown(stated: Array | float, value: Array | float | None) -> Array | float:
    if value is None:
        return stated
    if isinstance(stated, float):
        return value if math.isnan(stated) else stated
    return jnp.where(jnp.isnan(stated), value, stated)


def outputs_of(run: Run) -> tuple[Run, ...]:
    """A run of each quantity that was measured and is to be explained.

    The coordinate (or its rate), but where it is imposed; the force, at the coordinate as logged; and the
    temperatures of muscles that power heats.
    """
    if run.imposed is not None:
        return (run,)
    force = (run.of_force(),) if run.has_force else ()
    powered = [side for side in SIDES if run.metadata.is_heated_by_power(side)]
    heat = tuple(run.of_temperature(side) for side in powered if run.has_thermometer(side))
    moves = () if run.metadata.protocol == "imposed" and force else (run,)
    return (*moves, *force, *heat)


def output_of(run: Run) -> Output:
    """What the run's readings are of."""
    return Temperature(SIDES.index(run.heated)) if run.heated else OUTPUTS[run.measured]


def restores(run: Run) -> bool:
    """Whether anything pulls the coordinate back, so that initial errors do not grow with time."""
    return {run.metadata.element_a.kind, run.metadata.element_b.kind} != {"none"}


def driving_force(run: Run) -> float:
    """Typical generalised force that drives the run [N m or N], from metadata and inputs only.

    That of load, drive and arms; of springs where there is nothing else. What is not stated is left
    out; 0 where nothing is.
    """
    if run.measured == "temperature":
        return 0.0
    if run.measured == "force":
        return float(abs(run.output).max()) * tension_lever(run)
    plant, table = rig(run.metadata), run.table
    still = jnp.zeros(())
    signal = float((table["applied"] ** 2).mean() ** 0.5)
    forces = [
        float(table["load"].max()) * GRAVITY * plant.load_lever,
        float(jnp.abs(_sized(plant.actuator).force(jnp.asarray(signal), still))),
        *(float(jnp.abs(side.moment)) for side in _sides(plant) if isinstance(side, Arm)),
    ]
    return _largest(forces) or _element_force(run, plant)


def greatest_force(run: Run) -> float:
    """Greatest generalised force that all parts together exert [N m or N]; 0 where one is unknown."""
    plant = rig(run.metadata)
    if run.has_muscle or any(part.estimated() for part in parts_in(plant).values()):
        return 0.0
    signal, still = jnp.asarray(run.table["applied"].abs().max()), jnp.zeros(())
    drive = float(jnp.abs(plant.actuator.force(signal, still)))
    hanging = float(run.table["load"].max()) * GRAVITY * plant.load_lever
    return hanging + drive + _element_force(run, plant)


def stated_inertia(run: Run) -> float:
    """Inertia that metadata state of the moving part and its arms [kg m^2 or kg]; 0 where none."""
    plant = rig(run.metadata)
    parts = (plant.rotor_inertia, *(side.inertia() for side in _sides(plant)))
    return sum(float(part) for part in parts if np.isfinite(float(part)))


def _sized[P: Part](part: P) -> P:
    """The part without what is unknown of it, but for what all its force is in proportion to."""
    left_out = {key: jnp.zeros(()) for key in part.unknowns if key not in IN_PROPORTION}
    return part.filled(left_out)


def _sides(plant: Plant) -> tuple[Element, Element]:
    return plant.side_a, plant.side_b


def _largest(forces: list[float]) -> float:
    return max((force for force in forces if math.isfinite(force)), default=0.0)


def _element_force(run: Run, plant: Plant) -> float:
    """Largest force of the run's stated springs over its readings; 0 without any."""
    pulling = [side for side in _sides(plant) if not isinstance(side, Muscle | NoElement)]
    if not pulling:
        return 0.0
    course = _course(run)
    q = jnp.linspace(float(course.min()), float(course.max()), 16)
    none = jnp.zeros(())

    def of(side: Element) -> float:
        sized = _sized(side)
        at = jax.vmap(lambda x: sized.force(Instant(x, none, none, none, none, {}), ()))
        return float(jnp.abs(at(q)).max())

    return _largest([of(side) for side in pulling])


def _course(run: Run) -> np.ndarray:
    """The coordinate of every row [rad or m]; where a velocity is measured, about its own middle."""
    if run.measured != "velocity":
        return run.coordinate
    moved = np.cumsum(run.output * np.gradient(run.table["time"].to_numpy()))
    return moved - 0.5 * (moved.min() + moved.max())


def tension_lever(run: Run) -> float:
    """Lever of side A's element at q = 0 [m/rad or 1]; 1 where there is none."""
    element = rig(run.metadata).side_a
    linkage = getattr(element, "linkage", None)
    return 1.0 if linkage is None else abs(float(linkage.lever(jnp.asarray(0.0))))


def strains(run: Run) -> Float[np.ndarray, " row"]:
    """Strain of the run's muscle at every reading; side A's where both sides have one."""
    plant = rig(run.metadata)
    muscle = plant.side_a if isinstance(plant.side_a, Muscle) else plant.side_b
    return np.asarray(muscle.strain(jnp.asarray(run.coordinate)))
