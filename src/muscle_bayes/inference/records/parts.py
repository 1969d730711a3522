"""From a run's metadata to the parts of its plant; what metadata leave open is unknown (NaN)."""

from functools import singledispatch

import jax.numpy as jnp

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.data.describing import elements as described
from muscle_bayes.data.describing import tables
from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.physics.actuators import (
    Actuator,
    CurrentDrive,
    KnownForce,
    ScaledForce,
    VoltageDrive,
)
from muscle_bayes.physics.elements import (
    Arm,
    Element,
    Muscle,
    NoElement,
    ReferenceSpring,
    Spring,
    TorsionSpring,
)
from muscle_bayes.physics.heater import HeatedBody, Heater, LoggedTemperature
from muscle_bayes.physics.linkage import Drum, Linkage, Pins, Straight
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.unknown import UNKNOWN, Part

HEATERS = ("heater_a", "heater_b")
PLACES = ("element_a", "element_b", "drive", *HEATERS)
"""Tables of the metadata that describe parts with parameters."""
_UNKNOWN_MUSCLE = MuscleParameters(*([jnp.nan] * 9))
_MOTORS: dict[str, type[CurrentDrive | ScaledForce]] = {
    "current": CurrentDrive,
    "force": ScaledForce,
    "torque": ScaledForce,
}


def _or_unknown(value: float | None) -> float:
    return UNKNOWN if value is None else value


def _linkage(
    element: described.MuscleElement | described.SpringElement, metadata: Metadata, side: str
) -> Linkage:
    mirror = 1.0 if side == "a" else -1.0
    if element.linkage == "drum":
        assert element.length_at_zero is not None, "the metadata guarantee it"
        assert element.drum_radius is not None, "the metadata guarantee it"
        return Drum(element.length_at_zero, element.drum_radius, mirror)
    if element.linkage == "straight":
        return Straight(element.length_at_zero or 0.0, mirror)
    fixture = metadata.fixture
    return Pins(
        getattr(fixture, f"rotor_radius_{side}"),
        getattr(fixture, f"anchor_x_{side}"),
        getattr(fixture, f"anchor_y_{side}"),
        mirror,
    )


@singledispatch
def _element(element: described.Table, metadata: Metadata, side: str) -> Element:
    """The element that a table of the metadata describes."""
    raise TypeError(f"no element is described by {type(element).__name__}")


@_element.register
def _(element: described.NoElement, metadata: Metadata, side: str) -> Element:
    return NoElement()


@_element.register
def _(element: described.MuscleElement, metadata: Metadata, side: str) -> Element:
    heated = 1.0 if element.heater_length is None else element.heater_length / element.base_length
    linkage = _linkage(element, metadata, side)
    room = metadata.fixture.room_temperature
    return Muscle(linkage, element.base_length, heated, room, _UNKNOWN_MUSCLE)


@_element.register
def _(element: described.SpringElement, metadata: Metadata, side: str) -> Element:
    if metadata.is_reference_spring(side):
        return ReferenceSpring(_linkage(element, metadata, side))
    keys = ("rate", "tension_at_zero", "damping")
    stated = {key: _or_unknown(getattr(element, key)) for key in keys}
    if element.linkage == "torsion":
        return TorsionSpring(**stated)
    return Spring(
        _linkage(element, metadata, side),
        **stated,
        free_length=_or_unknown(element.free_length),
        closed_length=element.closed_length,
    )


@_element.register
def _(element: described.ArmElement, metadata: Metadata, side: str) -> Element:
    moment, inertia, hanging = element.moment, element.moment_of_inertia, element.hanging_angle
    if element.mass is not None and element.centre_distance is not None:
        moment = element.mass * GRAVITY * element.centre_distance
        inertia = element.mass * element.centre_distance**2 if inertia is None else inertia
    if inertia is None and metadata.fixture.inertia is None:
        inertia = 0.0  # it is part of J
    if hanging is None and moment is not None:
        hanging = 0.0
    return Arm(_or_unknown(moment), _or_unknown(inertia), _or_unknown(hanging))


def actuator_of(metadata: Metadata) -> Actuator:
    """What the logged drive does, as [drive] and the column's unit say."""
    drive, kind = metadata.drive, metadata.drive_unit.kind
    if drive is None and kind in ("force", "torque"):
        return KnownForce()
    gain, offset = (None if drive is None else getattr(drive, key) for key in ("gain", "offset"))
    if kind in _MOTORS:
        return _MOTORS[kind](_or_unknown(gain), _or_unknown(offset))
    back_emf = None if drive is None else drive.back_emf
    return VoltageDrive(_or_unknown(gain), _or_unknown(offset), _or_unknown(back_emf))


def element_of(metadata: Metadata, side: str) -> Element:
    """The element of a side, "a" or "b"."""
    return _element(getattr(metadata, f"element_{side}"), metadata, side)


def heaters_of(metadata: Metadata) -> tuple[Heater, Heater]:
    """What says the temperatures of sides A and B."""

    def of(side: str) -> Heater:
        if not metadata.is_heated_by_power(side):
            return LoggedTemperature()
        table = getattr(metadata, f"heater_{side}") or tables.Heater()
        known = _or_unknown(table.heating_rate), _or_unknown(table.cooling_time)
        return HeatedBody(*known, room=metadata.fixture.room_temperature)

    return of("a"), of("b")


def parts_of(metadata: Metadata) -> dict[str, Part]:
    """The parts of a run's plant by the table of the metadata that describes them."""
    return {
        "element_a": element_of(metadata, "a"),
        "element_b": element_of(metadata, "b"),
        "drive": actuator_of(metadata),
        **dict(zip(HEATERS, heaters_of(metadata), strict=True)),
    }
