"""Twelve kinds of rig, each by a function of a seed."""

from collections.abc import Callable, Sequence
from dataclasses import fields
from itertools import pairwise

import numpy as np

from benchmarks.rigs.example import Example
from benchmarks.rigs.motion import moved
from muscle_bayes.conventions import GRAVITY
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.plant.heater import HeaterTube
from muscle_bayes.twin.plant.parameters import MuscleParameters
from muscle_bayes.twin.plant.springs import Muscle

HEAD = 'format = 1\nprotocol = "{protocol}"\norigin = "synthetic"\n\n[columns]\ntime = "time_s"\n'
SPRING = '\n[element_a]\nkind = "spring"\nlinkage = "{linkage}"\n'
LINEAR = '\n[fixture]\nmotion = "linear"\n'


def _head(protocol: str = "free") -> str:
    return HEAD.format(protocol=protocol)


def _noisy(values: np.ndarray, noise: float, seed: int, stream: int = 0) -> np.ndarray:
    rng = np.random.default_rng((seed, stream))
    return values + noise * rng.standard_normal(values.size)


def mass_on_spring(seed: int = 0) -> Example:
    time, mass, rate, pull, damping, dry = np.arange(0, 4, 0.01), 0.8, 350.0, 2.0, 3.0, 0.15

    def force(t: float, x: float, v: float) -> float:
        return mass * GRAVITY - pull - rate * x - damping * v

    x = moved(force, mass, dry, time, 0.05).q
    return Example(
        "mass-on-spring",
        "A known mass hangs on a spring of which nothing is known. Nothing else moves, so the inertia "
        "beyond the load is stated as 0.",
        {"time_s": time, "x_mm": 1e3 * _noisy(x, 2e-4, seed)},
        _head()
        + 'position = "x_mm"\nposition_unit = "mm"\n'
        + LINEAR
        + "inertia = 0.0\n"
        + SPRING.format(linkage="straight")
        + f"\n[load]\ntime = [0.0]\nmass = [{mass}]\n",
        {
            "element_a.rate": rate,
            "element_a.tension_at_zero": pull,
            "element_a.damping": damping,
            "D": dry,
        },
    )


def torsion_pendulum(seed: int = 0) -> Example:
    time, inertia, rate, damping, dry = np.arange(0, 8, 0.02), 2e-3, 0.12, 3e-4, 1.5e-3
    q = moved(lambda t, q, v: -rate * q - damping * v, inertia, dry, time, 1.2).q
    return Example(
        "torsion-pendulum",
        "A disc of known inertia swings on a wire. Rate and damping of the wire are unknown.",
        {"time_s": time, "angle_deg": np.rad2deg(_noisy(q, 2e-3, seed))},
        _head()
        + 'position = "angle_deg"\nposition_unit = "deg"\n'
        + f"\n[fixture]\ninertia = {inertia}\n"
        + SPRING.format(linkage="torsion")
        + "tension_at_zero = 0.0\n",
        {"element_a.rate": rate, "element_a.damping": damping, "D": dry},
    )


def unknown_arm(seed: int = 0) -> Example:
    time, inertia, moment, hangs, dry = np.arange(0, 6, 0.02), 6e-3, 0.35, 0.2, 4e-3
    q = moved(lambda t, q, v: -moment * np.sin(q - hangs), inertia, dry, time, 1.3).q
    return Example(
        "unknown-arm",
        "A rod of known inertia swings with a weight that nobody weighed, and hangs at an angle that "
        "nobody measured. Its moment m g d is estimated.",
        {"time_s": time, "angle_rad": _noisy(q, 2e-3, seed)},
        _head()
        + 'position = "angle_rad"\nposition_unit = "rad"\n'
        + f'\n[fixture]\ninertia = {inertia}\n\n[element_a]\nkind = "arm"\nmoment_of_inertia = 0.0\n',
        {"element_a.moment": moment, "element_a.hanging_angle": hangs, "D": dry},
    )


def encoder_ticks(seed: int = 0) -> Example:
    time, inertia, dry, step = np.arange(0, 6, 0.02), 1.5e-3, 8e-3, 2 * np.pi / 4096
    mass, distance = 0.3, 0.15
    arm = mass * distance**2
    q = moved(
        lambda t, q, v: -mass * GRAVITY * distance * np.sin(q), inertia + arm, dry, time, 1.0
    ).q
    return Example(
        "encoder-ticks",
        "An encoder of 4096 ticks a turn on a pendulum. The first tick is anywhere: the zero is "
        "uncertain by some ticks.",
        {"time_s": time, "ticks": np.round(q / step + 20_003.0)},
        _head()
        + 'position = "ticks"\n'
        + f"\n[potentiometer]\nzero_reading = 20000\nradians_per_count = {step:.9g}\n"
        + f'bits = 16\nzero_uncertainty = 5.0\n\n[element_a]\nkind = "arm"\nmass = {mass}\n'
        + f"centre_distance = {distance}\n",
        {"J": inertia, "D": dry},
    )


def flywheel(seed: int = 0) -> Example:
    time, inertia, dry = np.arange(0, 10, 0.02), 5e-3, 0.02
    torque = np.where(np.mod(time, 5.0) < 2.0, 0.08, 0.0)
    drive = lambda t: float(np.interp(t, time, torque))  # noqa: E731
    speed = moved(lambda t, q, v: drive(t), inertia, dry, time, 0.0).speed
    return Example(
        "flywheel",
        "A known torque spins a wheel up, and it coasts down. A tachometer shows its speed.",
        {"time_s": time, "rpm": _noisy(speed, 0.1, seed) * 30 / np.pi, "torque_nm": torque},
        _head()
        + 'position = "rpm"\nposition_unit = "rpm"\napplied = "torque_nm"\n'
        + '\n[element_a]\nkind = "none"\n',
        {"J": inertia, "D": dry},
    )


def gyroscope(seed: int = 0) -> Example:
    time, inertia, dry, moment = np.arange(0, 8, 0.02), 0.05, 0.03, 2.0
    speed = moved(lambda t, q, v: -moment * np.sin(q), inertia, dry, time, 0.6).speed
    return Example(
        "gyroscope",
        "A gyroscope rides on a pendulum and shows its rate; the first angle is not measured.",
        {"time_s": time, "rate_rad_s": _noisy(speed, 5e-3, seed)},
        _head()
        + 'position = "rate_rad_s"\nposition_unit = "rad/s"\n'
        + f'\n[element_a]\nkind = "arm"\nmoment = {moment}\n',
        {"J": inertia, "D": dry},
    )


def motor_current(seed: int = 0) -> Example:
    time, inertia, dry, gain, offset = np.arange(0, 8, 0.01), 1e-3, 0.02, 0.09, 0.05
    mass, distance = 0.25, 0.12
    current = 2.0 * np.sin(2.0 * time) + 1.0 * np.sin(5.0 * time)
    total = inertia + mass * distance**2

    def force(t: float, q: float, v: float) -> float:
        motor = gain * (float(np.interp(t, time, current)) - offset)
        return motor - mass * GRAVITY * distance * np.sin(q)

    q = moved(force, total, dry, time, 0.0).q
    return Example(
        "motor-current",
        "A motor swings a known arm. Its current is logged; its torque constant and the current "
        "sensor's zero are unknown.",
        {"time_s": time, "angle_rad": _noisy(q, 1e-3, seed), "current_a": current},
        _head()
        + 'position = "angle_rad"\nposition_unit = "rad"\napplied = "current_a"\n'
        + f'applied_unit = "A"\n\n[element_a]\nkind = "arm"\nmass = {mass}\n'
        + f"centre_distance = {distance}\n",
        {"drive.gain": gain, "drive.offset": offset, "J": inertia, "D": dry},
    )


def motor_duty(seed: int = 0) -> Example:
    time, inertia, dry, gain, back_emf = np.arange(0, 12, 0.02), 2e-3, 0.01, 0.12, 3e-3
    duty = np.where(np.mod(time, 4.0) < 2.0, 0.6, -0.4) * np.minimum(time / 0.02, 1.0)

    def force(t: float, q: float, v: float) -> float:
        return gain * float(np.interp(t, time, duty)) - back_emf * v

    speed = moved(force, inertia, dry, time, 0.0).speed
    return Example(
        "motor-duty",
        "PWM drives a motor with a wheel of known inertia; a tachometer shows its speed. Stall torque "
        "and back-EMF are unknown.",
        {"time_s": time, "speed_rad_s": _noisy(speed, 0.05, seed), "duty": duty},
        _head()
        + 'position = "speed_rad_s"\nposition_unit = "rad/s"\napplied = "duty"\n'
        + 'applied_unit = "duty"\n'
        + f"\n[fixture]\ninertia = {inertia}\n\n[drive]\noffset = 0.0\n"
        + '\n[element_a]\nkind = "none"\n',
        {"drive.gain": gain, "drive.back_emf": back_emf, "D": dry},
    )


def tensile_test(seed: int = 0) -> Example:
    time, rate, pull, damping = np.arange(0, 20, 0.02), 300.0, 2.0, 5.0
    x = 0.01 * np.sin(2.0 * time) + 0.002 * time
    tension = pull + rate * x + damping * (0.02 * np.cos(2.0 * time) + 0.002)
    return Example(
        "tensile-test",
        "A machine pulls a sample to and fro and logs its force.",
        {"time_s": time, "x_m": x, "force_n": _noisy(tension, 0.05, seed)},
        _head("imposed")
        + 'position = "x_m"\nposition_unit = "m"\nforce = "force_n"\n'
        + LINEAR
        + SPRING.format(linkage="straight"),
        {"element_a.rate": rate, "element_a.tension_at_zero": pull, "element_a.damping": damping},
    )


def force_and_position(seed: int = 0) -> Example:
    time, mass, rate, pull, dry = np.arange(0, 4, 0.01), 0.5, 200.0, 1.0, 0.1
    force = lambda t, x, v: mass * GRAVITY - pull - rate * x  # noqa: E731
    x = moved(force, mass + 0.2, dry, time, 0.06).q
    return Example(
        "force-and-position",
        "A carriage of unknown mass and a load on a spring, with a load cell in the spring's line. The "
        "force tells the spring, the motion the carriage.",
        {
            "time_s": time,
            "x_m": _noisy(x, 1e-4, seed),
            "f_n": _noisy(pull + rate * x, 0.05, seed, 1),
        },
        _head()
        + 'position = "x_m"\nposition_unit = "m"\nforce = "f_n"\n'
        + LINEAR
        + SPRING.format(linkage="straight")
        + f"damping = 0.0\n\n[load]\ntime = [0.0]\nmass = [{mass}]\n",
        {"element_a.rate": rate, "element_a.tension_at_zero": pull, "J": 0.2, "D": dry},
    )


BASE, WARMEST = 0.1, 80.0
SETTLED = 3000
"""Seconds for which a held muscle has been held before it is logged."""
LEVELS = (0.0, 1.0, 0.3, 0.7, 0.0, 0.5, 1.0, 0.1, 0.6)
"""To which a held muscle is heated, a minute each, as a share."""


def _held(heat: Sequence[float], length: float) -> tuple[np.ndarray, dict[str, float]]:
    """Tension [N] of a muscle that is held at a length [m], at temperatures 0.1 s apart [C]; the truth.

    It has been held there for long.
    """
    parameters = MuscleParameters()
    muscle, tensions = Muscle(parameters, BASE, hyst=0.02), []
    for _ in range(SETTLED):
        muscle.begin(heat[0], heat[0], 1.0)
        muscle.tension(length)
        muscle.advance(1.0)
    for before, after in pairwise(heat):
        muscle.begin(before, after, 0.1)
        tensions.append(muscle.tension(length))
        muscle.advance(0.1)
    names = (field.name for field in fields(parameters) if field.name != "epsilon")
    truth = {name: float(getattr(parameters, name)) for name in names}
    return np.array([*tensions, tensions[-1]]), truth


def isometric_muscle(seed: int = 0) -> Example:
    time, length = np.arange(0, 480, 0.1), 1.2 * BASE
    share = np.interp(np.mod(time / 60.0, 1.0), (0.2, 0.5), (0.0, 1.0))
    levels, now = np.array(LEVELS), (time / 60.0).astype(int)
    heat = 25.0 + (WARMEST - 25.0) * (levels[now] + share * (levels[now + 1] - levels[now]))
    tension, truth = _held(list(heat), length)
    return Example(
        "isometric-muscle",
        "A muscle is held at a fixed length and heated; a load cell shows its tension.",
        {"time_s": time, "muscle_c": heat, "tension_n": _noisy(tension, 0.01, seed)},
        _head("imposed")
        + 'temperature_a = "muscle_c"\nforce = "tension_n"\n'
        + LINEAR
        + f'\n[element_a]\nkind = "muscle"\nlinkage = "straight"\nbase_length = {BASE}\n'
        + f"length_at_zero = {length}\n",
        truth,
    )


def heater_power(seed: int = 0) -> Example:
    time, length, rate, cooling = np.arange(0, 480, 0.1), 1.2 * BASE, 0.9, 30.0
    power = 1.8 * np.array(LEVELS)[(time / 60.0).astype(int)]
    tube, heat = HeaterTube(rate, cooling, 25.0), [25.0]
    for watts in power[:-1]:
        heat.append(tube.advance(255.0 * watts, 0.1))
    tension, truth = _held(heat, length)
    own = {"heater_a.heating_rate": rate, "heater_a.cooling_time": cooling}
    return Example(
        "heater-power",
        "The same without a thermometer: the heater's power is logged, and warms the muscle at a rate "
        "that is unknown.",
        {"time_s": time, "power_w": power, "tension_n": _noisy(tension, 0.01, seed)},
        _head("imposed")
        + 'power_a = "power_w"\npower_held = true\nforce = "tension_n"\n'
        + LINEAR
        + f'\n[element_a]\nkind = "muscle"\nlinkage = "straight"\nbase_length = {BASE}\n'
        + f"length_at_zero = {length}\n",
        {**own, **truth},
    )


EXAMPLES: dict[str, Callable[[int], Example]] = {
    one.__name__.replace("_", "-"): one
    for one in (
        mass_on_spring,
        torsion_pendulum,
        unknown_arm,
        encoder_ticks,
        flywheel,
        gyroscope,
        motor_current,
        motor_duty,
        tensile_test,
        force_and_position,
        isometric_muscle,
        heater_power,
    )
}
"""By name."""


def example(name: str, seed: int = 0) -> Example:
    """A simulated run of one of `EXAMPLES`. Raises MuscleBayesError for other names."""
    if name not in EXAMPLES:
        known = ", ".join(EXAMPLES)
        raise MuscleBayesError(f"there is no example {name!r}. Fix: choose one of {known}.")
    return EXAMPLES[name](seed)
