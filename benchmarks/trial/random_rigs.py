"""Other rigs with other true parameters, for trials of the inference's calibration."""

from dataclasses import replace

import numpy as np

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.twin.plant.linkage import Side
from muscle_bayes.twin.plant.parameters import MuscleParameters, Truth
from muscle_bayes.twin.plant.rig import Element, Fixture, Rig
from muscle_bayes.twin.plant.springs import Muscle
from muscle_bayes.twin.protocols import HOT

LIGHTEST, HEAVIEST = 0.060, 0.212
"""Training load and heaviest test load that a random rig must carry between its stops, kg."""

_MARGIN = 0.1
_SPREAD = 0.2


def random_rig(rng: np.random.Generator) -> Rig:
    """A rig of other geometry and truth that can run every protocol without meeting a stop.

    Stiffnesses, forces, J, D and H scatter by 20 % about Tables 1 and 2, the thermal offset and
    the geometry by about 10 %.
    """
    while True:
        rig = _draw(rng)
        if _stays_between_stops(rig):
            return rig


def _draw(rng: np.random.Generator) -> Rig:
    default, muscle = Truth(), MuscleParameters()

    def scattered(value: float, spread: float = _SPREAD) -> float:
        return value * float(np.exp(spread * rng.standard_normal()))

    def between(lower: float, upper: float) -> float:
        return float(rng.uniform(lower, upper))

    radius = round(between(0.026, 0.034), 4)
    anchor_y = round(between(0.105, 0.125), 4)
    scaled = {
        name: scattered(getattr(muscle, name))
        for name in ("F_hyst_min", "K_hyst", "F_modulus_min", "K_modulus", "H")
    }
    drawn = replace(
        muscle,
        **scaled,
        A=scattered(muscle.A, 0.1),
        B=scattered(muscle.B, 0.1),
        C=muscle.C + 0.003 * float(rng.standard_normal()),
        T_hyst_offset=between(-280.0, -210.0),
    )
    return Rig(
        fixture=Fixture(
            rotor_radius_a=radius,
            anchor_x_a=round(radius * between(0.9, 1.1), 4),
            anchor_y_a=anchor_y,
            disc_radius=round(between(0.075, 0.095), 4),
            room_temperature=round(between(20.0, 27.0), 1),
        ),
        element_a=Element(kind="muscle", base_length=round(anchor_y * between(0.84, 0.90), 4)),
        truth=replace(default, J=scattered(default.J), D=scattered(default.D), muscle_a=drawn),
    )


def _stays_between_stops(rig: Rig) -> bool:
    """Neither the hot, trained muscle nor the relaxed, cold one lets the rotor reach a stop.

    Relaxed under the heaviest load it must be able to pull back from some angle up to 0.75 rad: the
    lever shrinks farther up, where a load that gets there runs away.
    """
    hot = _net_torque(rig, rig.fixture.stops[0] + _MARGIN, LIGHTEST, HOT, 0.0)
    return hot > 0.0 and any(_holds_at(rig, angle) for angle in (-0.25, 0.0, 0.25, 0.5, 0.75))


def _holds_at(rig: Rig, angle: float) -> bool:
    """At room temperature, HYST carrying what the heaviest load asks for, the muscle pulls back."""
    room, step = rig.fixture.room_temperature, 1e-6
    side = _side(rig, 0.0, room)
    lever = (side.length(angle + step) - side.length(angle - step)) / (2.0 * step)
    tension = HEAVIEST * GRAVITY * rig.fixture.disc_radius / lever
    return _net_torque(rig, angle, HEAVIEST, room, _hyst_at(rig, tension)) < 0.0


def _hyst_at(rig: Rig, tension: float) -> float:
    """sigma_hyst at which HYST's spring carries a tension (eq. 14)."""
    p, base = rig.truth.muscle_a, rig.element_a.base_length
    return p.epsilon + max(tension - p.F_hyst_min, 0.0) / (p.K_hyst * base)


def _side(rig: Rig, hyst: float, temperature: float) -> Side:
    muscle = Muscle(rig.truth.muscle_a, rig.element_a.base_length, hyst=hyst)
    muscle.begin(temperature, temperature, 1.0)
    fixture = rig.fixture
    return Side(muscle, fixture.rotor_radius_a, fixture.anchor_x_a, fixture.anchor_y_a)


def _net_torque(rig: Rig, angle: float, mass: float, temperature: float, hyst: float) -> float:
    load = mass * GRAVITY * rig.fixture.disc_radius
    return load + _side(rig, hyst, temperature).torque(angle)
