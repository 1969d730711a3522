"""Where a run stands in its stages, and what ends it early: pure, driven by what is measured."""

from collections.abc import Iterator
from math import log
from typing import Final

from muscle_bayes.bench.boards.samples import TimedSample
from muscle_bayes.bench.sequences.sequence import Repeat, RunPlan, Stage, Stop
from muscle_bayes.data import Sensor
from muscle_bayes.errors import MuscleBayesError

_HEATING: Final = (14.0, 0.25)
"""Rough s, and s per C, that a rise takes until it is stable."""
_COOLING: Final = 48.0
"""Rough time constant of a fall, s."""


class Course:
    """Stages one after the other; `repeat` blocks end early where their motion repeats.

    A stage that asks for a load waits for `confirm`; its time counts from there.
    """

    def __init__(self, plan: RunPlan, *, stage_timeout: float) -> None:
        self.stage: Stage | None = None
        """the one in progress, None before the first and after the last"""
        self.number = 0
        """of the stage, counted from 1 over all passes"""
        self.load = plan.load
        """kg that hang"""
        self.waiting = False
        """whether the operator was asked and has not answered"""
        self.logging = False
        """whether rows are written"""
        self._timeout = stage_timeout
        self._plan = plan
        self._stages = self._walk()
        self._start = 0.0
        self._stable_since: float | None = None
        self._last_readings: list[float] = []
        self._ahead = [s for block in plan.stage for s in _unrolled(block)]

    @property
    def total(self) -> int:
        """Stages, repeats counted, those that were left out not."""
        return len(self._ahead)

    @property
    def question(self) -> str:
        """What the operator is asked, empty if nothing."""
        stage = self.stage
        if not self.waiting or stage is None or stage.load is None:
            return ""
        mass = f"{1000 * stage.load:g} g"
        if stage.pour_time > 0:
            return f"Press a key as you begin to pour, over {stage.pour_time:g} s, up to {mass}"
        return f"Hang {mass} and press a key as it hangs"

    def advance(self, now: float) -> Stage | None:
        """Begin the next stage at a time [s] and return it, None at the end."""
        self.stage = next(self._stages, None)
        if self.stage is None:
            return None
        self.number += 1
        self.logging = self.logging or self.stage.logged
        self.restart(now)
        self.waiting = self.stage.load is not None and self.stage.load != self.load
        return self.stage

    def restart(self, now: float) -> None:
        """Count the stage's time anew, as after a time without control."""
        self._start = now
        self._stable_since = None

    def confirm(self, now: float) -> Stage:
        """The operator's key: the load hangs, or begins to be poured. Returns the stage."""
        assert self.stage is not None
        assert self.stage.load is not None
        self.waiting, self.load = False, self.stage.load
        self.restart(now)
        return self.stage

    def is_over(self, now: float, stable: bool, reading: float) -> bool:
        """Whether the stage ends now; `stable`: every heated channel is; `reading` in counts.

        Raises MuscleBayesError where a stage does not become stable in time.
        """
        stage = self.stage
        assert stage is not None
        if self.waiting:
            return False
        if stage.duration is not None:
            over = now - self._start >= stage.duration
        else:
            if stable and self._stable_since is None:
                self._stable_since = now
            since = self._stable_since
            over = since is not None and now - since >= stage.wait
            if since is None and now - self._start > self._timeout:
                raise MuscleBayesError(
                    f"stage {self.number} ({describe(stage)}) was not stable after "
                    f"{self._timeout:g} s. Fix: check the heater and the thermocouple, choose a "
                    "setpoint that heater and room allow, or raise limits.stage_timeout."
                )
        if over:
            self._last_readings.append(reading)
        return over

    def time_to_go(self, now: float, temperature: float) -> float:
        """Rough s until the end, from a temperature [C] at a time [s]."""
        left = 0.0
        for place, stage in enumerate(self._ahead[max(self.number - 1, 0) :]):
            aim = stage.setpoint_a if stage.setpoint_a is not None else stage.setpoint_b
            if stage.duration is not None:
                needed = stage.duration
            else:
                assert aim is not None
                needed = _settling(aim - temperature) + stage.wait
            if place == 0 and stage.duration is not None and not self.waiting:
                needed = max(needed - (now - self._start), 0.0)
            left += needed
            temperature = aim if aim is not None else temperature
        return left

    def _walk(self) -> Iterator[Stage]:
        for block in self._plan.stage:
            if isinstance(block, Repeat):
                yield from self._pass_through(block)
            else:
                yield block

    def _pass_through(self, block: Repeat) -> Iterator[Stage]:
        before: list[float] | None = None
        for left in reversed(range(block.repeat)):
            self._last_readings = []
            yield from block.stages
            now = self._last_readings
            if before is not None and block.until_within is not None:
                apart = max(abs(a - b) for a, b in zip(before, now, strict=True))
                if apart <= block.until_within:
                    skipped = left * len(block.stages)
                    del self._ahead[self.number : self.number + skipped]
                    return
            before = now


def describe(stage: Stage) -> str:
    """A stage in few words."""
    aims = [
        f"{side.upper()} {at:g} C"
        for side in ("a", "b")
        if (at := getattr(stage, f"setpoint_{side}")) is not None
    ]
    end = "until stable" if stage.duration is None else f"for {stage.duration:g} s"
    return f"{' and '.join(aims) or 'heaters off'} {end}"


def _unrolled(block: Stage | Repeat) -> tuple[Stage, ...]:
    return block.stages * block.repeat if isinstance(block, Repeat) else (block,)


def _settling(change: float) -> float:
    first, per_degree = _HEATING
    return first + (per_degree * change if change >= 0 else _COOLING * log(1 - change))


REST_BAND = 2
"""Counts within which a rotor at rest may be read."""


class StopWatch:
    """Follows the samples of a run and tells when a condition holds."""

    def __init__(self, stop: Stop, sensor: Sensor) -> None:
        self._stop = stop
        self._sensor = sensor
        self._low = self._high = 0.0
        self._since: float | None = None

    def reason(self, sample: TimedSample, run_time: float) -> str:
        """Why the run ends at a sample, s after its first row; empty if it goes on."""
        stop = self._stop
        rest = self._rest(sample)
        if stop.duration is not None and run_time >= stop.duration:
            return f"{stop.duration:g} s are over"
        if stop.rest_time is not None and rest >= stop.rest_time:
            return f"at rest for {stop.rest_time:g} s"
        if stop.angle is not None:
            angle = float(self._sensor.coordinate(sample.reading))
            if not stop.angle[0] <= angle <= stop.angle[1]:
                return f"the angle, {angle:.3f} rad, is beyond {list(stop.angle)} rad"
        return ""

    def _rest(self, sample: TimedSample) -> float:
        """s for which no reading has left the band."""
        low, high = min(self._low, sample.reading), max(self._high, sample.reading)
        if self._since is None or high - low > REST_BAND:
            low = high = sample.reading
            self._since = sample.time
        self._low, self._high = low, high
        return sample.time - self._since
