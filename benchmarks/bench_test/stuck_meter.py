"""A meter that repeats itself from any moment on: what the heaters do, and how hot their tubes get.

Where a tube is held at its setpoint a stuck meter looks as a good one does: nothing can tell it in half
a second. What can be said is how far the tube gets before it is told. No firmware takes part: it obeys.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from benchmarks.bench_test.failures import ALLOWED
from muscle_bayes.bench.heat.heating import Heating
from muscle_bayes.bench.heat.temperature_control import PERIOD
from muscle_bayes.bench.heat.thermometry import FAR, HALF_POWER
from muscle_bayes.bench.meters.meter import Reading
from muscle_bayes.bench.sequences.sequence import Stage
from muscle_bayes.twin.plant.heater import HeaterTube
from muscle_bayes.twin.plant.rig import Rig
from muscle_bayes.twin.sensors import ThermocoupleMeter

LONGEST: Final = 60.0
"""s of heating and holding within which the meter gets stuck."""
WATCHED: Final = 70.0
"""s for which the heaters are watched from then on."""
MOST_EXCESS: Final = 8.0
"""C by which a tube may exceed its setpoint; without any failure the law overshoots by 3 to 5."""
COOLEST, HOTTEST = 30.0, 95.0
"""Between these lie the setpoints, C."""


@dataclass(frozen=True)
class StuckOutcome:
    """What followed one stuck meter."""

    seed: int
    holding: bool
    """whether a tube was not heated hard throughout the half second that followed"""
    off_after: float
    """s from then to the last moment at which a heater was on"""
    excess: float
    """C by which a tube was above its setpoint at most, from then on"""

    @property
    def safe(self) -> bool:
        """In time where that can be, and never too hot."""
        return (self.holding or self.off_after <= ALLOWED) and self.excess <= MOST_EXCESS


def stick(seed: int, rig: Rig | None = None) -> StuckOutcome:
    """Heat both tubes to random setpoints from the room, and let the meter get stuck at some moment."""
    rig = rig or Rig()
    random = np.random.default_rng([seed, *b"stuck meter"])
    setpoints = random.uniform(COOLEST, HOTTEST, size=2)
    stuck = float(random.uniform(1.0, LONGEST))
    room = rig.fixture.room_temperature
    tubes = [HeaterTube(rig.heater.full_rate, rig.heater.cooling_time, room) for _ in setpoints]
    meter = ThermocoupleMeter(rig.meter, random)
    heating = Heating((True, True))
    heating.aim(Stage(setpoint_a=setpoints[0], setpoint_b=setpoints[1], duration=1e6))
    holding, last_on, excess = False, stuck, 0.0
    for step in range(round((stuck + WATCHED) / PERIOD)):
        now = step * PERIOD
        first, second = (tube.temperature for tube in tubes)
        if now < stuck:
            meter.poll(now, (first, second))
        else:
            excess = max(excess, first - setpoints[0], second - setpoints[1])
        heating.take(Reading(now, meter.readings))
        heating.judge(now)
        duties = heating.step(now, hold_off=False)
        if 0.0 <= now - stuck <= ALLOWED:
            holding |= not all(
                c.control.duty > HALF_POWER and setpoint - shown > FAR
                for c, setpoint, shown in zip(
                    heating.channels, setpoints, meter.readings, strict=True
                )
            )
        if now >= stuck and any(duties):
            last_on = now + PERIOD
        for tube, duty in zip(tubes, duties, strict=True):
            tube.advance(duty, PERIOD)
    return StuckOutcome(seed, holding, last_on - stuck, float(excess))


def stick_all(
    count: int, seed: int = 0, progress: Callable[[float], None] = lambda share: None
) -> list[StuckOutcome]:
    """So many of them."""
    outcomes = []
    for number in range(count):
        outcomes.append(stick(seed + number))
        progress((number + 1) / count)
    return outcomes
