"""From meter to duties: two channels, each under its control and its watch."""

from dataclasses import dataclass, field
from math import inf

from muscle_bayes.bench.meter import MeterSource, Reading
from muscle_bayes.bench.sequence import Stage
from muscle_bayes.bench.temperature_control import TemperatureControl
from muscle_bayes.bench.thermometry import REMEDIES, Verdict, Watch


@dataclass
class Channel:
    """One side: what is wanted, what is measured, what is given."""

    side: str
    needed: bool
    """whether the run depends on its thermocouple"""
    control: TemperatureControl = field(default_factory=TemperatureControl)
    watch: Watch = field(default_factory=Watch)
    verdict: Verdict = Verdict.SILENT
    duty: int = 0
    """what is given, of 255; the control may want more"""

    @property
    def temperature(self) -> float | None:
        """The newest reading [C], None where it cannot be trusted."""
        return self.watch.temperature if self.verdict is Verdict.GOOD else None

    @property
    def heated(self) -> bool:
        """Whether there is a setpoint."""
        return self.control.setpoint is not None


class Heating:
    """Both channels; `step` gives the duties, (0, 0) while there is trouble or the meter is overdue."""

    def __init__(self, needed: tuple[bool, bool]) -> None:
        self.channels = (Channel("a", needed[0]), Channel("b", needed[1]))
        self.fresh = False
        """Whether a reading came since this flag was last cleared."""
        self._taken: Reading | None = None

    @property
    def reading(self) -> Reading | None:
        """The meter's newest."""
        return self._taken

    @property
    def trouble(self) -> str | None:
        """What keeps the heaters off, with its remedy; None if nothing does."""
        for channel in self.channels:
            if channel.needed and channel.verdict is not Verdict.GOOD:
                shown = "no reading" if channel.verdict is Verdict.SILENT else channel.verdict
                return (
                    f"thermocouple {channel.side.upper()}: {shown}. "
                    f"Fix: {REMEDIES[channel.verdict]}."
                )
        return None

    @property
    def stable(self) -> bool:
        """Whether every heated channel is."""
        return all(c.control.stable for c in self.channels if c.heated)

    @property
    def hottest(self) -> float:
        """Highest temperature that is known, C; -inf if none is."""
        known = [c.temperature for c in self.channels if c.temperature is not None]
        return max(known, default=-inf)

    @property
    def temperatures(self) -> tuple[float | None, float | None]:
        first, second = (channel.temperature for channel in self.channels)
        return first, second

    def aim(self, stage: Stage) -> None:
        """Take a stage's setpoints."""
        for channel in self.channels:
            channel.control.aim(getattr(stage, f"setpoint_{channel.side}"))

    @property
    def unknown(self) -> bool:
        """Whether a temperature that is needed is not known."""
        return any(c.needed and c.temperature is None for c in self.channels)

    def take(self, reading: Reading | None) -> None:
        """Take the meter's latest reading, None if there is none; one twice counts once."""
        if reading is None or reading is self._taken:
            return
        self._taken, self.fresh = reading, True
        for channel, value in zip(self.channels, reading.temperatures, strict=True):
            channel.watch.read(reading.time, value)

    def judge(self, now: float) -> None:
        """Judge the channels at a host time [s]."""
        for channel in self.channels:
            setpoint = channel.control.setpoint
            channel.verdict = channel.watch.check(
                now, channel.control.duty, -inf if setpoint is None else setpoint
            )

    def watch(self, meter: MeterSource, now: float) -> None:
        """Take what the meter says and judge it at a host time [s]."""
        self.take(meter.latest)
        self.judge(now)

    def begin(self, now: float) -> None:
        """Judge for the first time: a thermocouple that shows a temperature is needed from now on."""
        self.judge(now)
        for channel in self.channels:
            channel.needed = channel.needed or channel.verdict is Verdict.GOOD

    def off(self) -> None:
        """Duties 0, and all control begins anew."""
        for channel in self.channels:
            channel.control.off()
            channel.duty = 0

    def step(self, now: float, *, hold_off: bool) -> tuple[int, int]:
        """Duties at a host time [s]; call it once every control period.

        One meter serves both channels: where one that is heated waits for it, so does the other.
        """
        for channel in self.channels:
            if hold_off or self.trouble is not None or channel.temperature is None:
                channel.control.off()
            else:
                channel.control.update(channel.temperature, now)
        waits = any(c.control.duty > 0 and c.watch.waits for c in self.channels)
        for channel in self.channels:
            channel.duty = 0 if waits else channel.control.duty
        first, second = (channel.duty for channel in self.channels)
        return first, second
