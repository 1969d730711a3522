"""The failures again, with the recorder itself as the host that lives through them."""

from contextlib import suppress

import numpy as np
import pytest

from benchmarks.bench_test.failures import ALLOWED, FAILURES, Incident
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sequences.sequence import Limits, Sequence, Stage
from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant
from muscle_bayes.bench.simulation.recording import (
    SimulatedOperator,
    rig_tables,
    simulated_devices,
)
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.plant.rig import Rig

pytestmark = pytest.mark.usefixtures("firmware")

# After these the recorder rightly heats on: the line is back, or the board has only been reset.
RECOVERED = ("cable pulled and plugged in", "power-on reset", "external reset")
LIVING = [f for f in FAILURES if f.host_lives and f.name not in RECOVERED]
SEQUENCE = Sequence(
    name="run",
    load=0.1,
    limits=Limits(reconnect_time=3.0),
    stage=(Stage(setpoint_a=90.0, setpoint_b=80.0, duration=60.0),),
)


class Over(BaseException):
    """Ends the recording from inside its clock."""


def record_until_struck(failure, seed, folder):
    """Seconds for which a heater stayed on after a failure had struck."""
    random = np.random.default_rng([seed, *failure.name.encode()])
    with SimulatedBench(TwinPlant(load=0.1), seed=seed) as bench:
        session = Session(
            SEQUENCE, folder / "sequence.toml", folder, simulated_devices(bench),
            SimulatedOperator(bench, 0.1), origin="synthetic", rig=rig_tables(Rig()), load=0.1,
        )  # fmt: skip
        earliest = int(random.integers(2500, 4500))
        struck = None
        on = []

        def watch(now):
            nonlocal struck
            if struck is None:
                # Heat waits for the meter now and then; a failure without heat shows nothing.
                if now >= earliest and any(bench.heater.duties):
                    struck = now
                    failure.strike(Incident(bench, random))
                return
            if any(bench.heater.peaks()):
                on.append(now)
            if now >= struck + 2500:
                raise Over

        bench.listeners.append(watch)
        session.devices.open()
        with suppress(Over, MuscleBayesError):
            list(session.record())
        bench.listeners.remove(watch)
        assert struck is not None
        return (on[-1] - struck) / 1000 if on else 0.0


@pytest.mark.parametrize("failure", LIVING, ids=lambda failure: failure.name)
def test_the_recorder_leaves_no_heater_on_after(failure, tmp_path):
    for seed in range(3):
        folder = tmp_path / str(seed)
        folder.mkdir()
        assert record_until_struck(failure, seed, folder) <= ALLOWED


def test_most_kinds_are_tried_on_the_recorder():
    assert len(LIVING) >= 10
    assert set(RECOVERED) < {failure.name for failure in FAILURES}
