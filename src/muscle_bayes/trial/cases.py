"""What a trial hides: rigs, effects, strengths and noise, all from one seed."""

from dataclasses import dataclass, fields, replace
from itertools import combinations
from typing import Any, Literal

import numpy as np

from muscle_bayes.trial.outside import OUTSIDE
from muscle_bayes.twin import EFFECTS, Effect, Rig, SimulatedRun, random_rig, simulate, spring_rig
from muscle_bayes.twin.protocols import Protocol, sawtooth, spring, staircase
from muscle_bayes.twin.swings import spring_masses

Kind = Literal["single", "none", "outside", "pair"]
KINDS: tuple[Kind, ...] = ("single", "none", "outside", "pair")
STRENGTHS = (0.5, 2.0)
"""Range of the factor, log-uniform, on each hidden effect's size."""
HELD_OUT = "staircase-166g"
LOADS = (0.139, 0.166, 0.212)
"""kg"""
SPRINGS = 3
CYCLES, HELD_OUT_CYCLES = 1, 3
"""Of slow runs, at each load. One is a third and a half of the thesis', for a trial of many cases;
the held-out run needs a first part that tells its own start."""
LOG_PERIOD = 0.1
SIZES = {
    "coil-contact": "stiffness",
    "damper-law": "activation_temperature",
    "slack": "span",
    "stribeck-friction": "breakaway",
    "second-relaxation": "compliance",
    "first-cycle-set": "gain",
    "modulus-temperature": "softening",
    "hysteresis-yield": "force",
    "partial-heating": "unheated",
    "thermal-lag": "time_constant",
    "clock-offset": "delay",
    "bias-torque": "torque",
    "viscous-friction": "coefficient",
    "quadratic-drag": "coefficient",
    "detent": "depth",
    "one-way-friction": "level",
}
"""The parameter that is an effect's strength; `size`, or the first, where none is named."""


@dataclass(frozen=True)
class Case:
    """One data set of a trial."""

    kind: Kind
    hidden: tuple[str, ...]
    seed: int

    @property
    def name(self) -> str:
        """As in file names."""
        return f"{self.kind}-{'+'.join(self.hidden) or 'nothing'}-{self.seed}"


def cases(kind: Kind, count: int, seed: int) -> list[Case]:
    """`count` cases of a kind: every effect, or pair, about as often as any other."""
    rng = np.random.default_rng((seed, KINDS.index(kind)))
    hidden: dict[Kind, list[tuple[str, ...]]] = {
        "none": [()],
        "single": [(name,) for name in EFFECTS],
        "outside": [(name,) for name in OUTSIDE],
        "pair": list(combinations(EFFECTS, 2)),
    }
    choices = hidden[kind]
    order = list(rng.permutation(len(choices)))
    picked = [choices[order[index % len(choices)]] for index in range(count)]
    return [Case(kind, hidden, 1000 * seed + index) for index, hidden in enumerate(picked)]


def _effect(name: str, rng: np.random.Generator) -> Effect:
    kind = EFFECTS.get(name) or OUTSIDE[name]
    parameters: dict[str, Any] = {field.name: field.default for field in fields(kind)}
    chosen = SIZES.get(name, "size" if "size" in parameters else next(iter(parameters)))
    factor = float(np.exp(rng.uniform(*np.log(STRENGTHS))))
    return kind(**{chosen: factor * float(parameters[chosen])})


def _protocols(rig: Rig, room: float) -> list[tuple[str, Rig, Protocol]]:
    swinging = spring_rig(rig)
    springs = [
        (f"spring-{number}", swinging, spring(mass))
        for number, mass in enumerate(spring_masses(swinging)[:SPRINGS], 1)
    ]
    slow = []
    for load in LOADS:
        name = f"staircase-{1000 * load:.0f}g"
        cycles = HELD_OUT_CYCLES if name == HELD_OUT else CYCLES
        slow.append((name, staircase(load, room=room, cycles=cycles)))
    slow.append(("sawtooth", sawtooth(LOADS, room=room, cycles=CYCLES)))
    logged = [(name, rig, replace(one, log_period=LOG_PERIOD)) for name, one in slow]
    return springs + logged


def data_set(case: Case) -> dict[str, SimulatedRun]:
    """The case's runs: a rig of random geometry and truth, its effects hidden in random strength."""
    rng = np.random.default_rng((case.seed, KINDS.index(case.kind), 7))
    rig = random_rig(rng)
    effects = tuple(_effect(name, rng) for name in case.hidden)
    noise = float(np.exp(rng.uniform(np.log(0.25), np.log(0.8))))
    rig = replace(
        rig,
        truth=replace(rig.truth, effects=effects),
        potentiometer=replace(rig.potentiometer, count_noise=noise),
    )
    seed = int(rng.integers(2**31))
    return {
        name: simulate(one, protocol, (seed, number))
        for number, (name, one, protocol) in enumerate(
            _protocols(rig, rig.fixture.room_temperature)
        )
    }
