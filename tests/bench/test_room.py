"""First readings that do not fit the room: Fahrenheit is refused, a warm tube is asked for."""

import pytest
from fake_bench import FakeBench

from muscle_bayes.bench.heat.thermometry import far_from_room
from muscle_bayes.bench.meters.meter import Reading
from muscle_bayes.bench.recording.loop import StoppedError
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sequences.sequence import Sequence, Stage
from muscle_bayes.errors import MuscleBayesError


def shown(first, second=None):
    return Reading(0.0, (first, second))


@pytest.mark.parametrize("reading", [shown(25.0, 24.0), shown(16.0), shown(34.9), shown(None)])
def test_a_cold_tube_fits(reading):
    assert far_from_room(reading, 25.0) == ""


@pytest.mark.parametrize("reading", [shown(77.0, 76.5), shown(70.0), shown(86.0, None)])
def test_fahrenheit_is_refused(reading):
    with pytest.raises(MuscleBayesError, match=r"in Fahrenheit\. Fix: set the meter to C"):
        far_from_room(reading, 25.0)


@pytest.mark.parametrize("reading", [shown(77.0, 25.0), shown(50.0, 77.0), shown(14.0)])
def test_a_warm_or_a_cold_one_is_asked_for(reading):
    assert "room has 25 C" in far_from_room(reading, 25.0)


class View:
    def __init__(self):
        self.asked = []

    def ask(self, question):
        self.asked.append(question)

    def show(self, status):
        pass


def session(tmp_path, shown_by_meter):
    from fake_bench import RIG

    bench = FakeBench()
    bench.meter.forced = shown_by_meter
    stage = (Stage(setpoint_a=60.0, duration=2.0),)
    made = Session(
        Sequence(stage=stage), tmp_path / "sequence.toml", tmp_path / "runs", bench.devices(),
        bench.operator, rig=RIG, load=0.0, view=View(),
    )  # fmt: skip
    made.devices.open()
    return bench, made


def test_no_heat_is_given_by_a_meter_in_fahrenheit(tmp_path):
    bench, made = session(tmp_path, (77.0, 77.2))
    with pytest.raises(MuscleBayesError, match="Fahrenheit"):
        list(made.record())
    assert bench.tubes == [25.0, 25.0]
    assert not (tmp_path / "runs").exists()


def test_a_warm_tube_is_confirmed_by_a_key(tmp_path):
    _, made = session(tmp_path, (60.0, 25.0))
    (outcome,) = made.record()
    assert outcome.complete
    assert "T1 60.0 and T2 25.0 C, and the room has 25 C" in made.view.asked[0]


def test_q_ends_it_before_any_heat(tmp_path):
    bench, made = session(tmp_path, (60.0, 25.0))
    bench.operator.stop_at = 0.0
    with pytest.raises(StoppedError):
        list(made.record())
    assert bench.tubes == [25.0, 25.0]
