"""A run in progress: stages, controllers, loads and log rows on one clock."""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.bench import Bench
from muscle_bayes.twin.controller import PERIOD
from muscle_bayes.twin.plant.loads import LoadSchedule
from muscle_bayes.twin.protocols import Protocol, Stage
from muscle_bayes.twin.sensors import AngleSensor, RowClock, ThermocoupleMeter, Update

Row = tuple[float, float, float, int, float, float, int, int, int]
"""Values of the log's columns, in their order."""

STAGE_LIMIT = 3600.0
"""A stage that takes longer than this cannot reach its setpoint, s."""


class Hidden(NamedTuple):
    """True state at a row: s after the first row, rad, sigma_hyst of A and B, C, kg."""

    time: float
    angle: float
    velocity: float
    slipping: bool
    hyst: tuple[float, float]
    temperature: tuple[float, float]
    load: float


@dataclass
class Recording:
    """Runs a protocol on a bench; `rows` is the log, `trace` the hidden state at each row.

    `progress` hears the share of stages done; temperatures are logged late by `delay` [s].
    """

    bench: Bench
    protocol: Protocol
    meter: ThermocoupleMeter
    sensor: AngleSensor
    clock: RowClock
    progress: Callable[[float], None] | None = None
    delay: float = 0.0

    def __post_init__(self) -> None:
        self.loads = LoadSchedule(self.protocol.load)
        self.rows: list[Row] = []
        self.trace: list[Hidden] = []
        self._origin: float | None = None
        self._next_row = float("inf")
        self._row_time = 0.0
        """Time of the row to come, s after the first."""
        self._rest = 0.0

    def run(self) -> None:
        """Work through all stages."""
        tick = 0
        for number, stage in enumerate(self.protocol.stages):
            tick = self._run_stage(stage, tick)
            if self.progress is not None:
                self.progress((number + 1) / len(self.protocol.stages))
        if self._origin is None:
            raise MuscleBayesError("no stage of this protocol is logged")
        if self.delay != 0.0:
            self.rows = _logged_late(self.rows, self.meter.history, self._origin, self.delay)

    def _run_stage(self, stage: Stage, tick: int) -> int:
        start = tick * PERIOD
        if stage.logged and self._origin is None:
            self._start_log(start)
        if stage.load is not None:
            self.loads.change(start, stage.load, stage.pour_time)
        aims = (stage.setpoint_a, stage.setpoint_b)
        for channel, setpoint in zip(self.bench.channels, aims, strict=True):
            channel.controller.aim(setpoint)
        stable_since: float | None = None
        while True:
            time = tick * PERIOD
            self._control(time)
            if stage.duration is not None:
                if time - start >= stage.duration:
                    return tick
            elif stable_since is not None:
                if time - stable_since >= stage.wait:
                    return tick
            elif self._all_stable():
                stable_since = time
                continue
            if time - start > STAGE_LIMIT:
                raise MuscleBayesError(
                    f"setpoints {aims} C were not reached in {STAGE_LIMIT:g} s; "
                    "choose some between room temperature and what the heater can hold"
                )
            self._advance(time, (tick + 1) * PERIOD)
            tick += 1
            if self._at_rest():
                return tick

    def _all_stable(self) -> bool:
        controllers = [c.controller for c in self.bench.channels]
        return all(c.stable for c in controllers if c.setpoint is not None)

    def _control(self, time: float) -> None:
        first, second = self.bench.channels
        self.meter.poll(time, (first.tube.temperature, second.tube.temperature))
        for channel, reading in zip(self.bench.channels, self.meter.readings, strict=True):
            channel.pwm = channel.controller.update(reading, time)

    def _advance(self, time: float, end: float) -> None:
        """Advance to a time [s], stopping for the rows and load steps on the way."""
        while True:
            if self.loads.settle(time):
                self.bench.rotor.hang(self.loads.mass)
            if time >= self._next_row:
                self._write_row()
                continue
            until = min(end, self._next_row, self.loads.next_change())
            if until <= time:
                return
            self.bench.advance(until - time)
            time = until
            if time >= end:
                return

    def _start_log(self, time: float) -> None:
        self._origin = self._next_row = time
        self.loads.start_log(time)

    def _write_row(self) -> None:
        assert self._origin is not None
        at = self._row_time
        bench, rotor = self.bench, self.bench.rotor
        (a, b), (reading_a, reading_b) = bench.channels, self.meter.readings
        self.rows.append(
            (
                at,
                reading_a,
                a.controller.setpoint or 0.0,
                int(a.controller.stable),
                reading_b,
                b.controller.setpoint or 0.0,
                int(b.controller.stable),
                int(self.meter.updated),
                self.sensor.read(rotor.angle, at),
            )
        )
        hyst_a, hyst_b = (m.hyst if m is not None else 0.0 for m in bench.muscles)
        self.trace.append(
            Hidden(
                time=at,
                angle=rotor.angle,
                velocity=rotor.velocity,
                slipping=rotor.slipping,
                hyst=(hyst_a, hyst_b),
                temperature=(a.muscle_temperature, b.muscle_temperature),
                load=self.loads.mass,
            )
        )
        self.meter.updated = False
        self._row_time = self.clock.after(at)
        self._next_row = self._origin + self._row_time

    def _at_rest(self) -> bool:
        """The protocol's rest time is over."""
        if self.protocol.rest_time is None:
            return False
        self._rest = 0.0 if self.bench.rotor.slipping else self._rest + PERIOD
        return self._rest >= self.protocol.rest_time


def _logged_late(
    rows: Sequence[Row], updates: Sequence[Update], origin: float, delay: float
) -> list[Row]:
    """The rows with what the meter showed `delay` [s] before each, or after it where negative.

    `origin` is the time of the first row [s]. Before its first update the meter shows that.
    """
    times = [time for time, _ in updates]
    result, seen = [], None
    for row in rows:
        number = max(bisect_right(times, origin + row[0] - delay) - 1, 0)
        first, second = updates[number][1]
        at, _, aim_a, stable_a, _, aim_b, stable_b, _, counts = row
        fresh = int(number != seen)
        result.append((at, first, aim_a, stable_a, second, aim_b, stable_b, fresh, counts))
        seen = number
    return result
