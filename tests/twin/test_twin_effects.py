"""Each effect against its own formula, and the errors of naming one wrongly."""

from dataclasses import replace
from math import exp, pi, sqrt

import pytest

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin import EFFECTS, Effect, MuscleParameters, Rig, make_effect, parse_effect
from muscle_bayes.twin.bench import Bench
from muscle_bayes.twin.rotor import Rotor
from muscle_bayes.twin.springs import Muscle


def test_viscous_friction_damps_as_the_linear_law_does():
    c, inertia, stiffness = 0.002, 0.002, 0.15
    effect = make_effect("viscous-friction", coefficient=c)
    rotor = Rotor(
        [],
        inertia=inertia,
        dry_friction=0.0,
        viscous_friction=0.0,
        disc_radius=0.09,
        stops=(-2.0, 2.0),
        slip_step=5e-4,
        extra_torques=[lambda angle, velocity: -stiffness * angle, effect.extra_torque],
    )
    rotor.angle = 0.5
    decay = c / (2 * inertia)
    period = 2 * pi / sqrt(stiffness / inertia - decay**2)
    rotor.advance(4 * period)
    assert rotor.angle == pytest.approx(0.5 * exp(-4 * period * decay), rel=1e-3)


def test_coil_contact_is_eq_18_beside_the_chain():
    effect = make_effect("coil-contact", stiffness=200.0, onset=0.01)
    plain, touched = (
        Muscle(MuscleParameters(), 0.1, hyst=0.02, effects=effects) for effects in ((), (effect,))
    )
    for muscle in (plain, touched):
        muscle.begin(90.0, 90.0, 1.0)
    assert touched.tension(0.102) == plain.tension(0.102)
    assert touched.tension(0.099) == pytest.approx(plain.tension(0.099) + 200.0 * (-0.01 - 0.01))
    assert touched.force == plain.force


def test_thermal_lag_follows_a_ramp_late():
    follow = make_effect("thermal-lag", time_constant=5.0).follow(25.0)
    rate = 2.0
    for n in range(1, 3001):
        late = follow(25.0 + rate * n * 0.01, 0.01)
    assert late == pytest.approx(25.0 + rate * (30.0 - 5.0 * (1 - exp(-30.0 / 5.0))))
    assert make_effect("thermal-lag", time_constant=0.0).follow(25.0)(40.0, 0.03) == 40.0


def test_thermal_lag_delays_the_muscle_not_the_meter():
    rig = Rig()
    lagging = replace(
        rig, truth=replace(rig.truth, effects=(make_effect("thermal-lag", time_constant=8.0),))
    )
    benches = [Bench(r, load=0.139, hyst=0.02) for r in (rig, lagging)]
    for bench in benches:
        bench.channels[0].pwm = 200.0
        for _ in range(300):
            bench.advance(0.03)
    plain, late = (bench.channels[0] for bench in benches)
    assert late.tube.temperature == plain.tube.temperature == plain.muscle_temperature
    assert late.muscle_temperature < plain.muscle_temperature - 5.0


def test_every_port_reaches_the_muscle():
    class Everything(Effect):
        def extra_offset(self, temperature: float) -> float:
            return -0.01

        def damper(self, coefficient: float, temperature: float) -> float:
            return 2.0 * coefficient

    plain, changed = (
        Muscle(MuscleParameters(), 0.1, effects=effects) for effects in ((), (Everything(),))
    )
    assert changed.offset_at(50.0) == pytest.approx(plain.offset_at(50.0) - 0.01)
    assert changed.damper_at(50.0) == pytest.approx(2.0 * plain.damper_at(50.0))


def test_text_gives_an_effect():
    effect = parse_effect("coil-contact:stiffness=150,onset=0.02")
    assert effect == make_effect("coil-contact", stiffness=150.0, onset=0.02)
    assert parse_effect("bias-torque") == EFFECTS["bias-torque"]()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("gremlin", "unknown effect 'gremlin'"),
        ("coil-contact:softness=1", "no parameter 'softness'"),
        ("coil-contact:stiffness=very", "not param=value"),
        ("coil-contact:stiffness", "not param=value"),
    ],
)
def test_a_wrong_effect_is_an_error_that_says_why(text, told):
    with pytest.raises(MuscleBayesError, match=told):
        parse_effect(text)
