"""From a run's metadata to a plant whose unknown parameters are still to be filled in."""

import dataclasses
import math

import jax
import jax.numpy as jnp

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.data.metadata import Fixture, Metadata
from muscle_bayes.data.run import Run
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.element import (
    Arm,
    Element,
    Instant,
    Muscle,
    NoElement,
    ReferenceSpring,
    Spring,
    TorsionSpring,
)
from muscle_bayes.physics.friction import CoulombFriction, FrictionLaw
from muscle_bayes.physics.linkage import Drum, Linkage, Pins, Straight
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.plant import Plant

_UNKNOWN = jnp.nan
_UNKNOWN_MUSCLE = MuscleParameters(*([_UNKNOWN] * 9))


def _linkage(element, fixture: Fixture, side: str) -> Linkage:
    mirror = 1.0 if side == "a" else -1.0
    if element.linkage == "drum":
        return Drum(element.length_at_zero, element.drum_radius, mirror)
    if element.linkage == "straight":
        return Straight(element.length_at_zero, mirror)
    return Pins(
        getattr(fixture, f"rotor_radius_{side}"),
        getattr(fixture, f"anchor_x_{side}"),
        getattr(fixture, f"anchor_y_{side}"),
        mirror,
    )


def _element(metadata: Metadata, side: str) -> Element:
    element = getattr(metadata, f"element_{side}")
    fixture = metadata.fixture
    if element.kind == "none":
        return NoElement()
    if element.kind == "arm":
        return Arm(element.mass, element.centre_distance, element.hanging_angle)
    if element.kind == "spring":
        return _spring(element, fixture, side)
    linkage = _linkage(element, fixture, side)
    heated = 1.0 if element.heater_length is None else element.heater_length / element.base_length
    return Muscle(linkage, element.base_length, heated, fixture.room_temperature, _UNKNOWN_MUSCLE)


def _spring(element, fixture: Fixture, side: str) -> Element:
    """The spring that metadata state; the thesis' reference spring where they state none of it."""
    stated = {
        key: getattr(element, key)
        for key in ("rate", "free_length", "tension_at_zero", "closed_length", "damping")
        if getattr(element, key) is not None
    }
    if not stated and element.linkage != "torsion":
        return ReferenceSpring(_linkage(element, fixture, side))
    pull = "tension_at_zero" in stated or "free_length" in stated
    if "rate" not in stated or not pull:
        raise MuscleBayesError(
            f"[element_{side}] is a spring whose rate or pull is not stated; springs are not estimated "
            "yet. Fix: give rate and free_length, or rate and tension_at_zero"
        )
    rate, damping = stated["rate"], stated.get("damping", 0.0)
    if element.linkage == "torsion":
        return TorsionSpring(rate, stated["tension_at_zero"], damping)
    if element.length_at_zero is None and element.linkage == "straight":
        linkage: Linkage = Straight(0.0, 1.0 if side == "a" else -1.0)
    else:
        linkage = _linkage(element, fixture, side)
    free = stated.get("free_length")
    if free is None:
        free = float(linkage.length(jnp.asarray(0.0))) - stated["tension_at_zero"] / rate
    return Spring(linkage, rate, free, stated.get("closed_length"), damping)


def rig(metadata: Metadata) -> Plant:
    """The plant of a run with J, friction and muscle parameters still unknown (NaN)."""
    fixture = metadata.fixture
    linear = fixture.motion == "linear"
    lever = 1.0 if linear else (fixture.disc_radius or 0.0)
    return Plant(
        rotor_inertia=_UNKNOWN,
        friction=CoulombFriction(_UNKNOWN),
        side_a=_element(metadata, "a"),
        side_b=_element(metadata, "b"),
        load_lever=lever,
        stops=tuple(fixture.stops) if fixture.stops is not None else (-math.inf, math.inf),
    )


def with_parameters(
    plant: Plant, rotor_inertia, friction: FrictionLaw, muscle: MuscleParameters | None
) -> Plant:
    """The plant with its unknowns filled in; muscles on both sides share their parameters."""

    def fill(element: Element) -> Element:
        if isinstance(element, Muscle) and muscle is not None:
            return dataclasses.replace(element, parameters=muscle)
        return element

    return dataclasses.replace(
        plant,
        rotor_inertia=rotor_inertia,
        friction=friction,
        side_a=fill(plant.side_a),
        side_b=fill(plant.side_b),
    )


def has_muscle(run: Run) -> bool:
    """Whether a muscle hangs on either side."""
    return "muscle" in (run.metadata.element_a.kind, run.metadata.element_b.kind)


def restores(run: Run) -> bool:
    """Whether anything pulls the coordinate back, so that initial errors do not grow with time."""
    return {run.metadata.element_a.kind, run.metadata.element_b.kind} != {"none"}


def driving_force(run: Run) -> float:
    """Typical generalised force that drives the run [N m or N], from metadata and inputs only."""
    metadata = run.metadata
    linear = metadata.fixture.motion == "linear"
    lever = 1.0 if linear else (metadata.fixture.disc_radius or 0.0)
    forces = [float(run.table["load"].max()) * GRAVITY * lever]
    forces.append(float((run.table["applied"] ** 2).mean() ** 0.5))
    for element in (metadata.element_a, metadata.element_b):
        if element.kind == "arm":
            forces.append(element.mass * GRAVITY * element.centre_distance)
    return max(forces) or _spring_force(run)


def _spring_force(run: Run) -> float:
    """Largest force of the run's springs over its readings; 0 without springs."""
    plant = rig(run.metadata)
    q = jnp.linspace(float(run.coordinate.min()), float(run.coordinate.max()), 16)
    still, none = jnp.zeros(()), jnp.zeros(())
    sides = [
        jnp.abs(jax.vmap(lambda x, s=side: s.force(Instant(x, still, none, none, none, {}), ()))(q))
        for side in (plant.side_a, plant.side_b)
        if isinstance(side, ReferenceSpring | Spring | TorsionSpring)
    ]
    return max((float(one.max()) for one in sides), default=0.0)


def tension_lever(run: Run) -> float:
    """Lever of side A's element at q = 0 [m/rad or 1]; 1 where there is none."""
    element = rig(run.metadata).side_a
    linkage = getattr(element, "linkage", None)
    return 1.0 if linkage is None else abs(float(linkage.lever(jnp.asarray(0.0))))


def first_strain(run: Run) -> float:
    """Strain of the run's muscle at its first reading; side A's where both sides have one."""
    plant = rig(run.metadata)
    muscle = plant.side_a if isinstance(plant.side_a, Muscle) else plant.side_b
    q = jnp.asarray(float(run.sensor.coordinate(run.table["reading"].iloc[0])))
    return float(muscle.strain(q))
