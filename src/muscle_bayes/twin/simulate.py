"""From a rig, a protocol and a seed to a run: log, metadata and the truth behind it."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from muscle_bayes.data import HEADER, Metadata
from muscle_bayes.twin.bench import Bench
from muscle_bayes.twin.metadata import describe
from muscle_bayes.twin.plant.rig import Rig
from muscle_bayes.twin.protocols import Protocol
from muscle_bayes.twin.recording import Recording
from muscle_bayes.twin.sensors import AngleSensor, RowClock, ThermocoupleMeter

Seed = int | tuple[int, ...]
"""A seed, or the seed of a set followed by the number of the run."""

_PURPOSES = ("zero", "potentiometer", "meter", "clock")


class SimulatedRun(NamedTuple):
    """A run as an experimenter would get it, and what nobody would know.

    truth["run"] holds for this run alone, the other tables for every run of the rig.
    """

    log: pd.DataFrame
    metadata: Metadata
    truth: dict[str, Any]


def generators(seed: Seed) -> dict[str, np.random.Generator]:
    """Independent random streams, one per purpose."""
    first, *path = (seed,) if isinstance(seed, int) else seed
    return {
        purpose: np.random.Generator(
            np.random.PCG64(np.random.SeedSequence(first, spawn_key=(*path, number)))
        )
        for number, purpose in enumerate(_PURPOSES)
    }


def record(
    rig: Rig,
    protocol: Protocol,
    seed: Seed,
    progress: Callable[[float], None] | None = None,
) -> tuple[Recording, float]:
    """Simulate; returns the recording with its hidden trace, and the true zero reading [counts]."""
    streams = generators(seed)
    spread = rig.potentiometer.zero_spread
    zero = rig.potentiometer.zero_reading + float(streams["zero"].uniform(-spread, spread))
    bench = Bench(rig, load=protocol.load, hyst=protocol.initial_hyst)
    bench.place(protocol.initial_angle)
    recording = Recording(
        bench,
        protocol,
        ThermocoupleMeter(rig.meter, streams["meter"]),
        AngleSensor(rig.potentiometer, zero, streams["potentiometer"], rig.truth.effects),
        RowClock(rig.logger, protocol.log_period, streams["clock"]),
        progress,
        delay=sum(effect.temperature_delay() for effect in rig.truth.effects),
    )
    recording.run()
    return recording, zero


def simulate(
    rig: Rig,
    protocol: Protocol,
    seed: Seed,
    progress: Callable[[float], None] | None = None,
) -> SimulatedRun:
    """A synthetic run. Equal arguments give equal runs; `progress` hears the share that is done."""
    recording, zero = record(rig, protocol, seed, progress)
    log = pd.DataFrame(recording.rows, columns=list(HEADER))
    end = recording.rows[-1][0]
    metadata = describe(rig, protocol, recording.loads.table_until(end))
    return SimulatedRun(log, metadata, {"run": _start(recording, zero), **truth_of(rig)})


def _start(recording: Recording, zero: float) -> dict[str, float]:
    """What is true of one run only: its sensor's zero [counts] and its state at the first row."""
    first = recording.trace[0]
    start = {"zero_reading": zero, "initial_angle": first.angle}
    for side, muscle, hyst in zip("ab", recording.bench.muscles, first.hyst, strict=True):
        if muscle is not None:
            start[f"initial_hyst_{side}"] = hyst
    return start


def truth_of(rig: Rig) -> dict[str, Any]:
    """True parameters as nested tables: only of what the rig holds."""
    truth = rig.truth
    tables: dict[str, Any] = {
        "rotor": {"friction_law": truth.friction_law, "J": truth.J, "D": truth.D}
    }
    for side, element, muscle in (
        ("a", rig.element_a, truth.muscle_a),
        ("b", rig.element_b, truth.muscle_b),
    ):
        if element.kind == "muscle":
            tables[f"muscle_{side}"] = asdict(muscle)
    if truth.effects:
        tables["effects"] = {effect.name: asdict(effect) for effect in truth.effects}
    return tables
