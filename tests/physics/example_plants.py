"""Plants and schedules that the tests of the physics share; numbers are Table 1's and Table 2's."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from muscle_bayes.physics.elements import Element, Muscle, NoElement, ReferenceSpring
from muscle_bayes.physics.friction import CoulombFriction
from muscle_bayes.physics.linkage import Pins
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.response import inertial_response, quasi_static_response
from muscle_bayes.physics.schedule import Schedule

J, D = 0.00124103, 0.00545940
DISC, BASE, ROOM = 0.0889, 0.100, 25.0
STOPS = (-1.2, 1.2)
TABLE_2 = {
    "A": -1.17832e-5,
    "B": 1.40992e-5,
    "C": 0.00881695,
    "F_hyst_min": 1.75489,
    "K_hyst": 415.189,
    "F_modulus_min": 3.789,
    "K_modulus": 186.0,
    "H": -545.907,
    "T_hyst_offset": -243.380,
}
MUSCLE_PINS = (0.030, 0.030, 0.115)
SPRING_PINS = (0.030, 0.030, 0.060)

inertial = eqx.filter_jit(inertial_response)
quasi_static = eqx.filter_jit(quasi_static_response)


class LinearSpring(Element):
    """Generalised force -stiffness q, in both directions."""

    stiffness: float

    def force(self, now, effects):
        return -self.stiffness * now.q


def plant(side_a, side_b=None, *, inertia=J, friction=None, lever=DISC, stops=STOPS) -> Plant:
    friction = CoulombFriction(jnp.asarray(D)) if friction is None else friction
    side_b = NoElement() if side_b is None else side_b
    return Plant(jnp.asarray(inertia), friction, side_a, side_b, lever, stops)


def spring_plant(inertia=J, dry=D, **kwargs) -> Plant:
    """The reference spring on side A's pins."""
    element = ReferenceSpring(Pins(*SPRING_PINS, 1.0))
    return plant(element, inertia=inertia, friction=CoulombFriction(jnp.asarray(dry)), **kwargs)


def muscle(linkage=None, heated_fraction=1.0, **changes) -> Muscle:
    values = {key: jnp.asarray(value) for key, value in {**TABLE_2, **changes}.items()}
    linkage = Pins(*MUSCLE_PINS, 1.0) if linkage is None else linkage
    return Muscle(linkage, BASE, heated_fraction, ROOM, MuscleParameters(**values))


def muscle_plant(inertia=J, dry=D, stops=STOPS, **changes) -> Plant:
    """One muscle on side A's pins."""
    friction = CoulombFriction(jnp.asarray(dry))
    return plant(muscle(**changes), inertia=inertia, friction=friction, stops=stops)


def schedule(time, temperature=ROOM, load=0.0, applied=0.0) -> Schedule:
    """A schedule from functions of time, or constants; both sides have the same temperature."""
    time = np.asarray(time, dtype=float)
    middle = 0.5 * (time[1:] + time[:-1])

    def sampled(what, at):
        return np.broadcast_to(what(at) if callable(what) else what, at.shape).astype(float)

    heat = sampled(temperature, time)
    return Schedule.sampled(time, heat, sampled(load, middle), sampled(applied, middle))


def release(plant, schedule, q=0.0, hyst=0.0, speed=0.0):
    """Full-inertia response from q."""
    return inertial(plant, schedule, jnp.asarray(q), jnp.asarray(speed), jnp.full(2, hyst))


def creep(plant, schedule, q=0.0, hyst=0.0):
    """Quasi-static response from q."""
    return quasi_static(plant, schedule, jnp.asarray(q), jnp.full(2, hyst))
