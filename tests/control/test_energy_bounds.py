"""Bounds that every loop keeps: temperature, heater energy, mechanical energy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from loops import joint_of, loop
from published import COIL_CONTACT, HEATER, TABLE_1_COULOMB, TABLE_1_LINEAR, TABLE_2

from muscle_bayes.control.closed_loop import start_of
from muscle_bayes.control.laws.gains import Gains
from muscle_bayes.control.plant.rotor import advance
from muscle_bayes.control.scenarios.scenario import course_of
from muscle_bayes.physics.state import Drive

ROOM = Drive(jnp.full(2, 25.0), jnp.zeros(()), jnp.zeros(()))


def test_whatever_the_law_asks_for_heat_and_motion_are_bounded():
    time = 0.03 * np.arange(1500)
    course = course_of(0.3 * np.sign(np.sin(3 * time)), 0.02 * (time > 20), noise=True)
    values = TABLE_1_LINEAR | TABLE_2 | HEATER
    trace = loop(joint_of(values), Gains(proportional=2e4, integral=2500.0), course)
    assert np.isfinite(trace.angle).all()
    assert (np.abs(trace.angle) <= 1.2).all()
    assert ((trace.duty >= 0) & (trace.duty <= 255)).all()
    assert (trace.duty == np.rint(trace.duty)).all()
    # Full power for so long, and no cooling, would not heat more.
    heated = 4.5 * 0.03 * np.cumsum(trace.duty, axis=0) / 255
    assert (trace.temperature[1:] - 25.0 <= heated[:-1] + 1e-9).all()
    assert (trace.temperature >= 25.0 - 1e-9).all()
    assert (trace.temperature <= 25.0 + 4.5 * 48).all()


@pytest.mark.parametrize(
    ("rotor", "friction"), [(TABLE_1_LINEAR, "linear"), (TABLE_1_COULOMB, "coulomb")]
)
def test_a_joint_let_go_in_the_cold_loses_energy(rotor, friction):
    """Kinetic energy and work against the torque at frozen HYST, which itself only dissipates."""
    values = rotor | TABLE_2 | HEATER | COIL_CONTACT
    joint = joint_of(values, friction=friction, effects=("coil-contact",))
    plant, rest = joint.plant, start_of(joint, jnp.zeros(()), jnp.zeros(()))
    angles = np.linspace(-0.4, 0.4, 4001)
    torque = jax.vmap(lambda q: plant.force(q, jnp.zeros(()), rest.hyst, ROOM))(jnp.asarray(angles))
    work = np.cumsum(np.asarray(torque)) * (angles[1] - angles[0])
    step = jax.jit(lambda motion: advance(plant, motion, ROOM, 0.005))
    motion = rest._replace(q=rest.q + 0.15)
    energies = []
    for _ in range(400):
        potential = -np.interp(float(motion.q), angles, work)
        energies.append(0.5 * rotor["J"] * float(motion.speed) ** 2 + potential)
        motion = step(motion)._replace(hyst=rest.hyst)
    energies = np.array(energies) - energies[-1]
    assert energies[0] > 1e-3
    assert (np.diff(energies) <= 2e-3 * energies[0]).all()
    assert energies[-100:].max() < 0.05 * energies[0]


def test_a_rested_joint_does_not_move(joints):
    joint = joints.one()
    cold = ROOM._replace(temperature=jnp.full(2, joint.heater.room))
    start = start_of(joint, jnp.zeros(()), jnp.zeros(()))
    assert float(joint.plant.force(start.q, start.speed, start.hyst, cold)) == pytest.approx(
        0, abs=1e-9
    )
    rate = joint.plant.hyst_rate(start.q, start.speed, start.hyst, cold)
    assert np.asarray(rate) == pytest.approx(np.zeros(2), abs=1e-9)


def test_muscles_fresh_from_training_are_short_and_creep(joints):
    joint = joints.one()
    rested, trained = (start_of(joint, jnp.zeros(()), jnp.asarray(x)) for x in (0.0, 1.0))
    assert (np.asarray(trained.hyst) < np.asarray(rested.hyst)).all()
    rate = joint.plant.hyst_rate(trained.q, trained.speed, trained.hyst, ROOM)
    assert (np.asarray(rate) > 0).all()
