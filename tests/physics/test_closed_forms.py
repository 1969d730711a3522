"""Motion that can be written down: decay, oscillation, dead band, relaxation."""

from math import cos, pi, sin, sqrt

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from example_plants import (
    BASE,
    DISC,
    TABLE_2,
    D,
    LinearSpring,
    creep,
    muscle,
    muscle_plant,
    plant,
    release,
    schedule,
    spring_plant,
)

from muscle_bayes.physics.elements import Arm, ReferenceSpring
from muscle_bayes.physics.friction import CoulombFriction, LinearFriction
from muscle_bayes.physics.linkage import Drum, Pins, Straight
from muscle_bayes.physics.solvers.play import play
from muscle_bayes.physics.state import Drive

G, RATE, INTERCEPT = 9.80665, 145.71, -5.2097


def coulomb_swing(time, start, centre, stiffness, inertia, dry):
    """Released from rest at start: half cosines around centre +- dry/stiffness, until it sticks."""
    band, half = dry / stiffness, pi * sqrt(inertia / stiffness)
    at, out, begin = start - centre, np.full_like(time, np.nan), 0.0
    while abs(at) > band:
        middle = band if at > 0 else -band
        after = time >= begin
        swing = (at - middle) * np.cos(pi * (time[after] - begin) / half)
        out[after] = centre + middle + swing
        at, begin = 2 * middle - at, begin + half
    out[time >= begin] = centre + at
    return out


def linear_rigs():
    """Plants whose force is exactly linear in q: (plant, load, centre, stiffness, inertia)."""
    radius, load = 0.03, 0.15
    drum = ReferenceSpring(Drum(0.06, radius, 1.0))
    mirrored = ReferenceSpring(Drum(0.09, radius, -1.0))
    straight = ReferenceSpring(Straight(0.06, 1.0))
    at_zero, mass = RATE * 0.06 + INTERCEPT, 0.4
    turning = 0.002 + load * DISC**2
    stiffness = RATE * radius**2
    pushed = (load * G * DISC - 0.35 + (RATE * 0.09 + INTERCEPT) * radius) / stiffness
    coulomb = CoulombFriction(jnp.asarray(0.004))
    far = {"friction": coulomb, "stops": (-9.0, 9.0)}
    return {
        "linear": (plant(LinearSpring(0.15), inertia=0.002, **far), 0.0, 0.0, 0.15, 0.002),
        "drum": (
            plant(drum, inertia=0.002, **far),
            load,
            (load * G * DISC - at_zero * radius) / stiffness,
            stiffness,
            turning,
        ),
        "side B": (
            plant(LinearSpring(0.0), mirrored, inertia=0.002, **far),
            load,
            pushed,
            stiffness,
            turning,
        ),
        "carriage": (
            plant(straight, inertia=0.3, lever=1.0, **far),
            mass,
            (mass * G - at_zero) / RATE,
            RATE,
            0.3 + mass,
        ),
    }


@pytest.mark.parametrize("name", ["linear", "drum", "side B", "carriage"])
def test_dry_friction_takes_two_bands_a_cycle_and_then_holds(name):
    made, load, centre, stiffness, inertia = linear_rigs()[name]
    band = 0.004 / stiffness
    start, half = centre - 10.4 * band, pi * sqrt(inertia / stiffness)
    time = np.linspace(0.0, 7.3 * half, 1201)
    push = -0.35 if name == "side B" else 0.0
    seen = release(made, schedule(time, load=load, applied=push), start)
    exact = coulomb_swing(time[1:], start, centre, stiffness, inertia, 0.004)
    np.testing.assert_allclose(seen.sensed, exact, rtol=0.0, atol=1e-7 * 10.4 * band)
    assert exact[-1] == pytest.approx(centre + 0.4 * band, abs=1e-12)
    assert seen.speed[-1] == 0.0


def test_without_friction_the_swing_keeps_frequency_and_amplitude():
    made = plant(LinearSpring(0.15), inertia=0.002, friction=CoulombFriction(jnp.asarray(0.0)))
    rate = sqrt(0.15 / 0.002)
    time = np.linspace(0.0, 20.3 * 2 * pi / rate, 4001)
    seen = release(made, schedule(time), 0.3)
    np.testing.assert_allclose(seen.sensed, 0.3 * np.cos(rate * time[1:]), atol=5e-7)
    np.testing.assert_allclose(seen.speed, -0.3 * rate * np.sin(rate * time[1:]), atol=5e-6)


def test_linear_friction_decays_exponentially():
    damping, inertia, stiffness = 0.003, 0.002, 0.15
    friction = LinearFriction(jnp.asarray(damping))
    made = plant(LinearSpring(stiffness), inertia=inertia, friction=friction)
    decay = damping / (2 * inertia)
    rate = sqrt(stiffness / inertia - decay**2)
    time = np.linspace(0.0, 6.0, 1201)
    seen = release(made, schedule(time), 0.4)
    t = time[1:]
    exact = 0.4 * np.exp(-decay * t) * (np.cos(rate * t) + decay / rate * np.sin(rate * t))
    np.testing.assert_allclose(seen.sensed, exact, atol=1e-7)


@pytest.mark.parametrize(
    ("start", "rest"), [(0.5, 0.25), (-0.5, -0.25), (0.2, 0.2), (-0.25, -0.25), (0.0, 0.0)]
)
def test_play_slides_to_the_edge_of_the_dead_band_and_not_beyond(start, rest):
    assert play(lambda q, k: (-k * q, 0.5), jnp.asarray(start), 2.0, (-9.0, 9.0)) == rest


@pytest.mark.parametrize(("start", "rest"), [(0.5, 0.25), (-0.5, -0.25), (0.4, 0.4), (-0.3, -0.3)])
def test_play_breaks_away_at_the_static_level_and_slides_to_the_sliding_one(start, rest):

    def forces(q, k):
        return -k * q, jnp.where(q == start, 0.8, 0.5)

    assert play(forces, jnp.asarray(start), 2.0, (-9.0, 9.0)) == rest


@pytest.mark.parametrize(("start", "stop"), [(-5.0, -4.0), (5.0, 4.5)])
def test_play_ends_at_a_stop_that_lies_before_the_dead_band(start, stop):
    band = (lambda q, k: (-k * q, 0.01)), jnp.asarray(start), 0.1
    stops = (-8.0, stop) if start < 0 else (stop, 8.0)
    assert play(*band, stops) == stop


@pytest.mark.parametrize("start", [-1.0, 1.0])
@pytest.mark.parametrize("make", [spring_plant, muscle_plant])
def test_slow_motion_stops_where_the_forces_equal_dry_friction(make, start):
    made = make()
    seen = creep(made, schedule([0.0, 1e-9], load=0.12), start)
    drive = Drive(jnp.full(2, 25.0), jnp.asarray(0.12), jnp.asarray(0.0))
    force = made.force(seen.sensed[0], jnp.asarray(0.0), jnp.zeros(2), drive)
    assert float(force) == pytest.approx(-np.sign(start) * D, rel=1e-9)


def test_slow_motion_without_friction_rests_where_the_forces_vanish():
    stiffness, radius = RATE * 0.03**2, 0.03
    friction = CoulombFriction(jnp.asarray(0.0))
    made = plant(ReferenceSpring(Drum(0.06, radius, 1.0)), friction=friction)
    seen = creep(made, schedule(np.linspace(0.0, 5.0, 6), load=0.15), 0.9)
    exact = (0.15 * G * DISC - (RATE * 0.06 + INTERCEPT) * radius) / stiffness
    np.testing.assert_allclose(seen.sensed, exact, rtol=1e-12)
    np.testing.assert_allclose(seen.speed, 0.0, atol=1e-14)


def test_slow_linear_friction_relaxes_at_stiffness_over_damping():
    friction = LinearFriction(jnp.asarray(3.0))
    made = plant(LinearSpring(0.15), friction=friction, stops=(-9.0, 9.0))
    time = np.linspace(0.0, 40.0, 1601)
    seen = creep(made, schedule(time, applied=lambda t: 0.15 * (t > 1.0)), 0.0)
    middle = 0.5 * (time[1:] + time[:-1])
    exact = 1.0 - np.exp(-np.maximum(middle - 1.0, 0.0) * 0.15 / 3.0)
    np.testing.assert_allclose(seen.sensed, exact, atol=3e-4)


def hyst_decay(held: bool):
    """Time constant [s] and end of HYST's strain: at constant strain, or at constant force."""
    p, temperature = TABLE_2, 60.0
    damper = p["H"] * (temperature + p["T_hyst_offset"])
    offset = p["A"] * temperature**2 + p["B"] * temperature + p["C"]
    closed = p["F_hyst_min"] - BASE * p["K_hyst"] * 1e-3
    opened = p["F_modulus_min"] - BASE * p["K_modulus"] * 1e-3
    if held:
        rate = p["K_modulus"] + p["K_hyst"]
        end = (opened - closed + BASE * p["K_modulus"] * (0.15 - offset)) / (BASE * rate)
        return damper / rate, end
    return damper / p["K_hyst"], (5.0 - closed) / (BASE * p["K_hyst"])


@pytest.mark.parametrize("held", [True, False])
def test_hyst_relaxes_exponentially(held):
    constant, end = hyst_decay(held)
    time = np.linspace(0.0, 600.0, 301)
    exact = end + (0.01 - end) * np.exp(-time[1:] / constant)
    # L = 0.115 at q = 0, a strain of 0.15; held by friction, or pulled by exactly 5 N.
    friction = CoulombFriction(jnp.asarray(1e3 if held else 0.0))
    made = plant(muscle(Straight(0.115, 1.0)), friction=friction, lever=1.0, stops=(-1.0, 1.0))
    driven = schedule(time, temperature=60.0, applied=5.0)
    slow = creep(made, driven, 0.0, 0.01)
    np.testing.assert_allclose(slow.hyst[:, 0], exact, atol=4e-6)
    if held:
        np.testing.assert_allclose(release(made, driven, 0.0, 0.01).hyst[:, 0], exact, atol=1e-10)


@pytest.mark.parametrize("dry", [0.0, 0.02])
def test_hyst_creeps_as_the_load_says_though_modulus_is_shut(dry):
    """MODULUS, 4,000 times stiffer while it opens, must not hold HYST back: tension is load -+ D."""
    time, load, temperature = np.linspace(0.0, 600.0, 301), 5.0, 60.0
    damper = TABLE_2["H"] * (temperature + TABLE_2["T_hyst_offset"])
    closed = TABLE_2["F_hyst_min"] - BASE * TABLE_2["K_hyst"] * 1e-3
    end = (load - dry - closed) / (BASE * TABLE_2["K_hyst"])
    exact = end + (0.03 - end) * np.exp(-time[1:] * TABLE_2["K_hyst"] / damper)
    offset = TABLE_2["A"] * temperature**2 + TABLE_2["B"] * temperature + TABLE_2["C"]
    shut = 1e-3 * (load - dry) / 6.0
    start = BASE * (1.0 + offset + 0.03 + shut) - 0.115
    made = plant(
        muscle(Straight(0.115, 1.0), F_modulus_min=6.0),
        friction=CoulombFriction(jnp.asarray(dry)),
        lever=1.0,
        stops=(-1.0, 1.0),
    )
    seen = creep(made, schedule(time, temperature=temperature, applied=load), start, 0.03)
    np.testing.assert_allclose(seen.hyst[:, 0], exact, atol=4e-6)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize("kind", [Pins, Drum, Straight])
def test_lever_is_the_slope_of_length(kind, mirror):
    sizes = {Pins: (0.03, 0.04, 0.11), Drum: (0.1, 0.03), Straight: (0.1,)}
    linkage = kind(*sizes[kind], mirror)
    for q in (-0.9, 0.0, 0.4):
        slope = jax.jacfwd(linkage.length)(jnp.asarray(q))
        assert float(linkage.lever(jnp.asarray(q))) == pytest.approx(float(slope), rel=1e-12)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_pins_are_where_the_drawing_puts_them(mirror):
    r, x, y, q = 0.03, 0.04, 0.11, 0.4
    rotor, stator = mirror * r * np.array([cos(q), sin(q)]), np.array([mirror * x, -y])
    length = Pins(r, x, y, mirror).length(jnp.asarray(q))
    assert float(length) == pytest.approx(float(np.linalg.norm(rotor - stator)), rel=1e-14)


def test_an_arm_swings_as_a_pendulum():
    arm = Arm.of_mass(0.2, 0.15, 0.3)
    frictionless = CoulombFriction(jnp.asarray(0.0))
    made = plant(arm, inertia=0.001, friction=frictionless, stops=(-9.0, 9.0))
    rate = sqrt(0.2 * G * 0.15 / (0.001 + 0.2 * 0.15**2))
    seen = release(made, schedule(np.linspace(0.0, 5.0, 2001)), 0.3 + 1e-4)
    exact = 0.3 + 1e-4 * np.cos(rate * np.linspace(0.0, 5.0, 2001)[1:])
    np.testing.assert_allclose(seen.sensed, exact, atol=1e-11)


def test_heat_reaches_only_the_heated_part():
    half = plant(muscle(Straight(0.115, 1.0), heated_fraction=0.5), lever=1.0)
    whole = plant(muscle(Straight(0.115, 1.0)), lever=1.0)
    q, load, none = jnp.asarray(0.0), jnp.asarray(0.1), jnp.asarray(0.0)
    forces = [
        made.force(q, none, jnp.full(2, 0.01), Drive(jnp.full(2, heat), load, none))
        for made, heat in ((half, 85.0), (whole, 55.0))
    ]
    assert float(forces[0]) == pytest.approx(float(forces[1]), rel=1e-14)


def test_springs_are_slack_below_and_stiff_above():
    bare = plant(muscle(Straight(0.1, 1.0)), lever=1.0)
    hot = Drive(jnp.full(2, 60.0), jnp.asarray(0.0), jnp.asarray(0.0))
    p = TABLE_2
    offset = p["A"] * 3600 + p["B"] * 60 + p["C"]
    for stretch, pull in ((-0.02, 0.0), (0.0005, p["F_modulus_min"] / 2), (0.021, None)):
        exact = p["F_modulus_min"] + BASE * 0.02 * p["K_modulus"] if pull is None else pull
        q = jnp.asarray(BASE * (stretch + offset + 0.01))
        force = bare.force(q, jnp.asarray(0.0), jnp.full(2, 0.01), hot)
        assert float(force) == pytest.approx(-exact, rel=1e-9, abs=1e-12)
    damper = p["H"] * (60.0 + p["T_hyst_offset"])
    rate = bare.hyst_rate(q, jnp.asarray(0.0), jnp.full(2, 0.01), hot)[0]
    held = p["F_hyst_min"] + BASE * 0.009 * p["K_hyst"]
    assert float(rate) == pytest.approx((exact - held) / (damper * BASE), rel=1e-9)
