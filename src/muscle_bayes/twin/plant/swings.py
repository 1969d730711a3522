"""Spring tests that fit a rig: how far a released weight swings, by energy."""

from dataclasses import replace
from math import hypot

import numpy as np

from muscle_bayes.conventions import GRAVITY, SPRING_INTERCEPT, SPRING_MIN_LENGTH, SPRING_RATE
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.plant.linkage import Side
from muscle_bayes.twin.plant.rig import Element, Rig
from muscle_bayes.twin.plant.springs import ReferenceSpring

SPRING_ANCHOR_Y = 0.050
"""Height of the stator pin in spring tests, m: the spring stays above its least length."""


def spring_rig(rig: Rig, anchor_y: float = SPRING_ANCHOR_Y) -> Rig:
    """The same rotor with the reference spring on side A and nothing on side B."""
    return replace(
        rig,
        fixture=replace(rig.fixture, anchor_y_a=anchor_y),
        element_a=Element(kind="spring"),
        element_b=Element(),
    )


def mass_for_swing(rig: Rig, peak: float) -> float:
    """Mass [kg] that, released at theta = 0, first turns back at `peak` [rad].

    m g R_d peak = U(peak) - U(0) + D peak; linear friction is left out, it only shortens the swing.
    """
    fixture = rig.fixture
    side = Side(ReferenceSpring(), fixture.rotor_radius_a, fixture.anchor_x_a, fixture.anchor_y_a)
    start = hypot(fixture.anchor_x_a - fixture.rotor_radius_a, fixture.anchor_y_a)
    if start < SPRING_MIN_LENGTH:
        raise MuscleBayesError(
            f"the reference spring is {start * 1000:.1f} mm long at theta = 0, its least length is "
            f"{SPRING_MIN_LENGTH * 1000:.2f} mm; move its stator pin"
        )
    end = side.length(peak)
    work = 0.5 * SPRING_RATE * (end**2 - start**2) + SPRING_INTERCEPT * (end - start)
    if rig.truth.friction_law == "coulomb":
        work += rig.truth.D * peak
    return work / (GRAVITY * fixture.disc_radius * peak)


def spring_masses(rig: Rig, count: int = 5) -> list[float]:
    """Masses [kg] whose swings peak between 0.5 and 0.85 rad, to 0.1 g."""
    peaks = np.linspace(0.5, 0.85, count).tolist()
    return [round(mass_for_swing(rig, peak), 4) for peak in peaks]
