"""From meter to duties: two channels, each under its control, its watch and its heat model."""

from dataclasses import dataclass, field
from math import inf
from typing import Final

from muscle_bayes.bench.heat.heat_model import (
    HOST_MUST_SHOW,
    HOTTEST,
    MOST_RISE,
    HeatModel,
    TubeModel,
)
from muscle_bayes.bench.heat.temperature_control import FULL_DUTY, TemperatureControl
from muscle_bayes.bench.heat.thermometry import REMEDIES, Verdict, Watch
from muscle_bayes.bench.meters.meter import MeterSource, Reading
from muscle_bayes.bench.sequences.sequence import Stage

MARGIN: Final = 2.0
"""By so much the host stays below what the board allows a tube by the heat model, C."""
_LONGEST_DUTY: Final = 400
"""ms after which the board's dead-man has ended a duty that was not repeated."""


def most_rise(room: float) -> float:
    """Rise that the board may allow a tube in a room [C], so that it stays below HOTTEST, C."""
    return min(MOST_RISE, HOTTEST - room)


@dataclass
class Channel:
    """One side: what is wanted, what is measured, what is given."""

    side: str
    needed: bool
    """whether the run depends on its thermocouple"""
    control: TemperatureControl = field(default_factory=TemperatureControl)
    watch: Watch = field(default_factory=Watch)
    model: HeatModel = field(default_factory=HeatModel)
    verdict: Verdict = Verdict.SILENT
    duty: int = 0
    """what is given, of 255; the control may want more"""

    @property
    def temperature(self) -> float | None:
        """The newest reading [C], None where it cannot be trusted."""
        return self.watch.temperature if self.verdict is Verdict.GOOD else None


class Heating:
    """Both channels; `step` gives the duties, (0, 0) while there is trouble or the meter is overdue."""

    def __init__(
        self, needed: tuple[bool, bool], *, room: float = 25.0, max_duty: int = FULL_DUTY
    ) -> None:
        """`room` in C; no duty exceeds `max_duty`."""
        self.channels = (Channel("a", needed[0]), Channel("b", needed[1]))
        self._most_rise = most_rise(room) - MARGIN
        self._max_duty = max_duty
        self._judged: float | None = None
        self.fan = False
        """Whether a fan blows on the tubes."""
        self.fresh = False
        """Whether a reading came since this flag was last cleared."""
        self.reading: Reading | None = None
        """The meter's newest."""

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
    def alarm(self) -> str | None:
        """What a person has to look at before any more heat; None if nothing."""
        for channel in self.channels:
            name = channel.side.upper()
            if channel.duty > 0 and channel.model.unseen(HOST_MUST_SHOW):
                return (
                    f"thermocouple {name} does not show the heat that heater {name} was given: "
                    f"{channel.model.expected:.0f} C by the heat model. Fix: look whether the "
                    "thermocouple sits in its tube, whether both are on their own channel, and "
                    "whether the heater is connected"
                )
            if channel.duty > 0 and channel.model.above(self._most_rise):
                return (
                    f"by the heat it was given tube {name} may be {channel.model.highest_rise:.0f} "
                    "C warmer than the room, whatever its thermocouple shows. Fix: look whether "
                    "it sits in its tube; if so, `muscle-bayes calibrate-heaters`"
                )
        return None

    @property
    def stable(self) -> bool:
        """Whether every heated channel is."""
        return all(c.control.stable for c in self.channels if c.control.setpoint is not None)

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
        if reading is None or reading is self.reading:
            return
        self.reading, self.fresh = reading, True
        for channel, value in zip(self.channels, reading.temperatures, strict=True):
            channel.watch.read(reading.time, value)

    def trust(self, meter: MeterSource) -> None:
        """Judge readings as such a meter's."""
        for channel in self.channels:
            channel.watch.moved_within = meter.moved_within

    def calibrate(self, tubes: tuple[TubeModel | None, TubeModel | None]) -> None:
        """Take the tubes' calibration from the board."""
        for channel, tube in zip(self.channels, tubes, strict=True):
            channel.model.model = tube

    def judge(self, now: float) -> None:
        """Judge the channels at a host time [s], the duties having been given until then."""
        passed = 0 if self._judged is None else round(1000 * (now - self._judged))
        self._judged = now if self._judged is None else self._judged + passed / 1000
        for channel in self.channels:
            heated = min(passed, _LONGEST_DUTY)
            channel.model.advance(channel.duty, heated)
            channel.model.advance(0, passed - heated)
            if channel.temperature is not None:
                channel.model.report(channel.temperature)
            if self.fan:
                channel.model.cooled()
            setpoint = channel.control.setpoint
            channel.verdict = channel.watch.check(
                now, channel.control.duty, -inf if setpoint is None else setpoint
            )

    def watch(self, meter: MeterSource, now: float) -> None:
        """Take what the meter says and judge it at a host time [s]."""
        self.trust(meter)
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
            channel.duty = 0 if waits else min(channel.control.duty, self._max_duty)
        first, second = (channel.duty for channel in self.channels)
        return first, second
