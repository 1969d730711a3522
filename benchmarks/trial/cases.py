"""What a trial hides: rigs, effects, strengths and noise, all from one seed."""

from dataclasses import dataclass, fields, replace
from itertools import combinations
from pathlib import Path
from typing import Any, Literal

import numpy as np

from benchmarks.trial.other_rigs import (
    HELD,
    HIDDEN,
    HIDDEN_OUTSIDE,
    RIGS,
    hidden_effect,
    other_runs,
)
from benchmarks.trial.outside import OUTSIDE
from benchmarks.trial.random_rigs import random_rig
from muscle_bayes.data.writer import write_run
from muscle_bayes.twin import EFFECTS, Effect, Rig, SimulatedRun, simulate, spring_rig
from muscle_bayes.twin.plant.swings import spring_masses
from muscle_bayes.twin.protocols import Protocol, sawtooth, spring, staircase

Kind = Literal["single", "none", "outside", "pair"]
KINDS: tuple[Kind, ...] = ("single", "none", "outside", "pair")
RigName = Literal["thesis", "other"]
RIG_NAMES: tuple[RigName, ...] = ("thesis", "other")
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
    "position-dependent-friction": "slope",
    "force-scale": "error",
}
"""The parameter that is an effect's strength; `size`, or the first, where none is named."""


@dataclass(frozen=True)
class Case:
    """One data set of a trial."""

    kind: Kind
    hidden: tuple[str, ...]
    seed: int
    rig: RigName

    @property
    def name(self) -> str:
        """As in file names."""
        return f"{self.kind}-{'+'.join(self.hidden) or 'nothing'}-{self.rig}-{self.seed}"

    @property
    def held_out(self) -> str:
        """Name of the run that is held out."""
        return HELD_OUT if self.rig == "thesis" else HELD


def cases(kind: Kind, count: int, seed: int) -> list[Case]:
    """`count` cases of a kind, on the thesis' rig and on others in turn.

    On each every effect, or pair, that it could have is hidden about as often as any other.
    """
    hidden: dict[RigName, tuple[tuple[str, ...], tuple[str, ...]]] = {
        "thesis": (tuple(EFFECTS), tuple(OUTSIDE)),
        "other": (HIDDEN, HIDDEN_OUTSIDE),
    }
    found = []
    for place, rig in enumerate(RIG_NAMES):
        inside, outside = hidden[rig]
        every: dict[Kind, list[tuple[str, ...]]] = {
            "none": [()],
            "single": [(name,) for name in inside],
            "outside": [(name,) for name in outside],
            "pair": list(combinations(inside, 2)),
        }
        choices = every[kind]
        order = np.random.default_rng((seed, KINDS.index(kind), place)).permutation(len(choices))
        for index in range(place, count, len(RIG_NAMES)):
            chosen = choices[order[index // len(RIG_NAMES) % len(choices)]]
            found.append(Case(kind, chosen, 1000 * seed + index, rig))
    return sorted(found, key=lambda case: case.seed)


def _factor(rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(*np.log(STRENGTHS))))


def _effect(name: str, rng: np.random.Generator) -> Effect:
    kind = EFFECTS.get(name) or OUTSIDE[name]
    parameters: dict[str, Any] = {field.name: field.default for field in fields(kind)}
    chosen = SIZES.get(name, "size" if "size" in parameters else next(iter(parameters)))
    return kind(**{chosen: _factor(rng) * float(parameters[chosen])})


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


def write_runs(case: Case, folder: Path) -> None:
    """The case's runs as files: a random rig, its effects hidden in random strength."""
    if case.rig == "thesis":
        for name, run in thesis_runs(case).items():
            write_run(folder, name, run.log, run.metadata)
        return
    rng = _random(case)
    other = RIGS[int(rng.integers(len(RIGS)))](rng)
    effects = [hidden_effect(name, other, _factor(rng)) for name in case.hidden]
    for name, (log, metadata) in other_runs(other, effects, rng).items():
        (folder / f"{name}.csv").write_text(log, encoding="utf-8")
        (folder / f"{name}.toml").write_text(metadata, encoding="utf-8")


def _random(case: Case) -> np.random.Generator:
    return np.random.default_rng((case.seed, KINDS.index(case.kind), 7))


def thesis_runs(case: Case) -> dict[str, SimulatedRun]:
    """The runs of a case on the thesis' rig, by name."""
    rng = _random(case)
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
