"""What the host sees: thermocouple meter, potentiometer, and the times of its rows."""

from collections.abc import Iterator, Sequence

import numpy as np

from muscle_bayes.twin.effects import Effect
from muscle_bayes.twin.plant.rig import Logger, Meter, Potentiometer

_BLOCK = 1024
FULL_SCALE = 1023
"""Largest reading of a 10-bit converter."""


def normals(generator: np.random.Generator) -> Iterator[float]:
    """Endless standard normal numbers."""
    while True:
        yield from generator.standard_normal(_BLOCK).tolist()


def uniforms(generator: np.random.Generator) -> Iterator[float]:
    """Endless numbers uniform on [0, 1)."""
    while True:
        yield from generator.random(_BLOCK).tolist()


Update = tuple[float, tuple[float, float]]
"""When a meter measured [s], and what it showed from then on [C]."""


class ThermocoupleMeter:
    """Two channels, read about every 0.4 s with 0.1 C resolution, held in between."""

    def __init__(self, meter: Meter, generator: np.random.Generator) -> None:
        self._meter = meter
        self._noise = normals(generator)
        self._due = 0.0
        self.readings = (0.0, 0.0)
        self.history: list[Update] = []
        self.updated = False
        """An update came since this flag was last cleared."""

    def poll(self, time: float, temperatures: tuple[float, float]) -> None:
        """Take new readings where one is due."""
        if time < self._due:
            return
        meter = self._meter
        first, second = (
            round(round((t + meter.noise * next(self._noise)) / meter.resolution), 0)
            * meter.resolution
            for t in temperatures
        )
        self.readings = (round(first, 4), round(second, 4))
        self.history.append((time, self.readings))
        jitter = meter.period_jitter * next(self._noise)
        self._due = time + max(meter.period + jitter, 0.25 * meter.period)
        self.updated = True


class AngleSensor:
    """Potentiometer behind a 10-bit converter: noise, then rounding, then clipping to 0-1023."""

    def __init__(
        self,
        potentiometer: Potentiometer,
        zero_reading: float,
        generator: np.random.Generator,
        effects: Sequence[Effect] = (),
    ) -> None:
        self._gain = 1.0 / potentiometer.radians_per_count
        self._count_noise = potentiometer.count_noise
        self._zero = zero_reading
        self._noise = normals(generator)
        self._views = [e.view() for e in effects if e.overrides("shown") or e.overrides("view")]
        self._distortions = [e.reading for e in effects if e.overrides("reading")]

    def read(self, angle: float, time: float = 0.0) -> int:
        """Counts at an angle [rad], `time` [s] after the first row."""
        for view in self._views:
            angle = view(angle, time)
        counts = self._zero + angle * self._gain
        for distort in self._distortions:
            counts = distort(counts)
        counts = round(counts + self._count_noise * next(self._noise))
        return min(max(counts, 0), FULL_SCALE)


TIME_DECIMALS = 3
"""Row times are whole milliseconds after the first row, so that the log states them exactly."""


class RowClock:
    """Uneven row times, s after the first row."""

    def __init__(self, logger: Logger, period: float, generator: np.random.Generator) -> None:
        self._logger = logger
        self._period = period
        self._normal = normals(generator)
        self._uniform = uniforms(generator)

    def after(self, time: float) -> float:
        """Time of the row after the one at `time`."""
        logger = self._logger
        stretch = max(1.0 + logger.jitter * next(self._normal), 0.3)
        gap = self._period * stretch
        if next(self._uniform) < logger.pause_probability:
            shortest, longest = logger.pause
            gap += shortest + (longest - shortest) * next(self._uniform)
        return round(time + gap, TIME_DECIMALS)
