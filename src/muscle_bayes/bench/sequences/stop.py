"""Conditions that end a run early and well."""

from muscle_bayes.bench.boards.samples import TimedSample
from muscle_bayes.bench.sequences.sequence import Stop
from muscle_bayes.data import Sensor

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
