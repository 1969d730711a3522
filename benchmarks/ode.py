"""Quasi-static motion as an ordinary differential equation, in numbers and symbols of other packages.

What is solved by JAX takes `Plant.overdamped_terms` instead; a test holds both together."""

from typing import Any, NamedTuple, Protocol

from benchmarks.problem import Lane
from muscle_bayes.conventions import STRAIN_EPSILON
from muscle_bayes.physics.muscle import DAMPER_FLOOR

COARSE_ERROR = 0.01
"""An error that just does not matter [counts RMS]: far below the sensor's resolution, far above ours."""
LAG = 3.7
"""By how many counts RMS the overdamped rotor lags on the staircases, per N m s/rad of its damping c.

It lags by c / k, k the muscle's stiffness of about 0.2 N m/rad, times its speed."""


def damping_for(error: float) -> float:
    """c [N m s/rad] whose lag is half of an error [counts RMS]: with more, accuracy is out of reach;
    with less, the equation is stiffer than it need be."""
    return 0.5 * error / LAG


class Operations(Protocol):
    """The functions of numbers that the equations need, of floats or symbols."""

    def sin(self, x: Any, /) -> Any: ...
    def cos(self, x: Any, /) -> Any: ...
    def sqrt(self, x: Any, /) -> Any: ...
    def fmax(self, x: Any, y: Any, /) -> Any: ...
    def fmin(self, x: Any, y: Any, /) -> Any: ...


class Inputs(NamedTuple):
    """`problem.INPUTS` by name."""

    D: Any
    A: Any
    B: Any
    C: Any
    F_hyst_min: Any
    K_hyst: Any
    F_modulus_min: Any
    K_modulus: Any
    H: Any
    T_hyst_offset: Any
    q: Any
    hyst: Any


def _tensile(op: Operations, strain: Any, stiffness: Any, minimum: Any) -> Any:
    opening = minimum / STRAIN_EPSILON * op.fmin(op.fmax(strain, 0.0), STRAIN_EPSILON)
    return opening + stiffness * op.fmax(strain - STRAIN_EPSILON, 0.0)


def rates(
    op: Operations, lane: Lane, p: Inputs, q: Any, hyst: Any, temperature: Any, c: float
) -> tuple[Any, Any]:
    """dq/dt [rad/s] and d sigma_hyst/dt [1/s].

        c dq/dt = max(tau - D, 0) + min(tau + D, 0),   tau = m g R_d - F_modulus dL/dq
        d sigma_hyst/dt = (F_modulus - F_hyst) / (B_hyst L_base)                  (eq. 12-17)

    The rotor has no inertia; inside the dead band it truly rests.
    """
    sin, cos = op.sin(q), op.cos(q)
    along, across = lane.anchor_x - lane.radius * cos, lane.anchor_y + lane.radius * sin
    length = op.sqrt(along * along + across * across)
    lever = lane.radius * (lane.anchor_x * sin + lane.anchor_y * cos) / length
    room = lane.room_temperature
    effective = room + lane.heated_fraction * (temperature - room)
    offset = (p.A * effective + p.B) * effective + p.C
    stretch = length / lane.base_length - 1.0 - offset - hyst
    pull = _tensile(op, stretch, lane.base_length * p.K_modulus, p.F_modulus_min)
    held = _tensile(op, hyst, lane.base_length * p.K_hyst, p.F_hyst_min)
    damper = op.fmax(p.H * (effective + p.T_hyst_offset), DAMPER_FLOOR)
    torque = lane.torque - pull * lever
    driven = op.fmax(torque - p.D, 0.0) + op.fmin(torque + p.D, 0.0)
    return driven / c, (pull - held) / (damper * lane.base_length)
