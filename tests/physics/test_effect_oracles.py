"""One thing known about each effect."""

from math import sqrt

import jax.numpy as jnp
import numpy as np
import pytest
from example_plants import BASE, LinearSpring, creep, muscle_plant, plant, release, schedule

from muscle_bayes.physics.effects import BiasTorque, CoilContact, ThermalLag, ViscousFriction
from muscle_bayes.physics.friction import CoulombFriction
from muscle_bayes.physics.plant import Drive
from muscle_bayes.physics.schedule import filtered

STIFFNESS, INERTIA = 0.15, 0.002


def oscillator():
    frictionless = CoulombFriction(jnp.asarray(0.0))
    return plant(LinearSpring(STIFFNESS), inertia=INERTIA, friction=frictionless)


def test_viscous_friction_decays_exponentially():
    made = oscillator() + ViscousFriction(jnp.asarray(0.003))
    decay = 0.003 / (2 * INERTIA)
    rate = sqrt(STIFFNESS / INERTIA - decay**2)
    time = np.linspace(0.0, 6.0, 1201)
    t = time[1:]
    exact = 0.4 * np.exp(-decay * t) * (np.cos(rate * t) + decay / rate * np.sin(rate * t))
    np.testing.assert_allclose(release(made, schedule(time), 0.4).sensed, exact, atol=1e-7)


@pytest.mark.parametrize("torque", [0.02, -0.05])
def test_bias_torque_shifts_equilibrium_by_itself_over_stiffness(torque):
    made = oscillator() + BiasTorque(jnp.asarray(torque))
    seen = creep(made, schedule(np.linspace(0.0, 1.0, 3)), 0.3)
    np.testing.assert_allclose(seen.sensed, torque / STIFFNESS, rtol=1e-12)


@pytest.mark.parametrize("onset", [0.0, 0.03])
def test_coil_contact_adds_its_force_below_its_onset_only(onset):
    plain = muscle_plant()
    touching = plain + CoilContact(jnp.asarray(200.0), jnp.asarray(onset), jnp.asarray(0.0))
    none = jnp.asarray(0.0)
    drive = Drive(jnp.full(2, 60.0), jnp.asarray(0.1), none)
    element = plain.side_a
    for q in (-0.9, -0.55, -0.5, -0.45, 0.1):
        at = jnp.asarray(q), none, jnp.full(2, 0.02), drive
        strain = float(element.linkage.length(jnp.asarray(q))) / BASE - 1.0
        added = -float(touching.force(*at) - plain.force(*at)) / float(element.linkage.lever(at[0]))
        exact = 200.0 * (strain - onset) if strain < onset else 0.0
        assert added == pytest.approx(exact, abs=1e-12)
        # The coils stand beside the three elements in series: HYST does not feel them.
        np.testing.assert_array_equal(touching.hyst_rate(*at), plain.hyst_rate(*at))


def ramp(t):
    return 25.0 + 3.0 * np.minimum(t, 20.0)


def lagged(t, tau):
    """First-order lag of the ramp above, in closed form."""
    rising = 25.0 + 3.0 * (t - tau * (1.0 - np.exp(-t / tau)))
    top = 25.0 + 3.0 * (20.0 - tau * (1.0 - np.exp(-20.0 / tau)))
    held = 85.0 + (top - 85.0) * np.exp(-(t - 20.0) / tau)
    return np.where(t <= 20.0, rising, held)


@pytest.mark.parametrize("tau", [0.5, 7.0, 100.0])
def test_thermal_lag_is_exact_however_time_is_cut(tau):
    for time in (np.linspace(0.0, 60.0, 61), np.r_[0.0, 0.1, 13.7, 20.0, 20.0, 59.0, 60.0]):
        seen = filtered(schedule(time, ramp), (ThermalLag(jnp.asarray(tau)),))
        both_sides = np.stack([lagged(time, tau)] * 2, axis=1)
        np.testing.assert_allclose(seen.temperature, both_sides, rtol=1e-12)


def test_thermal_lag_of_no_time_is_exactly_the_thermometer():
    heat = schedule(np.linspace(0.0, 60.0, 601), lambda t: 50.0 + 20.0 * np.sin(t**1.5))
    seen = filtered(heat, (ThermalLag(jnp.asarray(0.0)),))
    np.testing.assert_array_equal(seen.temperature, heat.temperature)


def test_thermal_lag_is_what_the_muscle_feels():
    time = np.linspace(0.0, 60.0, 121)
    late = creep(muscle_plant() + ThermalLag(jnp.asarray(7.0)), schedule(time, ramp, 0.139), -0.2)
    felt = creep(muscle_plant(), schedule(time, lambda t: lagged(t, 7.0), 0.139), -0.2)
    np.testing.assert_allclose(late.sensed, felt.sensed, rtol=1e-9)
    assert np.ptp(late.sensed) > 0.05
