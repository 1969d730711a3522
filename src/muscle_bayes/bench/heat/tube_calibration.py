"""Gain and cooling of a heater tube, from one pulse of heat and what follows it."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from muscle_bayes.bench.boards.board import Board
from muscle_bayes.bench.boards.clock import Clock
from muscle_bayes.bench.boards.messages import explain
from muscle_bayes.bench.heat.heat_model import LEAST, MOST, TubeModel
from muscle_bayes.bench.heat.thermometry import far_from_room
from muscle_bayes.bench.meters.meter import MeterSource, first_reading
from muscle_bayes.errors import MuscleBayesError

DUTY: Final = 100
"""Duty of the pulse: even the strongest tube that a board takes stays below 100 C by it."""
PULSE: Final = 15.0
"""s of heat."""
COOLED: Final = 90.0
"""s of cooling that are followed."""
STILL: Final = 8.0
"""s of rest before the pulse, which show the room."""
LEAST_RISE: Final = 4.0
"""Rise of the thermocouple, C, below which it does not sit in its tube, or nothing heats it."""
MOST_CROSSTALK: Final = 0.3
"""Share of the rise that the other thermocouple may show."""
MOST_MISFIT: Final = 0.5
"""Root mean square by which readings may depart from the model, C."""
MOST_WARMTH: Final = 12.0
"""What is left of an earlier heat at the beginning, C."""
MOST_SHOWN: Final = 80.0
"""Reading at which the pulse ends early, C."""
_PERIOD: Final = 0.05


@dataclass(frozen=True)
class TubeFit:
    """What a pulse has shown."""

    tube: TubeModel
    rise: float
    """highest rise that was shown, C"""
    misfit: float
    """root mean square of the residuals, C"""
    delay: float
    """s by which the thermocouple follows"""


@dataclass(frozen=True)
class Pulse:
    """Times [s], readings of both channels [C] and duties given to the one that was heated."""

    time: np.ndarray
    shown: np.ndarray
    """of the heated tube"""
    other: np.ndarray
    duty: np.ndarray


def record_pulse(board: Board, meter: MeterSource, clock: Clock, channel: int) -> Pulse:
    """Rest, heat tube 0 or 1 for 15 s, and follow it as it cools. Raises MuscleBayesError."""
    rows: list[tuple[float, float, float, int]] = []
    begun = clock.now()
    pulse_over = False
    while (time := clock.now() - begun) < STILL + PULSE + COOLED:
        meter.poll()
        board.poll()
        if board.faults:
            raise MuscleBayesError(
                f"the heater board has switched off: {explain(board.faults)}. Fix: look for the "
                "cause; press its reset button before the next try."
            )
        reading = meter.latest
        if reading is None or clock.now() - reading.time > 1.5:
            raise MuscleBayesError("the meter answers no more. Fix: check it and its cable.")
        temperatures = reading.temperatures
        shown, other = temperatures[channel], temperatures[1 - channel]
        if shown is None:
            raise MuscleBayesError(
                f"thermocouple {'AB'[channel]} shows OL. Fix: plug it in, or leave this tube out."
            )
        pulse_over = pulse_over or time >= STILL + PULSE or shown > MOST_SHOWN
        duty = DUTY if time >= STILL and not pulse_over else 0
        duties = (duty, 0) if channel == 0 else (0, duty)
        board.command_duty(*duties, *temperatures)
        rows.append((time, shown, np.nan if other is None else other, duty))
        clock.sleep(_PERIOD)
    board.off()
    return Pulse(*np.array(rows, dtype=np.float64).T)


def fit_pulse(pulse: Pulse, name: str) -> TubeFit:
    """Gain, cooling, room, delay and first warmth by least squares. Raises MuscleBayesError."""
    start = pulse.shown[pulse.time < STILL].mean()
    rise = float(pulse.shown.max() - start)
    if rise < LEAST_RISE:
        raise MuscleBayesError(
            f"thermocouple {name} rose by {rise:.1f} C in {PULSE:g} s of heat. Fix: put it into "
            "its tube, and check heater, 12 V and transistor."
        )
    beside = pulse.other - pulse.other[0]
    if np.isfinite(beside).any() and np.nanmax(beside) > MOST_CROSSTALK * rise:
        raise MuscleBayesError(
            f"heater {name} warms the other thermocouple, too, by {np.nanmax(beside):.1f} C. Fix: "
            "put each thermocouple into its own tube, A to T1 and B to T2."
        )

    def residuals(parameters: np.ndarray) -> np.ndarray:
        rate, cooling, room, delay, warmth = parameters
        steps = np.diff(pulse.time, prepend=pulse.time[0])
        modelled = np.full(pulse.time.size, warmth)
        for n in range(1, modelled.size):
            settled = rate * cooling * pulse.duty[n - 1] / 255
            decay = np.exp(-steps[n] / cooling)
            modelled[n] = settled + (modelled[n - 1] - settled) * decay
        return room + np.interp(pulse.time - delay, pulse.time, modelled) - pulse.shown

    guess = [rise * 255 / (DUTY * PULSE), 40.0, float(start) - 0.1, 0.4, 0.1]
    lowest = [1e-3, 1.0, start - MOST_WARMTH, 0.0, 0.0]
    highest = [50.0, 1000.0, start + 5.0, 5.0, MOST_WARMTH]
    found = least_squares(residuals, guess, bounds=(lowest, highest))
    rate, cooling, _, delay, _ = map(float, found.x)
    misfit = float(np.sqrt(np.mean(found.fun**2)))
    tube = TubeModel.of(rate, cooling)
    if misfit > MOST_MISFIT:
        raise MuscleBayesError(
            f"the readings of thermocouple {name} depart from heating and cooling by {misfit:.1f} "
            "C. Fix: keep draughts away, let the tube cool, and try again."
        )
    if not tube.plausible:
        raise MuscleBayesError(
            f"tube {name}: {rate:.2f} C/s at full power and {cooling:.0f} s of cooling are beyond "
            f"{LEAST.rate:g} to {MOST.rate:g} C/s or {LEAST.cooling_time:g} to "
            f"{MOST.cooling_time:g} s. Fix: check that the thermocouple sits in the tube; a heater "
            "that is stronger or weaker than this needs another supply voltage."
        )
    return TubeFit(tube, rise, misfit, delay)


def calibrate_tube(
    board: Board, meter: MeterSource, clock: Clock, channel: int, room: float
) -> TubeFit:
    """Measure tube 0 or 1 and store what was found on the board. Raises MuscleBayesError."""
    name = "AB"[channel]
    reading = first_reading(meter, clock, 10.0)
    if question := far_from_room(reading, room):
        raise MuscleBayesError(f"{question}. Fix: let the tubes cool, or correct --room.")
    try:
        pulse = record_pulse(board, meter, clock, channel)
    finally:
        board.off()
    fit = fit_pulse(pulse, name)
    board.calibrate_tube(channel, fit.tube)
    stored = board.tubes()[channel]
    if stored != fit.tube:
        raise MuscleBayesError(f"the board has stored {stored}. Fix: try again.")
    return fit
