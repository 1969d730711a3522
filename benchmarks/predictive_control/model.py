"""The median joint in CasADi: heaters, muscles and a rotor without inertia. It shares no code with ours."""

from typing import Any, NamedTuple

import casadi
import numpy as np

from muscle_bayes.control.plant.joint import Joint
from muscle_bayes.conventions import STRAIN_EPSILON
from muscle_bayes.physics.effects.muscle.coil_contact import CoilContact
from muscle_bayes.physics.effects.muscle.damper_law import DamperLaw
from muscle_bayes.physics.linkage import Pins
from muscle_bayes.physics.muscle import DAMPER_FLOOR, MuscleParameters

NEWTON_STEPS = 2
"""From the angle of one instant to that of the next, which is near."""
SHARP = 100.0
"""Dry friction's corners are rounded over a band of D divided by this: a resting joint hardly creeps."""
SOFTENED = 3.0
"""The same where slopes are taken, for a joint that rests has none. With such corners a prediction would
creep to the setpoint by itself, and the joint would be left where it sticks."""
STATE = 7
"""Power share and temperature above the room of A and B, sigma_hyst of A and B, angle."""
DISTURBANCES = 3
"""Heating of A and of B that the model does not know [K/s], and torque [N m]."""


class Side(NamedTuple):
    """One muscle on its pins, in SI units and C."""

    mirror: float
    radius: float
    anchor_x: float
    anchor_y: float
    base_length: float
    heated_fraction: float
    parameters: dict[str, float]
    contact: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Stiffness [N], onset and width of touching coils."""
    law: tuple[float, float] = (0.0, 0.0)
    """Activation temperature and curvature of another damper law [K]."""


class Numbers(NamedTuple):
    """What the model takes of a joint."""

    sides: tuple[Side, Side]
    friction: float
    """N m"""
    room: float
    """C"""
    gain: tuple[float, float]
    """K/s at full power"""
    cooling: tuple[float, float]
    """1/s"""
    lag: tuple[float, float]
    """s"""


def numbers_of(joint: Joint) -> Numbers:
    """Numbers of one joint. Raises ValueError for effects but those of `Side`, and linkages but pins."""
    contact, law = (0.0, 0.0, 0.0), (0.0, 0.0)
    for effect in joint.plant.effects:
        if isinstance(effect, CoilContact):
            contact = float(effect.stiffness), float(effect.onset), float(effect.width)
        elif isinstance(effect, DamperLaw):
            law = float(effect.activation_temperature), float(effect.curvature)
        else:
            raise ValueError(
                "of effects, the predictive controller's model knows coil contact and damper law only"
            )
    sides = []
    for muscle in joint.plant.muscles.values():
        pins = muscle.linkage
        if not isinstance(pins, Pins):
            raise ValueError("the predictive controller's model knows muscles between pins only")
        table = {
            key: float(getattr(muscle.parameters, key)) for key in MuscleParameters.__annotations__
        }
        sides.append(
            Side(
                float(pins.mirror),
                float(pins.radius),
                float(pins.anchor_x),
                float(pins.anchor_y),
                float(muscle.base_length),
                float(muscle.heated_fraction),
                table,
                contact,
                law,
            )
        )
    first, second = sides
    heater = joint.heater
    gain, cooling, lag = (
        (float(value[0]), float(value[1])) for value in (heater.gain, heater.cooling, heater.lag)
    )
    dry = float(joint.plant.friction.dry)
    return Numbers((first, second), dry, float(heater.room), gain, cooling, lag)


def _tensile(strain: Any, stiffness: float, least: float) -> Any:
    """Tension [N] of a spring that opens at a least force (eq. 13 and 14)."""
    opening = least / STRAIN_EPSILON * casadi.fmin(casadi.fmax(strain, 0.0), STRAIN_EPSILON)
    return opening + stiffness * casadi.fmax(strain - STRAIN_EPSILON, 0.0)


def _pushed(side: Side, strain: Any) -> Any:
    """Force of touching coils [N] (eq. 18, with a width over which they begin to touch)."""
    stiffness, onset, width = side.contact
    depth = casadi.fmax(onset - strain, 0.0)
    touched = casadi.fmin(depth, width)
    return stiffness * (depth - touched + touched**2 / (2.0 * max(width, 1e-12)))


def _lawful(law: tuple[float, float], celsius: Any) -> Any:
    """Factor of HYST's damper under another law of temperature, 1 at 25 C."""
    z = (celsius - 25.0) / (celsius + 273.15)
    return casadi.exp(-z * (law[0] + law[1] * z) / 298.15)


def _pulled(side: Side, q: Any, hyst: Any, temperature: Any, room: float) -> tuple[Any, Any]:
    """Torque of one muscle [N m] and d sigma_hyst/dt [1/s], eq. 7 to 17."""
    p, base = side.parameters, side.base_length
    along = side.anchor_x - side.radius * casadi.cos(q)
    across = side.anchor_y + side.mirror * side.radius * casadi.sin(q)
    length = casadi.sqrt(along**2 + across**2)
    swing = side.anchor_x * casadi.sin(q) + side.mirror * side.anchor_y * casadi.cos(q)
    warm = room + side.heated_fraction * (temperature - room)
    offset = (p["A"] * warm + p["B"]) * warm + p["C"]
    stretch = length / base - 1.0 - offset - hyst
    tension = _tensile(stretch, base * p["K_modulus"], p["F_modulus_min"])
    relaxed = _tensile(hyst, base * p["K_hyst"], p["F_hyst_min"])
    damper = casadi.fmax(p["H"] * (warm + p["T_hyst_offset"]), DAMPER_FLOOR)
    damper *= _lawful(side.law, warm)
    total = tension - _pushed(side, length / base - 1.0)
    return -total * side.radius * swing / length, (tension - relaxed) / (damper * base)


def torque_function(numbers: Numbers) -> casadi.Function:
    """(q, hyst [2], temperature [2, C]) to torque [N m] and both d sigma_hyst/dt [1/s]; no load."""
    q = casadi.SX.sym("q")
    hyst, warm = casadi.SX.sym("hyst", 2), casadi.SX.sym("warm", 2)
    rows = [
        _pulled(side, q, hyst[i], warm[i], numbers.room) for i, side in enumerate(numbers.sides)
    ]
    rates = casadi.vertcat(*(rate for _, rate in rows))
    return casadi.Function("torque", [q, hyst, warm], [rows[0][0] + rows[1][0], rates])


def _beyond_friction(torque: Any, dry: float, corners: float) -> Any:
    """Torque beyond what dry friction withstands, with rounded corners: it slides by that."""
    if dry <= 0.0:
        return torque
    width = dry / corners

    def above(x: Any) -> Any:
        # log(1 + e^x) without overflow
        return casadi.fmax(x, 0.0) + casadi.log1p(casadi.exp(-casadi.fabs(x)))

    return width * (above((torque - dry) / width) - above((-torque - dry) / width))


def _heated(
    numbers: Numbers, side: int, x: Any, duty: Any, more: Any, step: Any
) -> tuple[Any, Any]:
    """Power and temperature above the room after a step of constant duty: the exact solution."""
    cooling, lag = numbers.cooling[side], numbers.lag[side]
    cools, lags = casadi.exp(-cooling * step), casadi.exp(-step / lag)
    heats = (1.0 - cools) / cooling
    late = numbers.gain[side] * lag * (cools - lags) / (1.0 - cooling * lag)
    behind = x[side] - duty
    excess = cools * x[2 + side] + heats * (numbers.gain[side] * duty + more) + late * behind
    return duty + lags * behind, excess


def stage_function(numbers: Numbers, corners: float = SHARP) -> casadi.Function:
    """(state, duties as shares [2], disturbances, step [s]) to the state after the step.

    Heaters exactly, HYST by an explicit step, then the angle to where friction holds, by Newton steps.
    """
    x, u = casadi.SX.sym("x", STATE), casadi.SX.sym("u", 2)
    d, step = casadi.SX.sym("d", DISTURBANCES), casadi.SX.sym("step")
    torque = torque_function(numbers)
    power, excess = zip(*(_heated(numbers, i, x, u[i], d[i], step) for i in (0, 1)), strict=True)
    before = numbers.room + x[2:4]
    hyst = x[4:6] + step * torque(x[6], x[4:6], before)[1]
    warm = numbers.room + casadi.vertcat(*excess)
    angle, q = casadi.SX.sym("angle"), x[6]
    pull = torque(angle, hyst, warm)[0]
    slope = casadi.Function("slope", [angle, x, u, d, step], [pull, casadi.jacobian(pull, angle)])
    # Friction resists from where the joint was: what is beyond it at q moves the joint, once.
    value, steep = slope(q, x, u, d, step)
    moved = q - _beyond_friction(value + d[2], numbers.friction, corners) / steep
    for _ in range(NEWTON_STEPS - 1):
        aim = value + d[2] - _beyond_friction(value + d[2], numbers.friction, corners)
        there, steep = slope(moved, x, u, d, step)
        moved = moved - (there + d[2] - aim) / steep
    after = casadi.vertcat(*power, *excess, hyst, moved)
    return casadi.Function("stage", [x, u, d, step], [after], ["x", "u", "d", "step"], ["after"])


def resting_state(hyst: np.ndarray, angle: float) -> np.ndarray:
    """The state of a cold joint at rest."""
    return np.r_[np.zeros(4), hyst, angle]
