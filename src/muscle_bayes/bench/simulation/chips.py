"""What thermometers, load cell and encoder put on a simulated board's pins."""

from collections.abc import Callable
from math import exp
from typing import Final

import numpy as np

from muscle_bayes.bench.sensors.catalogue import Wiring
from muscle_bayes.bench.simulation.processor import Processor
from muscle_bayes.twin.sensors import normals

NOISE: Final = 0.05
"""Of a thermometer, C."""
CONVERSION: Final = {1: 0.1, 2: 0.19, 3: 0.008}
"""s that a thermometer of a kind takes; it shows the mean temperature of that time."""
STARTED_BY_READING: Final = 2
"""Kind whose next conversion begins when it has been read (MAX6675); others convert on and on."""
CHIP_ROOM: Final = 26.0
"""Temperature of a chip itself, C."""
COUNTER_MIDDLE: Final = 0x8000
"""What an encoder's counter begins with."""
ENCODER_SCALE: Final = 2 * np.pi / 2400
"""rad a count: 600 lines, four edges each."""
LOAD_ZERO: Final = 84_000
LOAD_SCALE: Final = 2.5e-6
"""kg a count."""
LOAD_NOISE: Final = 60.0
"""counts"""
_TOP: Final = 1023


def max31855_word(temperature: float | None) -> int:
    """32 bits for a thermocouple [C, None = open]."""
    own = (round(CHIP_ROOM / 0.0625) & 0xFFF) << 4
    if temperature is None:
        return own | 1 << 16 | 1
    return (round(temperature / 0.25) & 0x3FFF) << 18 | own


def max6675_word(temperature: float | None) -> int:
    """16 bits for a thermocouple [C, None = open]; it knows nothing below 0 C."""
    if temperature is None:
        return 4
    return min(max(round(temperature / 0.25), 0), 0xFFF) << 3


def thermistor_counts(temperature: float | None, beta: float, ratio: float) -> float:
    """What the converter sees of a thermistor to GND [C, None = torn], its series resistor to 5 V."""
    if temperature is None:
        return float(_TOP)
    resistance = exp(beta * (1 / (temperature + 273.15) - 1 / 298.15)) / ratio
    return _TOP * resistance / (1 + resistance)


def load_word(mass: float, noise: float = 0.0) -> int:
    """24 bits of an HX711 under a load [kg] and a noise [counts]."""
    return round(LOAD_ZERO + mass / LOAD_SCALE + noise) & 0xFFFFFF


class BoardThermometers:
    """Both channels' thermometers on the heater board's pins, with a meter's faults.

    `silent`: the chips are gone; `frozen`: they repeat what they showed; `open_channels` are torn;
    `forced` [C] stands for the true temperatures; `shows` makes what is measured from time [s] and
    true temperatures [C]; `garbled` puts random words on the line.
    """

    def __init__(self, board: Processor, wiring: Wiring, generator: np.random.Generator) -> None:
        self.silent = self.frozen = self.garbled = False
        self.open_channels = (False, False)
        self.forced: tuple[float | None, float | None] = (None, None)
        self.shows: Callable[[float, tuple[float, float]], tuple[float, float]] | None = None
        self._board = board
        self._wiring = wiring
        self._kinds = (wiring.thermometer_a, wiring.thermometer_b)
        self._generator = generator
        self._noise = normals(generator)
        self._begun: list[float | None] = [-1.0, -1.0]
        """when the conversion under way began, s; the first ends as time begins"""
        self._sums = [0.0, 0.0]
        self._steps = [0, 0]
        self._reads = [0, 0]

    def step(self, time: float, temperatures: tuple[float, float]) -> None:
        """Let time go to `time` [s] with these true temperatures [C]."""
        if self.frozen and not self.silent:
            return
        if self.shows is not None:
            temperatures = self.shows(time, temperatures)
        for channel, kind in enumerate(self._kinds):
            if kind:
                self._follow(channel, kind, time, temperatures[channel])

    def _follow(self, channel: int, kind: int, time: float, true: float) -> None:
        if kind == STARTED_BY_READING:
            reads = self._board.chip_reads(channel)
            if reads != self._reads[channel]:
                self._reads[channel] = reads
                self._begin(channel, time)
        begun = self._begun[channel]
        if begun is None:
            return
        self._sums[channel] += true
        self._steps[channel] += 1
        if time - begun < CONVERSION[kind] and not (kind == 3 and self.garbled):
            return
        self._convert(channel, kind, self._sums[channel] / self._steps[channel])
        self._begin(channel, None if kind == STARTED_BY_READING else time)

    def _begin(self, channel: int, time: float | None) -> None:
        self._begun[channel] = time
        self._sums[channel], self._steps[channel] = 0.0, 0

    def _convert(self, channel: int, kind: int, true: float) -> None:
        forced = self.forced[channel]
        measured = true + NOISE * next(self._noise) if forced is None else forced
        shown = None if self.open_channels[channel] else measured
        if kind == 3:
            wiring = self._wiring
            counts = thermistor_counts(shown, wiring.beta, wiring.ratio / 1000)
            if self.garbled:  # a pin that floats
                counts = float(self._generator.uniform(0, _TOP))
            self._board.set_analog(_TOP if self.silent else counts, 2 + channel)
            return
        bits, word = (32, max31855_word(shown)) if kind == 1 else (16, max6675_word(shown))
        if self.garbled:
            word = int(self._generator.integers(1 << bits))
        self._board.set_chip(channel, word, 0 if self.silent else bits)


class SensorChips:
    """Encoder, second potentiometer and load cell on the sensor board's pins."""

    def __init__(self, board: Processor, wiring: Wiring, generator: np.random.Generator) -> None:
        self.load_cell_gone = False
        self._board = board
        self._wiring = wiring
        self._noise = normals(generator)
        self._start: float | None = None

    def step(self, angle: float, load: float, second: int) -> None:
        """What the rotor's angle [rad], the hanging mass [kg] and the other potentiometer show."""
        wiring = self._wiring
        if wiring.angle:
            if self._start is None:
                self._start = angle
            self._board.turn_encoder(round((angle - self._start) / ENCODER_SCALE))
        if wiring.second:
            self._board.set_analog(second, 1)
        if wiring.load:
            word = load_word(load, LOAD_NOISE * next(self._noise))
            self._board.set_load_cell(None if self.load_cell_gone else word)
