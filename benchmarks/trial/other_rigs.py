"""Rigs that are not the thesis': pendulums, driven axes and sprung discs of random size and sensor."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, sin
from typing import Any

import numpy as np
from jaxtyping import Float

from benchmarks.trial.outside import OUTSIDE
from muscle_bayes.conventions import GRAVITY
from muscle_bayes.twin import EFFECTS, Effect
from muscle_bayes.twin.plant.rotor import Rotor

HELD = "held"
"""Name of the run that is held out."""
HEAD = """format = 1
protocol = "free"
origin = "synthetic"

[columns]
time = "time_s"
position = "shown"
position_unit = "{unit}"
"""


@dataclass(frozen=True, kw_only=True)
class OtherRig:
    """One coordinate, with what drives it and how it is read."""

    unit: str
    metadata: str
    """What follows the head of NAME.toml."""
    inertia: float
    dry: float
    force: float
    """Typical generalised force [N m or N]."""
    speed: float
    reach: float
    """Typical amplitude [rad or m]."""
    pull: Callable[[float], float]
    """Generalised force of what the rig carries, at a coordinate."""
    starts: tuple[float, ...]
    """First coordinate of every run, the held-out one last."""
    drive: Sequence[Float[np.ndarray, " row"]] | None
    """Known force of every run, held from row to row."""
    step: float
    noise: float
    """Resolution of the sensor, and noise of a reading [rad or m]."""
    period: float
    rows: int


def pendulum(rng: np.random.Generator) -> OtherRig:
    """A known arm swings down from several angles."""
    mass, distance = rng.uniform(0.1, 1.0), rng.uniform(0.06, 0.3)
    moment = mass * GRAVITY * distance
    inertia = mass * distance**2 * rng.uniform(1.05, 1.5)
    first = float(rng.uniform(0.6, 1.2))
    ticks = int(rng.choice([1024, 2048, 4096, 8192]))
    arm = f'\n[element_a]\nkind = "arm"\nmass = {mass}\ncentre_distance = {distance}\n'
    dry = moment * rng.uniform(0.005, 0.03)
    return _swinging(rng, arm, inertia, moment, dry, first, ticks, lambda q: -moment * sin(q))


def disc(rng: np.random.Generator) -> OtherRig:
    """A disc of known inertia swings on a wire of unknown rate."""
    inertia, rate = rng.uniform(1e-3, 1e-2), rng.uniform(0.1, 0.6)
    first = float(rng.uniform(0.8, 1.5))
    ticks = int(rng.choice([1024, 2048, 4096]))
    wire = (
        f"\n[fixture]\ninertia = {inertia}\n\n[element_a]\n"
        'kind = "spring"\nlinkage = "torsion"\ntension_at_zero = 0.0\ndamping = 0.0\n'
    )
    dry = rate * first * rng.uniform(0.01, 0.03)
    return _swinging(rng, wire, inertia, rate, dry, first, ticks, lambda q: -rate * q)


def _swinging(
    rng: np.random.Generator,
    metadata: str,
    inertia: float,
    rate: float,
    dry: float,
    first: float,
    ticks: int,
    pull: Callable[[float], float],
) -> OtherRig:
    """What is released from `first` [rad] against a `rate` [N m/rad], and read in so many ticks a turn."""
    step = 2.0 * np.pi / ticks
    return OtherRig(
        unit="rad",
        metadata=metadata,
        inertia=inertia,
        dry=dry,
        force=rate * first,
        speed=first * float(np.sqrt(rate / inertia)),
        reach=first,
        pull=pull,
        starts=(first, -0.7 * first, 0.5 * first, 0.85 * first),
        drive=None,
        step=step,
        noise=step * rng.uniform(0.2, 1.0),
        period=0.005,
        rows=1500,
    )


def axis(rng: np.random.Generator) -> OtherRig:
    """A carriage that a known force drives to and fro."""
    mass, amplitude = rng.uniform(1.0, 40.0), rng.uniform(5.0, 50.0)
    time = 0.004 * np.arange(2500)
    slow = rng.uniform(0.3, 0.6)
    drives = []
    for _ in range(3):
        phases = rng.uniform(0.0, 2.0 * np.pi, 2)
        waves = [
            np.cos(2 * np.pi * f * slow * time + p) for f, p in zip((1, 2.7), phases, strict=True)
        ]
        drives.append(np.round(amplitude * (0.7 * waves[0] + 0.5 * waves[1]), 4))
    speed = amplitude / mass / (2.0 * np.pi * slow)
    reach = speed / (2.0 * np.pi * slow)
    step = reach * float(np.exp(rng.uniform(np.log(1e-4), np.log(1e-3))))
    force = 'applied = "force_n"\napplied_held = true\n\n[fixture]\nmotion = "linear"\n'
    return OtherRig(
        unit="m",
        metadata=f'{force}\n[element_a]\nkind = "none"\n',
        inertia=mass,
        dry=amplitude * rng.uniform(0.03, 0.1),
        force=amplitude,
        speed=speed,
        reach=reach,
        pull=lambda q: 0.0,
        starts=(0.0, 0.0, 0.0),
        drive=drives,
        step=step,
        noise=step * rng.uniform(0.2, 1.0),
        period=0.004,
        rows=2500,
    )


RIGS = (pendulum, disc, axis)


def _sizes(rig: OtherRig) -> dict[str, dict[str, float]]:
    """Parameters of each effect that such a rig may hide, in proportion to its forces and motion."""
    force, speed, reach = 0.02 * rig.force, rig.speed, rig.reach
    return {
        "bias-torque": {"torque": force},
        "cogging": {"sine": force, "waves": 6.0 / reach},
        "viscous-friction": {"coefficient": force / speed},
        "quadratic-drag": {"coefficient": force / speed**2},
        "stribeck-friction": {"breakaway": force, "speed": 0.1 * speed},
        "load-dependent-friction": {"share": 0.02},
        "position-dependent-friction": {"slope": 0.7 / reach},
        "potentiometer-nonlinearity": {"bend": 0.02 / reach, "gain": 0.0},
        "backlash": {"gap": 0.02 * reach},
        "zero-drift": {"rate": 0.02 * reach / (rig.rows * rig.period)},
        "detent": {"depth": force, "at": 0.4 * reach, "width": 0.15 * reach},
        "one-way-friction": {"level": force},
        "wiper-ripple": {"size": 0.01 * reach, "waves": 9.0 / reach},
    }


HIDDEN = tuple(name for name in _sizes(axis(np.random.default_rng(0))) if name in EFFECTS)
HIDDEN_OUTSIDE = ("detent", "one-way-friction", "wiper-ripple")


def hidden_effect(name: str, rig: OtherRig, factor: float) -> Effect:
    """An effect in proportion to the rig, `factor` times its usual size."""
    sizes = _sizes(rig)[name]
    first = next(iter(sizes))
    kind: Any = EFFECTS.get(name) or OUTSIDE[name]
    return kind(**sizes | {first: factor * sizes[first]})


class _Carried:
    """What pulls at the coordinate, as the rotor sees a side."""

    def __init__(self, pull: Callable[[float], float]) -> None:
        self.torque, self.element = pull, self

    def advance(self, step: float) -> None:
        """Nothing in it relaxes."""

    def rewind(self, fraction: float) -> None:
        """Nothing in it relaxes."""


def other_runs(
    rig: OtherRig, effects: Sequence[Effect], rng: np.random.Generator
) -> dict[str, tuple[str, str]]:
    """Text of log and metadata of every run, by name."""
    found, time = {}, rig.period * np.arange(rig.rows)
    head = HEAD.format(unit=rig.unit)
    for number, start in enumerate(rig.starts):
        known = np.zeros(rig.rows) if rig.drive is None else rig.drive[number]
        q = _moved(rig, effects, start, known)
        for effect in effects:
            q = np.array([*map(effect.view(), q, time)])
        noisy = q + rig.noise * rng.standard_normal(q.size)
        shown = rig.step * np.round(noisy / rig.step)
        columns = [time, shown, *([] if rig.drive is None else [known])]
        names = "time_s,shown" + ("" if rig.drive is None else ",force_n")
        lines = [",".join(f"{x:.9g}" for x in row) for row in zip(*columns, strict=True)]
        name = HELD if number == len(rig.starts) - 1 else f"run-{number + 1}"
        found[name] = "\n".join([names, *lines, ""]), head + rig.metadata
    return found


def _moved(
    rig: OtherRig, effects: Sequence[Effect], start: float, known: Float[np.ndarray, " row"]
) -> Float[np.ndarray, " row"]:
    rotor = Rotor(
        [_Carried(rig.pull)],  # type: ignore[list-item]
        inertia=rig.inertia,
        dry_friction=rig.dry,
        viscous_friction=0.0,
        disc_radius=1.0,
        stops=(-inf, inf),
        slip_step=2e-4,
        extra_torques=[e.extra_torque for e in effects if e.overrides("extra_torque")],
        friction_laws=[e.dry_friction for e in effects if e.overrides("dry_friction")],
    )
    rotor.angle, path = start, []
    for force in known:
        path.append(rotor.angle)
        rotor.load_torque = float(force)
        rotor.advance(rig.period)
    return np.array(path)
