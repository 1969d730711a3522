"""Both channels on the twin's heater tubes and meter: settling, and what waiting for the meter costs."""

import numpy as np
import pytest

from muscle_bayes.bench.heat.heating import Heating
from muscle_bayes.bench.heat.temperature_control import PERIOD
from muscle_bayes.bench.meters.meter import Reading
from muscle_bayes.bench.sequences.regimes import CLIMB
from muscle_bayes.bench.sequences.sequence import Stage
from muscle_bayes.twin.plant.heater import HeaterTube
from muscle_bayes.twin.plant.rig import Meter
from muscle_bayes.twin.sensors import ThermocoupleMeter

ROOM = 25.0


class Tube:
    """Side A of a bench: what each control period wanted, gave and reached."""

    def __init__(self, noise=0.05, full_rate=4.5):
        self.tube = HeaterTube(full_rate, 48.0, ROOM)
        self.meter = ThermocoupleMeter(Meter(noise=noise), np.random.default_rng(3))
        self.heating = Heating((True, False))
        self.now = 0.0
        self.rows = []

    def hold(self, setpoint, most, after=0.0):
        """Until stable for `after` s, at most `most` s; temperatures from the setpoint's start."""
        self.heating.aim(Stage(setpoint_a=setpoint, duration=1e6))
        start, end = len(self.rows), self.now + most
        while self.now < end:
            self.step()
            if self.heating.stable:
                end = min(end, self.now + after)
        return np.array(self.rows[start:])[:, 0]

    def step(self):
        self.meter.poll(self.now, (self.tube.temperature, ROOM))
        self.heating.take(Reading(self.now, self.meter.readings))
        self.heating.judge(self.now)
        duty, _ = self.heating.step(self.now, hold_off=False)
        self.rows.append((self.tube.temperature, self.heating.channels[0].control.duty, duty))
        self.tube.advance(duty, PERIOD)
        self.now += PERIOD


def test_every_setpoint_of_the_staircase_settles_within_one_degree():
    side = Tube()
    for setpoint in CLIMB:
        reached = side.hold(setpoint, 120.0)
        assert side.heating.stable, setpoint
        assert reached[-1] == pytest.approx(setpoint, abs=1.0)
        assert reached.max() - setpoint < 6.0


@pytest.mark.parametrize("noise", [0.05, 0.0])
def test_a_sound_meter_is_seldom_waited_for(noise):
    """Without noise its digits stand still for long, which costs short pauses."""
    side = Tube(noise)
    late = side.hold(90.0, 200.0, after=60.0)[-1000:]
    _, wanted, given = np.array(side.rows).T
    waits = (given == 0) & (wanted > 0)
    assert waits[wanted > 127].mean() < 0.12
    assert waits[(wanted > 0) & (wanted <= 127)].mean() < 0.02
    assert np.abs(late - 90.0).max() < 0.6


def test_a_weak_heater_holds_above_half_power():
    side = Tube(full_rate=2.0)
    late = side.hold(90.0, 300.0, after=100.0)[-1000:]
    assert side.heating.stable
    assert np.array(side.rows)[-1000:, 1].mean() > 127
    assert np.abs(late - 90.0).max() < 1.0


def test_both_sides_wait_where_one_does():
    heating = Heating((True, True))
    heating.aim(Stage(setpoint_a=90.0, setpoint_b=30.0, duration=1.0))
    for number, second in enumerate((25.0, 25.2, 25.4, 25.6, 25.8)):
        now = 0.2 * number
        heating.take(Reading(now, (25.0, second)))
        heating.judge(now)
        first_duty, second_duty = heating.step(now, hold_off=False)
        assert (first_duty > 0) == (second_duty > 0) == (now < 0.5)
