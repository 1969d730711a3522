"""Each effect against its own formula, and the errors of naming one wrongly."""

from dataclasses import asdict, replace
from math import exp, log, pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin import (
    EFFECTS,
    Effect,
    MuscleParameters,
    Rig,
    Stage,
    free,
    make_effect,
    parse_effect,
    simulate,
)
from muscle_bayes.twin.bench import Bench
from muscle_bayes.twin.plant.rotor import Rotor
from muscle_bayes.twin.plant.springs import Muscle
from muscle_bayes.twin.sensors import AngleSensor


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


def free_rotor(**changes):
    settings = {"inertia": 0.002, "dry_friction": 0.0, "viscous_friction": 0.0, "disc_radius": 0.09}
    settings |= {"stops": (-9.0, 9.0), "slip_step": 5e-4} | changes
    return Rotor([], **settings)


def test_quadratic_drag_slows_hyperbolically():
    drag = make_effect("quadratic-drag", coefficient=0.004)
    rotor = free_rotor(extra_torques=[drag.extra_torque])
    rotor.velocity, rotor.slipping = 3.0, True
    rotor.advance(2.0)
    lost = 1.0 + 0.004 * 3.0 * 2.0 / 0.002
    assert rotor.velocity == pytest.approx(3.0 / lost, rel=1e-5)
    assert rotor.angle == pytest.approx(0.002 / 0.004 * log(lost), rel=1e-5)


@pytest.mark.parametrize("push", [0.0049, 0.0051])
def test_stribeck_friction_holds_up_to_its_breakaway(push):
    stribeck = make_effect("stribeck-friction", breakaway=0.002, speed=0.2)
    rotor = free_rotor(
        dry_friction=0.003,
        extra_torques=[lambda angle, velocity: push],
        friction_laws=[stribeck.dry_friction],
    )
    rotor.advance(1.0)
    assert (rotor.angle > 0.01) == (push > 0.005)


@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_position_dependent_friction_holds_more_where_it_is_higher(factor):
    made = make_effect("position-dependent-friction", slope=2.0)
    held = 0.003 * exp(2.0 * 0.3)
    rotor = free_rotor(
        dry_friction=0.003,
        extra_torques=[lambda angle, velocity: factor * held],
        friction_laws=[made.dry_friction],
    )
    rotor.angle = 0.3
    rotor.advance(1.0)
    assert (rotor.angle != 0.3) == (factor > 1.0)


def test_force_scale_makes_the_load_pull_harder():
    rotor = free_rotor(load_scales=[make_effect("force-scale", error=0.05).load_torque])
    rotor.hang(0.1)
    assert rotor.load_torque == pytest.approx(1.05 * 0.1 * GRAVITY * 0.09)
    assert rotor.total_inertia == pytest.approx(0.002 + 0.1 * 0.09**2)


@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_load_dependent_friction_holds_a_share_of_the_load(factor):
    """D + s m g R_d, at rest; a torque against the load decides which way is pushed."""
    made = make_effect("load-dependent-friction", share=0.1)
    weight = 0.1 * GRAVITY * 0.09
    held = 0.003 + 0.1 * weight
    rotor = free_rotor(
        dry_friction=0.003,
        extra_torques=[lambda angle, velocity: factor * held - weight],
        friction_laws=[made.dry_friction],
    )
    rotor.hang(0.1)
    rotor.advance(1.0)
    assert (rotor.angle != 0.0) == (factor > 1.0)


def test_load_dependent_friction_is_let_go_while_elements_relax():
    """What holds falls with a side's pull: the instant at which it no longer does is found."""

    class Fading:
        """A torque that falls by `rate` a second."""

        rate, pull, last = 0.02, 0.1, 0.0

        def advance(self, step):
            self.last = step
            self.pull -= self.rate * step

        def rewind(self, fraction):
            self.pull += self.rate * self.last * (1.0 - fraction)

    class FadingSide:
        def __init__(self):
            self.element = Fading()

        def torque(self, angle):
            return -self.element.pull

    made = make_effect("load-dependent-friction", share=0.1)
    side = FadingSide()
    rotor = free_rotor(
        dry_friction=0.003,
        extra_torques=[lambda angle, velocity: 0.1],
        friction_laws=[made.dry_friction],
    )
    rotor.sides = (side,)
    left = rotor._stick(2.0)
    # 0.1 - pull = 0.003 + 0.1 pull
    assert side.element.pull == pytest.approx(0.097 / 1.1)
    assert rotor.slipping
    assert 2.0 - left == pytest.approx((0.1 - 0.097 / 1.1) / 0.02)


def test_stribeck_friction_brakes_as_a_general_solver_says():
    stribeck = make_effect("stribeck-friction", breakaway=0.004, speed=0.5)
    rotor = free_rotor(dry_friction=0.003, friction_laws=[stribeck.dry_friction])
    rotor.velocity, rotor.slipping = 2.0, True

    def slope(t, y):
        return [y[1], -(0.003 + 0.004 * exp(-((y[1] / 0.5) ** 2))) / 0.002]

    def rests(t, y):
        return y[1]

    rests.terminal = True
    exact = solve_ivp(slope, (0.0, 9.0), [0.0, 2.0], events=rests, rtol=1e-10, atol=1e-12)
    rotor.advance(0.5)
    assert rotor.slipping
    rotor.advance(2.0)
    assert not rotor.slipping
    assert rotor.angle == pytest.approx(exact.y[0, -1], rel=1e-4)


def muscles(name, **values):
    """A muscle without and one with an effect."""
    effect = make_effect(name, **values)
    return [Muscle(MuscleParameters(), 0.1, hyst=0.02, effects=e) for e in ((), (effect,))]


def test_softening_is_a_smaller_modulus():
    plain, soft = muscles("modulus-temperature", softening=0.008)
    p = MuscleParameters()
    for temperature in (25.0, 90.0):
        for muscle in (plain, soft):
            muscle.begin(temperature, temperature, 1.0)
        above = [muscle.tension(0.115) - p.F_modulus_min for muscle in (plain, soft)]
        assert above[1] == pytest.approx(above[0] * exp(-0.008 * (temperature - 25.0)))


def test_damper_law_is_arrhenius_beside_eq_17():
    plain, changed = muscles("damper-law", activation_temperature=2500.0)
    assert changed.damper_at(25.0) == pytest.approx(plain.damper_at(25.0))
    ratio = changed.damper_at(80.0) / plain.damper_at(80.0)
    assert log(ratio) == pytest.approx(2500.0 * (1 / 353.15 - 1 / 298.15))


def test_hysteresis_yield_holds_what_the_damper_would_let_go():
    p, seen = MuscleParameters(), []
    for muscle in muscles("hysteresis-yield", force=0.7):
        muscle.begin(60.0, 60.0, 1e5)
        for _ in range(20000):
            muscle.tension(0.112)
            muscle.advance(1.0)
        held = p.F_hyst_min + 0.1 * p.K_hyst * (muscle.hyst - p.epsilon)
        seen.append(muscle.force - held)
    assert seen == pytest.approx([0.0, 0.7], abs=1e-6)


def test_slack_is_taken_up_by_parts():
    plain, slack = muscles("slack", span=0.03)
    for muscle in (plain, slack):
        muscle.begin(25.0, 25.0, 1.0)
    taut = 0.1 * (1.0 + plain.offset + plain.hyst)
    count = 2000
    for stretch in (-0.01, 0.006, 0.02, 0.05):
        left = sum(max(stretch - 0.03 * (n + 0.5) / count, 0.0) for n in range(count)) / count
        seen = slack.tension(taut + 0.1 * stretch)
        assert seen == pytest.approx(plain.tension(taut + 0.1 * left), abs=1e-5)


def test_soft_contact_sets_in_gradually():
    effect = make_effect("coil-contact", stiffness=200.0, onset=0.05, width=0.05)
    forces = [effect.extra_tension(strain) for strain in (0.06, 0.05, 0.025, 0.0, -0.01)]
    assert forces == pytest.approx([0.0, 0.0, -200 * 0.025**2 / 0.1, -5.0, -7.0])


def test_second_relaxation_and_hyst_share_a_held_muscle_as_a_general_solver_says():
    compliance, tau, length, p = 0.006, 8.0, 0.112, MuscleParameters()
    _, muscle = muscles("second-relaxation", compliance=compliance, time_constant=tau)
    muscle.begin(60.0, 60.0, 1e5)
    for _ in range(6000):
        muscle.tension(length)
        muscle.advance(0.01)
    strain, offset, damper = length / 0.1 - 1.0, muscle.offset, muscle.damper_at(60.0)

    def spring(x, rate, least):
        return least / p.epsilon * min(max(x, 0.0), p.epsilon) + rate * max(x - p.epsilon, 0.0)

    def slope(t, y):
        pull = spring(strain - offset - y[0] - y[1], 0.1 * p.K_modulus, p.F_modulus_min)
        held = spring(y[0], 0.1 * p.K_hyst, p.F_hyst_min)
        return [(pull - held) / (0.1 * damper), (compliance * pull - y[1]) / tau]

    exact = solve_ivp(slope, (0.0, 60.0), [0.02, 0.0], rtol=1e-10, atol=1e-12).y[:, -1]
    assert muscle.hyst == pytest.approx(exact[0], rel=1e-3)
    assert make_effect("second-relaxation").creep(25.0).strain == 0.0


@pytest.mark.parametrize("trained", [0.0, 0.01])
def test_first_cycle_set_grows_to_the_hottest_and_stays(trained):
    effect = make_effect("first-cycle-set", gain=1e-4, time_constant=5.0, trained=trained)
    creep = effect.creep(25.0)
    assert creep is not None
    for temperature, end in ((25.0, 0.0), (85.0, 0.024 - trained), (25.0, 0.024 - trained)):
        for _ in range(200):
            creep.advance(0.5, 4.0, temperature)
        assert creep.strain == pytest.approx(max(end, 0.0), abs=1e-9)
    creep.advance(0.5, 8.0, 85.0)
    gained = creep.strain
    creep.rewind(0.25)
    assert creep.strain == pytest.approx(0.75 * (0.024 - trained) + 0.25 * gained)


def test_partial_heating_is_a_shorter_heater():
    follow = make_effect("partial-heating", unheated=0.2).follow(22.0)
    assert follow(92.0, 0.03) == pytest.approx(22.0 + 0.8 * 70.0)


def test_potentiometer_shows_a_parabola():
    effect = make_effect("potentiometer-nonlinearity", gain=0.02, bend=-0.1)
    exact = replace(Rig().potentiometer, count_noise=0.0)
    sensor = AngleSensor(exact, 512.0, np.random.default_rng(0), (effect,))
    for angle in (-0.7, 0.0, 0.9):
        assert sensor.read(angle) == round(512.0 + (1.02 * angle - 0.1 * angle**2) / 0.0058)


def exact_sensor(effect: Effect) -> AngleSensor:
    """Of a hundred counts a milliradian, without noise."""
    fine = replace(Rig().potentiometer, count_noise=0.0, radians_per_count=1e-5)
    return AngleSensor(fine, 500.0, np.random.default_rng(0), (effect,))


def test_zero_drift_raises_the_reading_with_time():
    sensor = exact_sensor(make_effect("zero-drift", rate=2e-5))
    assert [sensor.read(1e-3, time) for time in (0.0, 50.0, 100.0)] == [600, 700, 800]


def test_backlash_is_crossed_before_the_reading_follows():
    sensor = exact_sensor(make_effect("backlash", gap=2e-3))
    angles = np.array([0.0, 1e-3, 2e-3, 3e-3, 2e-3, 1e-3, 0.0, 0.5e-3])
    assert [sensor.read(angle) for angle in angles] == [500, 500, 600, 700, 700, 700, 600, 600]


@pytest.mark.parametrize("delay", [0.8, -0.8])
def test_clock_offset_logs_temperatures_late(delay):
    plan = free((Stage(setpoint_a=60.0, duration=20.0),), load=0.139)
    runs = []
    for effects in ((), (make_effect("clock-offset", delay=delay),)):
        rig = Rig()
        runs.append(simulate(replace(rig, truth=replace(rig.truth, effects=effects)), plan, 4).log)
    plain, late = runs
    temperature = "Temperature A (C)"
    others = [name for name in plain.columns if not name.startswith("Temperature")]
    assert plain[others].equals(late[others])
    time = plain["Time (s)"].to_numpy()
    inner = (time > 2.0) & (time < 18.0)
    shifted = np.interp(time - delay, time, plain[temperature])
    # Held values jump between rows: some rows show the one before.
    assert np.abs(late[temperature] - shifted)[inner].mean() < 0.1
    assert np.abs(late[temperature] - plain[temperature])[inner].mean() > 1.0
    changed = late[temperature].diff().fillna(0.0) != 0.0
    assert not (changed & (late["Temperature Update"] == 0)).any()


@pytest.fixture(scope="module")
def heated():
    """Log and truth of a short heated run, without and with every effect by itself."""
    stages = (Stage(setpoint_a=85.0, duration=12.0), Stage(setpoint_a=25.0, duration=8.0))
    plan, rig = free(stages, load=0.139), Rig()
    rigs = {
        name: replace(rig, truth=replace(rig.truth, effects=(make_effect(name),)))
        for name in EFFECTS
    }
    return {name: simulate(one, plan, 4) for name, one in {"": rig, **rigs}.items()}


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_shows_in_a_run_and_in_its_truth(heated, name):
    run, effect = heated[name], make_effect(name)
    assert run.truth["effects"] == {name: asdict(effect)}
    assert "effects" not in heated[""].truth
    lasts = heated[""].log["Time (s)"].iloc[-1]
    assert run.log["Time (s)"].iloc[-1] == pytest.approx(lasts, abs=0.5)
    if name not in ("viscous-friction", "quadratic-drag", "coil-contact"):  # slow, and never short
        assert not run.log.equals(heated[""].log)


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
