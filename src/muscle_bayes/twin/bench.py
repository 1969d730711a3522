"""A rig put together: rotor, elements, heaters and controllers, advanced in time."""

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.controller import HeaterController
from muscle_bayes.twin.plant.heater import HeaterTube
from muscle_bayes.twin.plant.linkage import Side
from muscle_bayes.twin.plant.parameters import MuscleParameters
from muscle_bayes.twin.plant.rig import Element, Rig
from muscle_bayes.twin.plant.rotor import Rotor
from muscle_bayes.twin.plant.springs import Muscle, Puller, ReferenceSpring

_SEARCH = 240
"""Parts into which the range between the stops is cut to find equilibria."""


class Channel:
    """One side's heater tube, its controller and the temperature of what is inside."""

    def __init__(self, rig: Rig, element: Element, puller: Puller | None) -> None:
        room = rig.fixture.room_temperature
        self.tube = HeaterTube(rig.heater.full_rate, rig.heater.cooling_time, room)
        self.controller = HeaterController()
        self.pwm = 0.0
        self._puller = puller
        self._room = room
        self._share = 1.0
        """Heated share of the muscle's length (eq. 11)."""
        if element.kind == "muscle" and element.heater_length is not None:
            self._share = element.heater_length / element.base_length
        self._followers = [e.follow(room) for e in rig.truth.effects if e.overrides("follow")]
        self.muscle_temperature = room

    def advance(self, duration: float) -> None:
        """Advance the temperatures [s] and tell the element how its own changes."""
        temperature = self.tube.advance(self.pwm, duration)
        for follower in self._followers:
            temperature = follower(temperature, duration)
        before = self.muscle_temperature
        after = self._room + self._share * (temperature - self._room)
        self.muscle_temperature = after
        if self._puller is not None:
            self._puller.begin(before, after, duration)


class Bench:
    """The hidden state of a run."""

    def __init__(self, rig: Rig, *, load: float, hyst: float) -> None:
        fixture, truth = rig.fixture, rig.truth
        pullers = (
            _puller(rig, rig.element_a, truth.muscle_a, hyst),
            _puller(rig, rig.element_b, truth.muscle_b, hyst),
        )
        pins = (
            (fixture.rotor_radius_a, fixture.anchor_x_a, fixture.anchor_y_a, 1),
            (fixture.rotor_radius_b, fixture.anchor_x_b, fixture.anchor_y_b, -1),
        )
        self.muscles = tuple(p if isinstance(p, Muscle) else None for p in pullers)
        self.channels = (
            Channel(rig, rig.element_a, pullers[0]),
            Channel(rig, rig.element_b, pullers[1]),
        )
        dry = truth.friction_law == "coulomb"
        self.rotor = Rotor(
            [Side(p, *at) for p, at in zip(pullers, pins, strict=True) if p is not None],
            inertia=truth.J,
            dry_friction=truth.D if dry else 0.0,
            viscous_friction=0.0 if dry else truth.D,
            disc_radius=fixture.disc_radius,
            stops=fixture.stops,
            slip_step=rig.slip_step,
            extra_torques=[e.extra_torque for e in truth.effects if e.overrides("extra_torque")],
            friction_laws=[e.dry_friction for e in truth.effects if e.overrides("dry_friction")],
            load_scales=[e.load_torque for e in truth.effects if e.overrides("load_torque")],
        )
        self.rotor.hang(load)
        for puller in filter(None, pullers):
            puller.begin(fixture.room_temperature, fixture.room_temperature, 1.0)

    def advance(self, duration: float) -> None:
        """Advance everything by a duration [s] of constant PWM and load."""
        for channel in self.channels:
            channel.advance(duration)
        self.rotor.advance(duration)

    def place(self, angle: float | None) -> None:
        """Put the rotor at rest at an angle [rad], or where its torque vanishes."""
        rotor = self.rotor
        lower, upper = rotor.stops
        if angle is None:
            angle = _equilibrium(rotor)
        if not lower <= angle <= upper:
            raise MuscleBayesError(
                f"initial angle {angle} rad lies outside the stops {rotor.stops}"
            )
        rotor.angle, rotor.velocity, rotor.slipping = angle, 0.0, False


def _puller(rig: Rig, element: Element, parameters: MuscleParameters, hyst: float) -> Puller | None:
    if element.kind == "none":
        return None
    if element.kind == "spring":
        return ReferenceSpring()
    room, effects = rig.fixture.room_temperature, rig.truth.effects
    return Muscle(parameters, element.base_length, hyst=hyst, room=room, effects=effects)


def _equilibrium(rotor: Rotor) -> float:
    """Angle nearest to zero at which the torque falls through zero; without one, the stop reached.

    Where the levers collapse, far from zero, the torque may rise through zero again: not there.
    """
    lower, upper = rotor.stops
    angles = [lower + (upper - lower) * n / _SEARCH for n in range(_SEARCH + 1)]
    torques = [rotor.torque(angle) for angle in angles]
    found = [
        (angles[n], angles[n + 1]) for n in range(_SEARCH) if torques[n] > 0.0 >= torques[n + 1]
    ]
    if not found:
        return upper if rotor.torque(min(max(0.0, lower), upper)) > 0.0 else lower
    low, high = min(found, key=lambda pair: abs(pair[0] + pair[1]))
    for _ in range(60):
        middle = 0.5 * (low + high)
        if rotor.torque(middle) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
