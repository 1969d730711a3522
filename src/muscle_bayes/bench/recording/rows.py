"""Samples and temperatures -> rows of a run, with the gaps between them told."""

from collections.abc import Callable
from typing import Final

from muscle_bayes.bench.boards.board import HeaterState
from muscle_bayes.bench.boards.samples import Tell, TimedSample
from muscle_bayes.bench.heat.heating import Heating
from muscle_bayes.bench.meters.meter import Reading
from muscle_bayes.bench.recording.log_row import Row
from muscle_bayes.bench.recording.run_file import RunFile

LEAST: Final = 20
"""Changes of the meter's digits from which on their mean lag is told."""
LONGEST: Final = 0.25
"""Spacing of rows or requests, s, that leaves open when the digits changed."""


class MeterLag:
    """Mean time from a change of the meter's digits to where the log seems to have it.

    The digits change somewhere between two requests, on average halfway (taken that the meter answers
    what it shows when it is asked); the answer takes its time, and the next row may be near or far. Who
    reads the log can but put the change halfway between two rows. The lag is the distance of both
    halves.
    """

    def __init__(self) -> None:
        self._row: float | None = None
        self._reading: Reading | None = None
        self._sum = 0.0
        self._count = 0

    @property
    def mean(self) -> float | None:
        """s, None as long as too few changes were seen."""
        return self._sum / self._count if self._count >= LEAST else None

    def row(self, time: float, reading: Reading | None) -> None:
        """Take a row's host time [s] and the meter's reading in it."""
        before, shown = self._row, self._reading
        self._row, self._reading = time, reading
        if before is None or shown is None or reading is None:
            return
        if shown.asked is None or reading.asked is None:
            return
        if shown.temperatures == reading.temperatures or None in reading.temperatures:
            return
        if max(time - before, reading.asked - shown.asked) < LONGEST:
            self._sum += 0.5 * (time + before - reading.asked - shown.asked)
            self._count += 1


GAP: Final = 0.5
"""Spacing of rows that is told as a gap, s, or ten periods."""


class RowWriter:
    """Writes a row a sample as long as every temperature that the run needs is known."""

    def __init__(
        self,
        file: RunFile,
        heating: Heating,
        period: float,
        tell: Tell,
        heater: Callable[[], tuple[HeaterState | None, bool | None]] = lambda: (None, None),
        weigh: Callable[[TimedSample], float | None] = lambda sample: None,
        aim: Callable[[TimedSample], float | None] = lambda sample: None,
    ) -> None:
        """`heater` gives what the heater board said last of heat and fan, None where it did not;
        `weigh` what the load cell shows in a sample, kg, `aim` the reading that the board holds then."""
        self.origin: float | None = None
        """host time of the first row, s"""
        self.time = 0.0
        """of the newest row, s after the first"""
        self.gaps = 0
        self.longest_gap = 0.0
        self.meter_lag = MeterLag()
        self._file = file
        self._heating = heating
        self._gap = max(GAP, 10 * period)
        self._tell = tell
        self._heater = heater
        self._weigh = weigh
        self._aim = aim

    def log_time(self, now: float) -> float:
        """Host time [s] on the log's clock; 0 before the first row."""
        return 0.0 if self.origin is None else max(now - self.origin, 0.0)

    def write(self, sample: TimedSample, causes: tuple[str, ...]) -> None:
        """Write the row of a sample; `causes` go with a gap before it. Raises RunFileError."""
        heating = self._heating
        if heating.unknown:
            return
        first = self.origin is None
        if self.origin is None:
            self.origin = sample.time
        time = round(sample.time - self.origin, 3)
        if not first and time - self.time > self._gap:
            self.gaps += 1
            self.longest_gap = max(self.longest_gap, time - self.time)
            self._tell("gap", start=self.time, end=time, causes=list(causes))
        self.meter_lag.row(sample.time, heating.reading)
        a, b = heating.channels
        state, fan = self._heater()
        self._file.append(
            Row(
                time=time,
                temperature_a=a.temperature,
                setpoint_a=a.control.setpoint,
                stable_a=a.control.stable,
                temperature_b=b.temperature,
                setpoint_b=b.control.setpoint,
                stable_b=b.control.stable,
                update=heating.fresh,
                reading=sample.reading,
                duties=None if state is None else state.duties,
                faults=None if state is None else int(state.faults),
                fan=fan,
                second=sample.second,
                load=self._weigh(sample),
                aim=self._aim(sample),
            )
        )
        self.time = time
        heating.fresh = False
