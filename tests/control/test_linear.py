"""Linearisation against closed forms and against the simulation; feed-forward; margins."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from loops import joint_of, loop
from published import HEATER, TABLE_1_LINEAR, TABLE_2

import control
from muscle_bayes.control.closed_loop import start_of
from muscle_bayes.control.laws.feedforward import static_inverse
from muscle_bayes.control.laws.gains import Gains, Inner
from muscle_bayes.control.linear import (
    loop_gain,
    loops,
    margins_of,
    operating_point,
    pi_controller,
    snapshot_gains,
    state_space,
)
from muscle_bayes.control.plant.heater import HeaterState
from muscle_bayes.control.plant.rotor import Motion, advance
from muscle_bayes.control.scenarios.scenario import course_of
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.state import Drive

VALUES = TABLE_1_LINEAR | TABLE_2 | HEATER | {"heater.lag": 0.5}


@pytest.fixture(scope="module")
def held():
    """One joint with a lag."""
    with jax.enable_x64(True):
        yield joint_of(VALUES)


def test_stiffness_of_two_muscles_at_zero(held):
    """2 (K r^2 (Y/L)^2 + F d^2L/dq^2) at q = 0, K = K_modulus: by hand from eq. 7-10."""
    r, x, y = 0.03, 0.03, 0.115
    point = operating_point(held, 1e-9)
    start = start_of(held, jnp.zeros(()), jnp.zeros(()))
    strain = y / 0.1 - 1.0
    offset = TABLE_2["A"] * 625 + TABLE_2["B"] * 25 + TABLE_2["C"]
    stretch = strain - offset - float(start.hyst[0])
    tension = 3.789 + 18.6 * (stretch - 1e-3)
    # L^2 = (X - r cos q)^2 + (Y + r sin q)^2: L' = r (X sin q + Y cos q) / L, L'' = (r X - L'^2) / L
    bend = (r * x - r**2) / y
    assert point.stiffness == pytest.approx(2 * (186.0 * r**2 + tension * bend), rel=1e-3)


def test_co_contraction_does_not_stiffen_this_joint(held):
    """MODULUS is linear, and HYST is held: what the thesis hoped of a bias does not come about."""
    cold, warm = (operating_point(held, 0.05, bias).stiffness for bias in (0.0, 40.0))
    assert warm == pytest.approx(cold, rel=0.01)


def test_small_steps_of_the_simulation_follow_the_state_space(held):
    point, plant = operating_point(held, 0.05), state_space(held, 0.05)
    extra, duration, step = 2.0, 6.0, 0.005
    time = np.arange(0.0, duration, step)
    linear = extra * control.step_response(plant, time).outputs
    heat_step = held.heater.step(step)
    motion = Motion(jnp.asarray(0.05), jnp.zeros(()), jnp.asarray(point.state[2:4]))

    def run(duty):
        heat = HeaterState(jnp.array([0.0, point.state[5]]), jnp.array([0.0, point.state[4]]))

        def one(carry, _):
            motion, heat = carry
            after = heat_step(heat, jnp.stack([jnp.zeros(()), duty]))
            middle = held.heater.room + 0.5 * (heat.excess + after.excess)
            drive = Drive(middle, jnp.zeros(()), jnp.zeros(()))
            return (advance(held.plant, motion, drive, step), after), motion.q

        return jax.lax.scan(one, (motion, heat), None, length=time.size)[1]

    moved = np.asarray(run(jnp.asarray(point.duty + extra)) - run(jnp.asarray(point.duty)))
    assert abs(moved[-1]) > 1e-4
    assert moved == pytest.approx(linear, abs=0.02 * abs(moved[-1]))


def test_margins_of_an_integrator():
    """1 / s sampled every h and read a period late, gain k: k h / (z (z - 1)). Poles z^2 - z + k h = 0
    leave the unit circle at k h = 1; 2 sin(w h / 2) = k h at crossover, of phase -90 - 1.5 w h."""
    plant = control.ss([[1.0, 0.1], [0.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]], 0.1)
    found = margins_of(2.0 * plant)
    turned = 2 * np.arcsin(0.1)
    assert found.crossover == pytest.approx(turned / 0.1, rel=1e-3)
    assert found.phase == pytest.approx(90 - np.degrees(1.5 * turned), abs=0.1)
    assert found.gain == pytest.approx(5.0, rel=0.01)
    assert found.stable
    assert not margins_of(10.5 * plant).stable


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_the_disk_margin_is_python_controls(joints):
    gains = Gains(proportional=2000.0, integral=100.0)
    found = loops(joints, gains, 0.05, count=1)
    own = control.disk_margins(loop_gain(joints.one(), gains, 0.05), found.frequency)[0]
    assert found.disk[0] == pytest.approx(float(np.min(own)), rel=1e-6)


def test_the_controller_is_the_sum_that_the_bench_forms():
    gains = Gains(proportional=3.0, integral=20.0)
    _, output = control.forced_response(
        pi_controller(gains), inputs=np.array([1.0, 0.0, 0.0, -1.0]), timepts=0.03 * np.arange(4)
    )
    assert output == pytest.approx([3.0, 0.6, 0.6, -2.4])


def test_snapshot_gains_have_the_margins_they_promise(joints):
    gains = snapshot_gains(joints, 0.08)
    (found,) = loops(joints.median(), gains, 0.08).margins
    assert found.stable
    assert found.phase >= 60.0
    assert found.gain >= 2.0
    update = {"proportional": 1.5 * gains.proportional, "integral": 2.0 * gains.integral}
    (beyond,) = loops(joints.median(), gains.model_copy(update=update), 0.08).margins
    assert beyond.phase < 60.0 or beyond.gain < 2.0


def test_an_inner_loop_makes_the_plant_faster(held):
    """T' = g (hold T* + heat (T* - T)) / 255 - c T: its pole moves from c to c + g heat / 255."""
    inner = Inner(hold=1.2, heat=15.0)
    gains = Gains(law="cascade", proportional=500.0, integral=0.0, inner=inner)
    loop = loop_gain(held, gains, 0.05)
    slowest = np.log(np.abs(np.linalg.eigvals(loop.A)).max()) / 0.03
    assert slowest > -0.01  # HYST's, which the inner loop does not touch
    duty = loop_gain(held, Gains(proportional=500.0, integral=0.0), 0.05)
    assert abs(loop(1.0)) > 0.0
    cooling = HEATER["heater.cooling"]
    poles = -np.log(np.abs(np.linalg.eigvals(duty.A))[np.abs(np.linalg.eigvals(duty.A)) > 0]) / 0.03
    assert np.min(np.abs(poles - cooling)) < 1e-4
    closed = np.linalg.eigvals(loop.A)
    assert np.min(np.abs(-np.log(np.abs(closed[np.abs(closed) > 0])) / 0.03 - cooling)) > 1e-2


def test_an_angle_that_cannot_be_held_is_refused(held):
    with pytest.raises(MuscleBayesError, match="no temperature"):
        operating_point(held, 1.1)


def test_feed_forward_alone_brings_the_mean_joint_near(joints):
    """With hardly any feedback, a setpoint is reached to what HYST gives way in that time."""
    joints = dataclasses.replace(joints, friction="linear")  # dry friction would stop short of it
    table = static_inverse(joints)
    assert table.angle[0] < -0.05
    assert table.angle[-1] > 0.05
    gains = Gains(law="feedforward", proportional=1.0, integral=0.0, feedforward=table)
    time = 0.03 * np.arange(5000)
    trace = loop(joints.median().one(), gains, course_of(np.full(time.size, 0.05), 0 * time))
    assert trace.angle[-1] == pytest.approx(0.05, abs=0.012)
    lazy = loop(
        joints.median().one(),
        Gains(proportional=1.0, integral=0.0),
        course_of(np.full(time.size, 0.05), 0 * time),
    )
    assert abs(lazy.angle[-1]) < 0.01
