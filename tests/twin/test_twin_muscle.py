"""Muscle, spring and linkage against closed forms and the equations as printed."""

from math import cos, exp, hypot, sin

import pytest

from muscle_bayes.twin import Element, Fixture, MuscleParameters, Rig
from muscle_bayes.twin.bench import Bench
from muscle_bayes.twin.plant.linkage import Side
from muscle_bayes.twin.plant.springs import DAMPER_FLOOR, Muscle, ReferenceSpring

BASE = 0.100
P = MuscleParameters()


def muscle(temperature: float = 60.0, hyst: float = 0.02, **changes: float) -> Muscle:
    made = Muscle(MuscleParameters(**changes), BASE, hyst=hyst)
    made.begin(temperature, temperature, 1.0)
    return made


def test_reference_spring_is_eq_12():
    assert ReferenceSpring().tension(0.06) == pytest.approx(145.71 * 0.06 - 5.2097)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("angle", [-0.9, -0.2, 0.0, 0.4, 1.0])
def test_torque_is_minus_tension_times_the_slope_of_length(direction, angle):
    side = Side(ReferenceSpring(), 0.030, 0.034, 0.115, direction)
    step = 1e-6
    slope = (side.length(angle + step) - side.length(angle - step)) / (2 * step)
    tension = ReferenceSpring().tension(side.length(angle))
    assert side.torque(angle) == pytest.approx(-tension * slope, rel=1e-7)


def test_linkage_is_eq_7_to_10_as_printed():
    r, x, y, angle = 0.030, 0.034, 0.115, 0.37
    length_a = hypot(x - r * cos(angle), y + r * sin(angle))
    length_b = hypot(x - r * cos(angle), y - r * sin(angle))
    a, b = (Side(ReferenceSpring(), r, x, y, direction) for direction in (1, -1))
    assert a.length(angle) == pytest.approx(length_a)
    assert b.length(angle) == pytest.approx(length_b)
    force_a, force_b = (145.71 * length - 5.2097 for length in (length_a, length_b))
    torque_a = -(force_a * r / length_a) * (y * cos(angle) + x * sin(angle))
    torque_b = force_b * r / length_b * (y * cos(angle) - x * sin(angle))
    assert a.torque(angle) == pytest.approx(torque_a)
    assert b.torque(angle) == pytest.approx(torque_b)


@pytest.mark.parametrize(
    ("stretch", "force"),
    [
        (-0.01, 0.0),
        (0.0, 0.0),
        (0.0005, 3.789 / 2),
        (0.001, 3.789),
        (0.101, 3.789 + 0.1 * 18.6),
    ],
)
def test_modulus_is_eq_13(stretch, force):
    made = muscle(25.0, hyst=0.0)
    offset = P.A * 25.0**2 + P.B * 25.0 + P.C
    assert made.tension(BASE * (1 + offset + stretch)) == pytest.approx(force, abs=1e-9)


@pytest.mark.parametrize("step", [0.5, 0.03, 0.001])
def test_hyst_relaxes_exponentially_at_held_length(step):
    """Rate (K_modulus + K_hyst) / B_hyst towards the strain at which both springs pull alike."""
    made = muscle()
    length = BASE * 1.12
    damper = P.H * (60.0 + P.T_hyst_offset)
    excess = made.tension(length) - (P.F_hyst_min + BASE * P.K_hyst * (0.02 - P.epsilon))
    rate = (P.K_modulus + P.K_hyst) / damper
    settled = 0.02 + excess / (BASE * (P.K_modulus + P.K_hyst))
    duration = 30.0
    for _ in range(round(duration / step)):
        made.tension(length)
        made.advance(step)
    assert made.hyst == pytest.approx(settled + (0.02 - settled) * exp(-rate * duration), rel=1e-6)


def test_hyst_relaxes_with_b_over_k_under_constant_load():
    made = muscle()
    load, step, duration = 5.0, 0.005, 100.0
    stretch = P.epsilon + (load - P.F_modulus_min) / (BASE * P.K_modulus)
    for _ in range(round(duration / step)):
        assert made.tension(BASE * (1 + made.offset + made.hyst + stretch)) == pytest.approx(load)
        made.advance(step)
    damper = P.H * (60.0 + P.T_hyst_offset)
    settled = P.epsilon + (load - P.F_hyst_min) / (BASE * P.K_hyst)
    left = exp(-P.K_hyst / damper * duration)
    assert made.hyst == pytest.approx(settled + (0.02 - settled) * left, rel=1e-4)


def test_hyst_stays_stable_where_the_damper_vanishes():
    """Above -T_hyst_offset eq. 17 is negative; with the floor HYST settles at once."""
    made = muscle(300.0)
    assert made.damper_at(300.0) == DAMPER_FLOOR
    length = BASE * 1.12
    for _ in range(3):
        made.tension(length)
        made.advance(0.03)
    spring = P.F_hyst_min + BASE * P.K_hyst * (made.hyst - P.epsilon)
    assert made.tension(length) == pytest.approx(spring, rel=1e-6)


def test_rewind_keeps_a_fraction_of_a_step():
    whole, part = muscle(), muscle()
    for made in (whole, part):
        made.begin(60.0, 61.0, 1.0)
        made.tension(BASE * 1.12)
        made.advance(1.0)
    part.rewind(0.25)
    assert part.hyst - 0.02 == pytest.approx(0.25 * (whole.hyst - 0.02))
    start = whole.offset_at(60.0)
    assert part.offset - start == pytest.approx(0.25 * (whole.offset - start))


@pytest.mark.parametrize("mass", [0.139, 0.212])
def test_equilibrium_balances_load_and_muscle(mass):
    bench = Bench(Rig(), load=mass, hyst=0.05)
    bench.place(None)
    angle, f = bench.rotor.angle, Fixture()
    length = hypot(
        f.anchor_x_a - f.rotor_radius_a * cos(angle),
        f.anchor_y_a + f.rotor_radius_a * sin(angle),
    )
    offset = P.A * 625.0 + P.B * 25.0 + P.C
    stretch = length / BASE - 1 - offset - 0.05
    force = BASE * P.K_modulus * (stretch - P.epsilon) + P.F_modulus_min
    lever = f.rotor_radius_a / length * (f.anchor_y_a * cos(angle) + f.anchor_x_a * sin(angle))
    assert force * lever == pytest.approx(mass * 9.80665 * 0.0889, rel=1e-9)


def test_partial_heating_is_eq_11():
    rig = Rig(element_a=Element(kind="muscle", heater_length=0.075))
    bench = Bench(rig, load=0.139, hyst=0.02)
    channel = bench.channels[0]
    channel.pwm = 255.0
    for _ in range(500):
        bench.advance(0.03)
    tube = channel.tube.temperature
    assert tube > 70.0
    assert channel.muscle_temperature == pytest.approx((0.075 * tube + 0.025 * 25.0) / 0.1)
    muscle_a = bench.muscles[0]
    assert muscle_a is not None
    assert muscle_a.offset == pytest.approx(muscle_a.offset_at(channel.muscle_temperature))
