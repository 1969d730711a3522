"""Sampling over a long time: are samples lost, how even are they, how late do they arrive?"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from muscle_bayes.bench.board import Board
from muscle_bayes.bench.protocol import ChecksumReport, Garbled, Sample
from muscle_bayes.bench.simulation.bench import STEP, SimulatedBench
from muscle_bayes.bench.simulation.processor import FREQUENCY, Processor
from muscle_bayes.bench.trials.host import HeatingHost

PERIOD_MS: Final = 30
"""33 Hz."""
_WRAP = 2**32
_TIMSK1 = 0x6F


@dataclass(frozen=True)
class StreamReport:
    """Figures of a streamed recording."""

    duration: float
    """virtual s"""
    samples: int
    lost: int
    """numbers that are missing, and garbled lines"""
    rate: float
    """Hz, by the board's clock"""
    jitter: float
    """largest departure of a sampling interval from its period, by the board's clock, s"""
    latency_median: float
    """s from the sample to its arrival at the host; the simulation's step is 1 ms"""
    latency_99: float
    latency_most: float


def stream(
    duration: float, seed: int = 0, progress: Callable[[float], None] = lambda share: None
) -> StreamReport:
    """Record the angle at 33 Hz for that long [virtual s] while both heaters are controlled."""
    samples: list[tuple[float, Sample]] = []
    garbled = 0
    with SimulatedBench(seed=seed) as bench:
        origin = _clock_start()
        board = Board(bench.sensor_board, bench.clock, "sensor board")

        def collect(_: int) -> None:
            nonlocal garbled
            for message in board.poll():
                if isinstance(message, Sample):
                    samples.append((bench.clock.now(), message))
                garbled += isinstance(message, Garbled | ChecksumReport)

        board.identify()
        board.stream(PERIOD_MS)
        start = bench.clock.now()
        bench.listeners.append(collect)
        host = HeatingHost(bench, (60.0, 45.0), lambda now: progress((now - start) / duration))
        host.run(duration)
    return _report(samples, garbled, duration, origin)


def _report(
    samples: list[tuple[float, Sample]], garbled: int, duration: float, origin: float
) -> StreamReport:
    numbers = np.array([sample.number for _, sample in samples])
    micros = np.array([sample.micros for _, sample in samples])
    arrivals = np.array([arrival for arrival, _ in samples])
    steps = np.diff(numbers) % 65536
    passed = np.diff(micros) % _WRAP / 1e6
    taken = micros[0] / 1e6 + np.concatenate([[0.0], np.cumsum(passed)]) + origin
    latency = arrivals - taken
    return StreamReport(
        duration=duration,
        samples=len(samples),
        lost=int(np.sum(steps - 1)) + garbled,
        rate=(len(samples) - 1) / (taken[-1] - taken[0]),
        jitter=float(np.max(np.abs(passed / steps - PERIOD_MS / 1000))),
        latency_median=float(np.median(latency)),
        latency_99=float(np.quantile(latency, 0.99)),
        latency_most=float(np.max(latency)),
    )


def _clock_start() -> float:
    """When a sensor board's clock starts after power-on [s]: the firmware is deterministic."""
    with Processor(heater=False) as processor:
        cycles = 0
        while processor.peek(_TIMSK1) == 0 and cycles < FREQUENCY:
            processor.run_cycles(160)
            cycles += 160
        return cycles / FREQUENCY


def expected_samples(duration: float) -> int:
    """Fewest samples that so long a time [s] must give."""
    return int((duration - STEP) / (PERIOD_MS / 1000))
