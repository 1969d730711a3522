"""The assembled bench against the equations as printed, solved by a general ODE solver."""

from dataclasses import replace
from math import cos, hypot, sin

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from muscle_bayes.twin import Fixture, MuscleParameters, Rig, Truth
from muscle_bayes.twin.bench import Bench

P, F, BASE, MASS, PWM = MuscleParameters(), Fixture(), 0.100, 0.150, 60.0


def spring(stretch: float, rate: float, least: float) -> float:
    """Eq. 13, 14."""
    if stretch > P.epsilon:
        return BASE * (stretch - P.epsilon) * rate + least
    return max(least / P.epsilon * stretch, 0.0)


def test_a_heated_swing_follows_the_equations():
    rig = Rig(truth=replace(Truth(), friction_law="linear", J=0.0013139, D=0.00415667))
    inertia = 0.0013139 + MASS * F.disc_radius**2

    def slope(time: float, state: np.ndarray) -> list[float]:
        angle, velocity, hyst, heat = state
        x = F.anchor_x_a - F.rotor_radius_a * cos(angle)
        y = F.anchor_y_a + F.rotor_radius_a * sin(angle)
        length = hypot(x, y)
        offset = P.A * heat**2 + P.B * heat + P.C
        force = spring(length / BASE - 1 - offset - hyst, P.K_modulus, P.F_modulus_min)
        pull = spring(hyst, P.K_hyst, P.F_hyst_min)
        lever = F.rotor_radius_a / length * (F.anchor_y_a * cos(angle) + F.anchor_x_a * sin(angle))
        torque = MASS * 9.80665 * F.disc_radius - force * lever - 0.00415667 * velocity
        return [
            velocity,
            torque / inertia,
            (force - pull) / (P.H * (heat + P.T_hyst_offset) * BASE),
            4.5 * PWM / 255.0 - (heat - 25.0) / 48.0,
        ]

    bench = Bench(rig, load=MASS, hyst=0.03)
    bench.place(-0.1)
    bench.channels[0].pwm = PWM
    angles, hysts = [], []
    for _ in range(200):
        bench.advance(0.05)
        muscle = bench.muscles[0]
        assert muscle is not None
        angles.append(bench.rotor.angle)
        hysts.append(muscle.hyst)
    times = 0.05 * np.arange(1, 201)
    exact = solve_ivp(
        slope, (0.0, 10.0), [-0.1, 0.0, 0.03, 25.0], t_eval=times, rtol=1e-9, atol=1e-11
    ).y
    assert np.ptp(exact[0]) > 0.1
    assert angles == pytest.approx(exact[0], abs=2e-5)
    assert hysts == pytest.approx(exact[2], abs=2e-7)
