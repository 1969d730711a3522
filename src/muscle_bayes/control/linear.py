"""The joint and its loop, linearised: state space, loop gain and margins, for python-control."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import control
from muscle_bayes.control.closed_loop import resting_plant, start_of
from muscle_bayes.control.laws.gains import Gains, Inner, fits_the_board
from muscle_bayes.control.laws.law import FULL_DUTY
from muscle_bayes.control.plant.draws import JointDraws
from muscle_bayes.control.plant.joint import Joint
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.running.blas import one_blas_thread
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.physics.bisection import bisect
from muscle_bayes.physics.state import Drive

LEAST_LAG = 1e-3
"""A lag below this is taken for it, so that the state space has the same order [s]."""
STATES = ("angle", "speed", "hyst_a", "hyst_b", "excess_b", "power_b")
SLOWEST, FREQUENCIES = 1e-3, 1500
"""Lowest frequency [rad/s] and number of frequencies at which a loop gain is looked at."""
HOTTEST_EXCESS = 200.0
"""How far above the room the temperature is looked for that holds an angle [K]."""


def _rates(joint: Joint, bias: Array):
    """dx/dt of STATES as a function of (x, duty of B); A's excess stays at `bias` [K]."""
    heater, plant = joint.heater, resting_plant(joint)
    lag = jnp.maximum(heater.lag[1], LEAST_LAG)

    def rates(x, duty):
        q, speed, excess, power = x[0], x[1], x[4], x[5]
        temperature = heater.room + jnp.stack([bias, excess])
        drive = Drive(temperature, jnp.zeros(()), jnp.zeros(()))
        force = plant.force(q, speed, x[2:4], drive)
        hyst = plant.hyst_rate(q, speed, x[2:4], drive)
        heats = heater.gain[1] * power - heater.cooling[1] * excess
        gains = (duty / FULL_DUTY - power) / lag
        rotor = jnp.stack([speed, force / plant.inertia(drive.load)])
        return jnp.concatenate([rotor, hyst, jnp.stack([heats, gains])])

    return rates


class OperatingPoint(NamedTuple):
    """Where the joint is held by heating muscle B, A being at bias."""

    state: Array
    """In the order of STATES."""
    duty: Array
    """Of muscle B."""
    stiffness: Array
    """-d torque / d angle, HYST and temperatures held [N m / rad]."""
    reachable: Array
    """Whether any temperature up to HOTTEST_EXCESS balances the torques."""


@jax.jit
def _held(joint: Joint, angle: Array, bias: Array) -> OperatingPoint:
    """The operating point, and whether there is one."""
    start = start_of(joint, jnp.zeros(()), jnp.zeros(()))
    plant, heater = resting_plant(joint), joint.heater

    def force(excess: Array, q: Array) -> Array:
        temperature = heater.room + jnp.stack([bias, excess])
        drive = Drive(temperature, jnp.zeros(()), jnp.zeros(()))
        return plant.force(q, jnp.zeros(()), start.hyst, drive)

    low, high = jnp.zeros(()), jnp.asarray(HOTTEST_EXCESS)
    reachable = (force(low, angle) < 0.0) & (force(high, angle) > 0.0)
    excess = bisect(lambda e: -force(e, angle), low, high)
    stiffness = -jax.grad(force, 1)(excess, angle)
    duty = heater.holding_duty(excess, 1)
    turned = jnp.stack([angle, jnp.zeros(())])
    heat = jnp.stack([excess, duty / FULL_DUTY])
    return OperatingPoint(jnp.concatenate([turned, start.hyst, heat]), duty, stiffness, reachable)


@jax.jit
def _matrices(joint: Joint, held: OperatingPoint, bias: Array) -> tuple[Array, Array]:
    """Derivatives of the rates with respect to state and duty."""
    return jax.jacfwd(_rates(joint, bias), (0, 1))(held.state, held.duty)


def operating_point(joint: Joint, angle: float, bias: float = 0.0) -> OperatingPoint:
    """Held at `angle` [rad] soon after a step: HYST as it was at rest in the cold.

    Raises MuscleBayesError where muscle B cannot hold the angle.
    """
    held = _held(joint, jnp.asarray(float(angle)), jnp.asarray(float(bias)))
    if not bool(held.reachable):
        raise MuscleBayesError(f"no temperature of muscle B holds this joint at {angle:g} rad")
    return jax.tree.map(np.asarray, held)


def state_space(joint: Joint, angle: float, bias: float = 0.0) -> control.StateSpace:
    """From the duty of muscle B to the angle [rad], about an operating point.

    Dry friction has no linearisation and is left out: a joint that sticks moves less than this says.
    Temperature filters among the effects are left out as well, and what effects remember is held as
    it is at rest. Raises as `operating_point`.
    """
    held = operating_point(joint, angle, bias)
    a, b = _matrices(joint, held, jnp.asarray(float(bias)))
    c = np.eye(1, len(STATES))
    return control.ss(
        np.asarray(a),
        np.asarray(b)[:, None],
        c,
        [[0.0]],
        states=list(STATES),
        inputs=["duty_b"],
        outputs=["angle"],
    )


def sampled_plant(
    joint: Joint, angle: float, period: float, bias: float = 0.0, inner: Inner | None = None
) -> control.StateSpace:
    """`state_space` as the controller sees it: held input, readings late by the sensor's delay.

    The input is the duty of B, or with an `inner` loop the temperature that is asked of it.
    """
    plant = state_space(joint, angle, bias)
    if inner is not None:
        row = inner.heat * np.eye(1, len(STATES), STATES.index("excess_b"))
        plant = control.ss(
            plant.A - plant.B @ row, (inner.hold + inner.heat) * plant.B, plant.C, plant.D
        )
    plant = control.sample_system(plant, period, "zoh")
    delay = joint.potentiometer.delay
    late = control.tf([1.0], [1.0] + [0.0] * delay, period)
    return plant * control.ss(late) if delay else plant


def pi_controller(gains: Gains) -> control.TransferFunction:
    """kp + ki h / (z - 1) [duty / rad]: the sum is that of earlier errors, as on the bench."""
    if gains.integral == 0.0:
        return control.tf([gains.proportional], [1.0], gains.period)
    kp, ki = gains.proportional, gains.integral * gains.period
    return control.tf([kp, ki - kp], [1.0, -1.0], gains.period)


class Margins(NamedTuple):
    """Of one draw's loop."""

    gain: float
    """Factor by which the loop gain may grow; infinite where it may grow for ever."""
    phase: float
    """deg"""
    crossover: float
    """rad/s"""
    stable: bool
    """Whether the closed loop's poles lie inside the unit circle."""


class Loop(NamedTuple):
    """Loop gains of several draws, held at an angle."""

    frequency: np.ndarray
    """rad/s"""
    gain: np.ndarray
    """(draw, frequency), complex"""
    margins: list[Margins]
    disk: np.ndarray
    """Balanced disk margin of each draw: gain and phase may vary at once within it."""


def loop_gain(joint: Joint, gains: Gains, angle: float) -> control.StateSpace:
    """Controller times plant at an angle [rad]; of a cascade with its inner loop closed."""
    plant = sampled_plant(joint, angle, gains.period, inner=gains.inner)
    if gains.integral == 0.0:  # by hand: a system without states trips over NumPy 2.5
        kp = gains.proportional
        return control.ss(plant.A, kp * plant.B, plant.C, kp * plant.D, plant.dt)
    return plant * control.ss(pi_controller(gains))


def _frequencies(period: float) -> np.ndarray:
    """Up to half the sampling rate [rad/s], close enough for the rotor's resonance."""
    return np.geomspace(SLOWEST, np.pi / period, FREQUENCIES)


def margins_of(loop: control.StateSpace) -> Margins:
    """Margins of a sampled loop."""
    response = control.frd(loop, _frequencies(loop.dt))
    gain, phase, _, _, crossover, _ = control.stability_margins(response)
    # Unity feedback: A - B (1 + D)^-1 C.
    poles = np.linalg.eigvals(loop.A - loop.B @ loop.C / (1.0 + loop.D[0, 0]))
    stable = bool(np.all(np.abs(poles) < 1.0))
    return Margins(float(gain), float(phase), float(crossover), stable)


@one_blas_thread
@double_precision
def loops(draws: JointDraws, gains: Gains, angle: float, count: int = 40) -> Loop:
    """Loop gains and margins of the first `count` draws that muscle B can hold at an angle [rad]."""
    frequency = _frequencies(gains.period)
    rows, found = [], []
    for index in range(min(count, len(draws))):
        try:
            loop = loop_gain(draws.one(index), gains, angle)
        except MuscleBayesError:
            continue  # this joint rests so far off that the muscle cannot hold the angle
        rows.append(np.asarray(loop(np.exp(1j * frequency * gains.period))).reshape(-1))
        found.append(margins_of(loop))
    gain = np.array(rows)
    # 1 / max |S - T| / 2: Seiler, Packard and Gahinet, IEEE Control Systems 40 (2020), 78-95
    disk = np.min(2.0 * np.abs(1.0 + gain) / np.abs(1.0 - gain), axis=-1)
    return Loop(frequency, gain, found, disk)


PHASE_MARGIN, GAIN_MARGIN = 60.0, 2.0
INTEGRAL_SHARE = 0.1
"""Corner of the integral, share of the crossover."""


@one_blas_thread
@double_precision
def snapshot_gains(draws: JointDraws, angle: float, *, period_ms: int = 30) -> Gains:
    """PI tuned as the thesis did: on one joint linearised near the end of a step's response.

    The thesis prints no gains; a tool chose them "for a high-speed controller". Here: the fastest
    crossover with a phase margin of 60 degrees and a gain margin of 2, for the median of the draws.
    """
    joint = draws.median().one()
    plant = sampled_plant(joint, angle, period_ms / 1000.0)
    chosen = None
    for crossover in np.geomspace(0.02, 0.5 * np.pi / (period_ms / 1000.0), 80):
        response = complex(plant(np.exp(1j * crossover * period_ms / 1000.0)))
        kp = float(1.0 / abs(response) / np.hypot(1.0, INTEGRAL_SHARE))
        gains = Gains(
            law="thesis",
            period_ms=period_ms,
            proportional=kp,
            integral=kp * INTEGRAL_SHARE * float(crossover),
        )
        if not fits_the_board(gains, draws.design):
            continue
        found = margins_of(plant * control.ss(pi_controller(gains)))
        if found.stable and found.phase >= PHASE_MARGIN and found.gain >= GAIN_MARGIN:
            chosen = gains
    if chosen is None:
        raise MuscleBayesError("no PI gains reach 60 degrees and a factor of 2 on this joint")
    return chosen
