"""Forces where the coordinate is imposed, against an independent integrator and closed forms."""

import jax.numpy as jnp
import numpy as np
from example_plants import TABLE_2, muscle, plant, schedule
from scipy.integrate import solve_ivp

from muscle_bayes.physics.effects.sensing.thermal_lag import ThermalLag
from muscle_bayes.physics.elements import Arm, Spring, TorsionSpring
from muscle_bayes.physics.imposed import imposed_response
from muscle_bayes.physics.linkage import Straight
from muscle_bayes.physics.springs import tensile_spring

BASE = 0.1


def imposed(time: np.ndarray, q: np.ndarray) -> jnp.ndarray:
    """Mean coordinate and speed of straight lines between nodes."""
    middles = 0.5 * (q[1:] + q[:-1])
    return jnp.stack([jnp.asarray(middles), jnp.asarray(np.diff(q) / np.diff(time))], 1)


def test_a_muscle_that_is_held_relaxes_as_its_equations_say() -> None:
    """Held at 20 % strain, heated by 40 K: eq. 15 by scipy's LSODA."""
    time = np.arange(0.0, 200.5, 0.5)
    heat = lambda t: 25.0 + 40.0 * np.clip(t / 50.0, 0.0, 1.0)  # noqa: E731
    held = 0.02 * np.ones(time.size)
    rig = plant(muscle(Straight(BASE, 1.0)), lever=1.0)
    found = imposed_response(rig, schedule(time, heat), imposed(time, held), jnp.full(2, 0.01))
    p = TABLE_2

    def tension(t: float, hyst: float) -> float:
        offset = p["A"] * heat(t) ** 2 + p["B"] * heat(t) + p["C"]
        stretch = 0.2 - offset - hyst
        return float(tensile_spring(stretch, BASE * p["K_modulus"], p["F_modulus_min"]))

    def rate(t: float, y: np.ndarray) -> list[float]:
        spring = float(tensile_spring(y[0], BASE * p["K_hyst"], p["F_hyst_min"]))
        damper = p["H"] * (heat(t) + p["T_hyst_offset"])
        return [(tension(t, y[0]) - spring) / (damper * BASE)]

    middles = 0.5 * (time[1:] + time[:-1])
    solved = solve_ivp(rate, (0.0, 200.0), [0.01], "LSODA", middles, rtol=1e-9, atol=1e-12)
    wanted = [tension(t, h) for t, h in zip(middles, solved.y[0], strict=True)]
    np.testing.assert_allclose(found.averaged, wanted, rtol=2e-4)


def test_a_spring_with_a_damper_that_is_pulled_to_and_fro() -> None:
    time = np.arange(0.0, 5.0, 0.01)
    x = 0.01 * np.sin(3.0 * time)
    spring = Spring(Straight(BASE, 1.0), 300.0, tension_at_zero=2.0, damping=5.0)
    found = imposed_response(plant(spring), schedule(time), imposed(time, x), jnp.zeros(2))
    middles = 0.5 * (time[1:] + time[:-1])
    wanted = 2.0 + 300.0 * 0.01 * np.sin(3.0 * middles) + 5.0 * 0.03 * np.cos(3.0 * middles)
    np.testing.assert_allclose(found.averaged, wanted, rtol=1e-3, atol=1e-3)


def test_elements_without_a_length_show_their_torque() -> None:
    time, q = np.arange(0.0, 1.0, 0.1), np.linspace(0.0, 0.9, 10)
    middles = 0.5 * (q[1:] + q[:-1])
    arm = imposed_response(
        plant(Arm(0.3, 0.0, 0.1)), schedule(time), imposed(time, q), jnp.zeros(2)
    )
    np.testing.assert_allclose(arm.averaged, 0.3 * np.sin(middles - 0.1), rtol=1e-12)
    spring = plant(TorsionSpring(0.5, 0.02, 0.0))
    found = imposed_response(spring, schedule(time), imposed(time, q), jnp.zeros(2))
    np.testing.assert_allclose(found.averaged, 0.02 + 0.5 * middles, rtol=1e-12)


def test_filters_of_the_temperature_act() -> None:
    time = np.arange(0.0, 60.0, 0.5)
    held, heated = imposed(time, 0.02 * np.ones(time.size)), schedule(time, lambda t: 25.0 + t)
    rig = plant(muscle(Straight(BASE, 1.0)), lever=1.0)
    at_once = imposed_response(rig, heated, held, jnp.full(2, 0.01)).averaged
    late = imposed_response(rig + ThermalLag(10.0), heated, held, jnp.full(2, 0.01)).averaged
    assert float(jnp.abs(late - at_once).max()) > 0.05
