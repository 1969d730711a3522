"""Sampling over a long time: are samples lost, how even are they, how late do they arrive?"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from benchmarks.bench_test.host import HeatingHost
from muscle_bayes.bench.boards.board import Board
from muscle_bayes.bench.boards.protocol import ChecksumReport, Garbled, Sample, encode
from muscle_bayes.bench.simulation.bench import STEP, SimulatedBench
from muscle_bayes.bench.simulation.processor import FREQUENCY

PERIOD_MS: Final = 30
"""33 Hz."""
_WRAP = 2**32
_MICROS_PER_CONVERSION = 1000
_NOBODYS = 65535
"""A sequence number that no request of the trial uses."""
_DISTURBED = 0.03
"""Chance of a command in a millisecond."""


@dataclass(frozen=True)
class StreamReport:
    """Figures of a streamed recording; times are told by the processor's cycles, not by the board."""

    duration: float
    """virtual s"""
    samples: int
    lost: int
    """numbers that are missing, and garbled lines"""
    rate: float
    """Hz"""
    jitter: float
    """largest departure of an interval between conversions from its period, s"""
    stamp_error: float
    """largest departure of a sample's stamp from its conversion, their mean left out, s"""
    latency_median: float
    """s from the conversion to the arrival at the host; the simulation's step is 1 ms"""
    latency_99: float
    latency_most: float


def stream(
    duration: float, seed: int = 0, progress: Callable[[float], None] = lambda share: None
) -> StreamReport:
    """Record the angle at 33 Hz for that long [virtual s] while both heaters are controlled.

    Commands come to the sensor board at random moments, so that it is not found asleep each time.
    """
    random = np.random.default_rng(seed)
    samples: list[tuple[float, Sample]] = []
    conversions: list[int] = []
    garbled = 0
    with SimulatedBench(seed=seed) as bench:
        board = Board(bench.sensor_board, bench.clock, "sensor board")

        def watch(_: int) -> None:
            conversions.extend(bench.sensor.conversions())
            if random.random() < _DISTURBED:
                bench.sensor_board.write(encode(_NOBODYS, "READ"))

        def collect(_: int) -> None:
            nonlocal garbled
            for message in board.poll():
                if isinstance(message, Sample):
                    samples.append((bench.clock.now(), message))
                garbled += isinstance(message, Garbled | ChecksumReport)

        bench.listeners.append(watch)
        board.identify()
        board.stream(PERIOD_MS)
        start = bench.clock.now()
        bench.listeners.append(collect)
        host = HeatingHost(bench, (60.0, 45.0), lambda now: progress((now - start) / duration))
        host.run(duration)
    return _report(samples, garbled, duration, np.array(conversions) / FREQUENCY)


def _report(
    samples: list[tuple[float, Sample]],
    garbled: int,
    duration: float,
    conversions: np.ndarray,
) -> StreamReport:
    """`conversions`: when each conversion since power-on was started, one a millisecond [s]."""
    numbers = np.array([sample.number for _, sample in samples])
    micros = np.array([sample.micros for _, sample in samples])
    arrivals = np.array([arrival for arrival, _ in samples])
    steps = np.diff(numbers) % 65536
    told = micros[0] + np.concatenate([[0], np.cumsum(np.diff(micros) % _WRAP)])
    taken = conversions[told // _MICROS_PER_CONVERSION - 1]
    offset = told / 1e6 - taken
    latency = arrivals - taken
    return StreamReport(
        duration=duration,
        samples=len(samples),
        lost=int(np.sum(steps - 1)) + garbled,
        rate=float((len(samples) - 1) / (taken[-1] - taken[0])),
        jitter=float(np.max(np.abs(np.diff(taken) / steps - PERIOD_MS / 1000))),
        stamp_error=float(np.max(np.abs(offset - np.mean(offset)))),
        latency_median=float(np.median(latency)),
        latency_99=float(np.quantile(latency, 0.99)),
        latency_most=float(np.max(latency)),
    )


def expected_samples(duration: float) -> int:
    """Fewest samples that so long a time [s] must give."""
    return int((duration - STEP) / (PERIOD_MS / 1000))
