"""Both ways of solving against the printed equations in an event-driven general solver."""

import jax.numpy as jnp
import numpy as np
from example_plants import (
    BASE,
    DISC,
    MUSCLE_PINS,
    TABLE_2,
    D,
    J,
    creep,
    muscle_plant,
    plant,
    release,
    schedule,
)
from reference_solver import (
    GRAVITY,
    muscle_tension_and_rate,
    side_a,
    side_b,
    solve_stick_slip,
    spring_tension,
)

from muscle_bayes.physics.effects import CoilContact
from muscle_bayes.physics.elements import ReferenceSpring
from muscle_bayes.physics.linkage import Pins

CONTACT = (150.0, 0.02)
WIDE_PINS = (0.030, 0.030, 0.070)


def test_springs_on_both_sides_swing_reverse_and_stick():
    loads, pieces = (0.09, 0.12, 0.03), (0.0, 2.5, 3.0, 7.0)

    def piece(k):
        def model(t, q, speed, hyst):
            (one, turns_back), (two, turns_on) = side_a(q, *WIDE_PINS), side_b(q, *WIDE_PINS)
            force = spring_tension(two) * turns_on - spring_tension(one) * turns_back
            return force + loads[k] * GRAVITY * DISC, J + loads[k] * DISC**2, 0.0

        return model

    nodes = np.linspace(0.0, 7.0, 7001)
    exact, events = solve_stick_slip(piece, D, (0.0, 0.0, 0.0), nodes, pieces)
    assert events["reversal"] >= 8
    assert events["stick"] >= 2
    springs = [ReferenceSpring(Pins(*WIDE_PINS, mirror)) for mirror in (1.0, -1.0)]
    hung = schedule(nodes, load=lambda t: np.select([t < 2.5, t < 3.0], loads[:2], loads[2]))
    seen = release(plant(*springs), hung)
    np.testing.assert_allclose(seen.sensed, exact[1:, 0], rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(seen.speed, exact[1:, 1], rtol=0.0, atol=1e-6)
    assert seen.speed[-1] == 0.0


def warming(t):
    return 25.0 + 15.0 * np.minimum(t, 2.0)


def test_a_muscle_swings_through_slack_and_contact_and_sticks():
    loads, pushes = (0.15, 0.15, 0.17, 0.12), (0.0, -0.20, 0.0, 0.0)
    pieces, pieces_seen = (0.0, 1.0, 1.4, 2.0, 5.5), {"slack": 0, "contact": 0}

    def piece(k):
        def model(t, q, speed, hyst):
            length, turns_back = side_a(q, *MUSCLE_PINS)
            strain = length / BASE - 1.0
            tension, rate = muscle_tension_and_rate(
                strain, hyst, warming(t), TABLE_2, BASE, CONTACT
            )
            offset = TABLE_2["A"] * warming(t) ** 2 + TABLE_2["B"] * warming(t) + TABLE_2["C"]
            pieces_seen["slack"] += strain - offset - hyst < 0.0
            pieces_seen["contact"] += strain < CONTACT[1]
            force = loads[k] * GRAVITY * DISC + pushes[k] - tension * turns_back
            return force, J + loads[k] * DISC**2, rate

        return model

    # Fine, because each passage through a spring's kink costs the fourth order there.
    nodes = np.linspace(0.0, 5.5, 22001)
    exact, events = solve_stick_slip(piece, D, (0.0, 0.0, 0.04), nodes, pieces)
    assert pieces_seen["slack"] > 100
    assert pieces_seen["contact"] > 100
    assert events["reversal"] >= 4
    assert events["stick"] >= 1
    driven = schedule(
        nodes,
        warming,
        lambda t: np.select([t < 1.4, t < 2.0], [loads[0], loads[2]], loads[3]),
        lambda t: np.where((t > 1.0) & (t < 1.4), pushes[1], 0.0),
    )
    made = muscle_plant() + CoilContact(*map(jnp.asarray, (*CONTACT, 0.0)))
    seen = release(made, driven, 0.0, 0.04)
    np.testing.assert_allclose(seen.sensed, exact[1:, 0], rtol=0.0, atol=2e-5)
    np.testing.assert_allclose(seen.hyst[:, 0], exact[1:, 2], rtol=0.0, atol=1e-8)


def test_slow_motion_is_full_motion_within_a_tenth_of_a_count():
    load = 0.139

    def heat(t):
        return 25.0 + 45.0 * np.interp(t, [0.0, 5.0, 85.0, 95.0, 175.0, 180.0], [0, 0, 1, 1, 0, 0])

    def piece(k):
        def model(t, q, speed, hyst):
            length, turns_back = side_a(q, *MUSCLE_PINS)
            tension, rate = muscle_tension_and_rate(
                length / BASE - 1.0, hyst, heat(t), TABLE_2, BASE
            )
            return load * GRAVITY * DISC - tension * turns_back, J + load * DISC**2, rate

        return model

    time = np.linspace(0.0, 180.0, 181)
    middle = 0.5 * (time[1:] + time[:-1])
    pieces = (0.0, 5.0, 85.0, 95.0, 175.0, 180.0)
    start = creep(muscle_plant(), schedule([0.0, 1e-9], load=load), 0.0, 0.05).sensed[0]
    state = (float(start), 0.0, 0.05)
    exact, events = solve_stick_slip(piece, D, state, middle, pieces, rtol=1e-6, atol=1e-9)
    assert events["stick"] > 20
    seen = creep(muscle_plant(), schedule(time, heat, load), float(start), 0.05)
    rms = float(np.sqrt(np.mean((np.asarray(seen.sensed) - exact[:, 0]) ** 2)))
    assert np.ptp(exact[:, 0]) > 0.1
    assert rms < 0.1 * 0.0058
