"""The closed loop against SciPy's integrator and against the twin, whose code is not ours."""

import numpy as np
import pytest
from loops import PERIOD, IntegerLaw, joint_of, loop
from published import COIL_CONTACT, HEATER, TABLE_1_COULOMB, TABLE_1_LINEAR, TABLE_2
from scipy.integrate import solve_ivp

from muscle_bayes.control.laws.gains import Gains, board_numbers
from muscle_bayes.control.plant.design import Design
from muscle_bayes.control.scenarios.scenario import course_of
from muscle_bayes.twin import make_effect
from muscle_bayes.twin.bench import Bench
from muscle_bayes.twin.plant.parameters import Truth
from muscle_bayes.twin.plant.rig import Element, Rig

GAINS = Gains(
    proportional=4000.0,
    integral=300.0,
    bias=10.0,
    filter_time=0.5,
    windup_time=2.0,
    governor=(60.0, 75.0),
)
COUNT = 600


def course():
    """A step, and a load that jumps."""
    time = PERIOD * np.arange(COUNT)
    return course_of(np.where(time > 1.0, 0.06, 0.0), np.where(time > 12.0, 0.015, 0.0))


def counts(angle: float) -> int:
    return int(np.rint(512.0 + angle / 0.0058))


def spring(strain, stiffness, minimum):
    """Eq. 13 and 14."""
    return minimum * np.clip(strain / 1e-3, 0, 1) + stiffness * np.maximum(strain - 1e-3, 0.0)


def rates(state, duty, mass, effect):
    """The joint's equations (FACTS' 7-10, 13-17, heater tubes), written anew; lag 0.

    The last two states are the strains of a second relaxation, in series with HYST.
    """
    p = TABLE_2
    q, speed, hyst, excess, second = state[0], state[1], state[2:4], state[4:6], state[6:8]
    mirror = np.array([1.0, -1.0])
    across = 0.115 + mirror * 0.03 * np.sin(q)
    along = 0.03 - 0.03 * np.cos(q)
    length = np.hypot(along, across)
    strain = length / 0.1 - 1.0
    temperature = 25.0 + excess
    offset = p["A"] * temperature**2 + p["B"] * temperature + p["C"]
    modulus = spring(strain - offset - hyst - second, 0.1 * p["K_modulus"], p["F_modulus_min"])
    pull = modulus
    if effect == "coil-contact":
        over = strain - COIL_CONTACT["coil-contact.onset"]
        pull = modulus + COIL_CONTACT["coil-contact.stiffness"] * np.minimum(over, 0.0)
    lever = (along * 0.03 * np.sin(q) + across * mirror * 0.03 * np.cos(q)) / length
    torque = mass * 9.80665 * 0.0889 - pull @ lever - TABLE_1_LINEAR["D"] * speed
    damper = p["H"] * (temperature + p["T_hyst_offset"])
    relax = (modulus - spring(hyst, 0.1 * p["K_hyst"], p["F_hyst_min"])) / (0.1 * damper)
    heat = 4.5 * np.asarray(duty) / 255 - excess / 48
    inertia = TABLE_1_LINEAR["J"] + mass * 0.0889**2
    own = SECOND if effect == "second-relaxation" else SECOND | {COMPLIANCE: 0.0}
    creep = (own[COMPLIANCE] * modulus - second) / own["second-relaxation.time_constant"]
    return np.concatenate([[speed, torque / inertia], relax, heat, creep])


COMPLIANCE = "second-relaxation.compliance"
SECOND = {
    COMPLIANCE: 0.004,
    "second-relaxation.time_constant": 2.0,
    "second-relaxation.unrested": 0.0,
}


def settled(state, effect):
    """The state with the second relaxation at rest under its tension, the rest held."""
    for _ in range(4000):
        state = np.r_[state[:6], state[6:8] + 0.02 * rates(state, (0, 0), 0.0, effect)[6:8]]
    return state


@pytest.mark.parametrize("effect", [None, "coil-contact", "second-relaxation"])
def test_loop_agrees_with_an_adaptive_integrator(effect):
    more = {None: {}, "coil-contact": COIL_CONTACT, "second-relaxation": SECOND}[effect]
    values = TABLE_1_LINEAR | TABLE_2 | HEATER | more
    joint, imposed = joint_of(values, effects=(effect,) if effect else ()), course()
    trace = loop(joint, GAINS, imposed)

    law = IntegerLaw(board_numbers(GAINS, Design()))
    state = settled(np.r_[trace.angle[0], 0.0, trace.hyst[0], np.zeros(4)], effect)
    seen = counts(state[0])
    states = []
    for number, (setpoint, mass) in enumerate(zip(imposed.setpoint, imposed.load, strict=True)):
        states.append(state)
        if number % 13 == 0:
            warmth = tuple(np.rint(10.0 * (25.0 + state[4:6])).astype(int).tolist())
        duty = law(counts(setpoint), seen, warmth)
        seen = counts(state[0])
        solved = solve_ivp(
            lambda t, x, duty=duty, mass=mass: rates(x, duty, mass, effect),
            (0.0, PERIOD),
            state,
            method="DOP853",
            rtol=1e-9,
            atol=1e-11,
        )
        state = solved.y[:, -1]
    expected = np.array(states)
    assert np.abs(expected[:, 0]).max() > 0.05  # it moved
    # A tenth of a count; touching coils are stiff, and ring faster when the load jumps.
    limit = 1.5e-3 if effect == "coil-contact" else 6e-4
    assert trace.angle == pytest.approx(expected[:, 0], abs=limit)
    if effect == "second-relaxation":
        assert np.ptp(expected[:, 6:8], axis=0).max() > 1e-3  # it crept
    assert np.sqrt(np.mean((trace.angle - expected[:, 0]) ** 2)) < 1.5e-4
    assert trace.hyst == pytest.approx(expected[:, 2:4], abs=2e-5)
    assert trace.temperature - 25.0 == pytest.approx(expected[:, 4:6], abs=0.3)


STRIBECK = {"breakaway": 0.003, "speed": 0.05}


@pytest.mark.parametrize("stribeck", [False, True])
def test_loop_agrees_with_the_twin_where_dry_friction_sticks(stribeck):
    imposed, name = course(), "stribeck-friction"
    values = TABLE_1_COULOMB | TABLE_2 | HEATER
    if stribeck:
        static = values["D"] + STRIBECK["breakaway"]
        drop = STRIBECK["breakaway"] / static
        values |= {"D": static, f"{name}.drop": drop, f"{name}.speed": STRIBECK["speed"]}
    joint = joint_of(values, friction="coulomb", effects=(name,) if stribeck else ())
    trace = loop(joint, GAINS, imposed)
    hidden = (make_effect(name, **STRIBECK),) if stribeck else ()
    rig = Rig(element_b=Element(kind="muscle"), truth=Truth(effects=hidden))
    bench = Bench(rig, load=0.0, hyst=float(trace.hyst[0, 0]))
    bench.place(float(trace.angle[0]))
    law = IntegerLaw(board_numbers(GAINS, Design()))
    seen, angles, mass = counts(bench.rotor.angle), [], 0.0
    for number, (setpoint, load) in enumerate(zip(imposed.setpoint, imposed.load, strict=True)):
        angles.append(bench.rotor.angle)
        if load != mass:
            bench.rotor.hang(load)
            mass = load
        if number % 13 == 0:
            warmth = tuple(round(10.0 * one.tube.temperature) for one in bench.channels)
        duties = law(counts(setpoint), seen, warmth)
        seen = counts(bench.rotor.angle)
        for channel, duty in zip(bench.channels, duties, strict=True):
            channel.pwm = duty
        bench.advance(PERIOD)
    assert np.ptp(angles) > 0.05
    # Within the dead band of friction, +-0.016 rad, where it sticks hangs on details of the last swing.
    assert np.sqrt(np.mean((trace.angle - angles) ** 2)) < 1.5e-3
    assert trace.angle == pytest.approx(np.array(angles), abs=6e-3)


def test_finer_steps_change_nothing_that_counts_and_converge():
    joint, imposed = joint_of(TABLE_1_LINEAR | TABLE_2 | HEATER), course()
    coarse, usual, fine = (loop(joint, GAINS, imposed, n).angle for n in (1, 3, 9))
    first, second = np.abs(coarse - fine).max(), np.abs(usual - fine).max()
    assert second < 6e-4
    assert second < first / 5.0  # second order: a ninth
