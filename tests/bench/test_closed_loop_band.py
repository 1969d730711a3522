"""New joints, hidden from the prediction, under the compiled firmware: recorded inside its band."""

from dataclasses import replace

import numpy as np
import pytest

from muscle_bayes.bench.recording.holder import Holder
from muscle_bayes.bench.recording.run_file import RunFile
from muscle_bayes.bench.sequences.sequence import Sequence, Stage
from muscle_bayes.bench.sequences.sequence_file import run_metadata
from muscle_bayes.bench.simulation.joint import build_firmware, joint_bench
from muscle_bayes.bench.simulation.recording import rig_tables, simulated_devices
from muscle_bayes.control.batch import SHOWN_EVERY, Bank, run
from muscle_bayes.control.laws.gains import Gains, gains_header, law_of
from muscle_bayes.control.plant.design import Design
from muscle_bayes.control.plant.draws import Surroundings, joint_draws
from muscle_bayes.control.scenarios.scenario import Scenario
from muscle_bayes.control.scenarios.thesis import step
from muscle_bayes.data import read_run
from muscle_bayes.inference.population import Population
from muscle_bayes.inference.population.coordinates import coordinates
from muscle_bayes.inference.population.hierarchy import prior_spread
from muscle_bayes.study.published import TABLE_1, TABLE_2
from muscle_bayes.twin import Element, Rig
from muscle_bayes.twin.plant.parameters import MuscleParameters, Truth
from muscle_bayes.twin.plant.rig import Fixture, Heater, Potentiometer

GAINS = Gains(proportional=8000.0, integral=300.0, windup_time=30.0, governor=(82.0, 107.0))
LENGTH = 40.0
SHOWN, HIDDEN = 96, 2


@pytest.fixture(scope="module")
def joints():
    """Joints of a population about the published muscle; the last are hidden."""
    centre = coordinates({k: np.array([v]) for k, v in TABLE_2.items()}, 0.1, 1.7)
    friction = {key: np.full(200, value) for key, value in TABLE_1["coulomb"].items()}
    population = Population(
        np.repeat(centre, 200, 0), np.repeat(prior_spread()[None], 200, 0), {}, friction, "coulomb",
        (), 0.1, 1.7,
    )  # fmt: skip
    tube = {"gain": np.full(200, 4.5), "cooling": np.full(200, 1 / 48), "lag": np.full(200, 0.02)}
    # The twin's bench has one kind of tube, and a meter that is as quick as its tubes.
    around = Surroundings(tubes=0.0, meter_lag=(0.05, 0.0))
    return joint_draws(population, tube, SHOWN + HIDDEN, surroundings=around, seed=4)


def rig_of(draws, index) -> Rig:
    """The twin's rig with the truth of one draw."""
    joint = draws.one(index)
    sides = [
        MuscleParameters(**{key: float(getattr(side.parameters, key)) for key in TABLE_2})
        for side in joint.plant.muscles.values()
    ]
    bearing = {key: float(draws.values[key][index]) for key in ("J", "D")}
    heater = joint.heater
    return Rig(
        element_b=Element(kind="muscle"),
        fixture=replace(Fixture(), room_temperature=float(heater.room)),
        truth=Truth(muscle_a=sides[0], muscle_b=sides[1], **bearing),
        heater=Heater(full_rate=float(heater.gain[0]), cooling_time=float(1 / heater.cooling[0])),
        potentiometer=Potentiometer(zero_spread=0.0),
    )


@pytest.fixture(scope="module")
def elf(firmware, tmp_path_factory):
    folder = tmp_path_factory.mktemp("gains")
    (folder / "gains.h").write_text(gains_header(GAINS, Design()))
    return build_firmware(folder / "gains.h", folder)


@pytest.fixture(scope="module")
def predicted(joints):
    """Angles of the joints that are shown, and when."""
    scenario = Scenario("step", "", step(GAINS.period))
    angle = run(Bank(joints.split(SHOWN)[0]), law_of(GAINS, joints.design), scenario).angle
    return SHOWN_EVERY * GAINS.period * np.arange(angle.shape[1]), angle


@pytest.mark.parametrize("index", range(HIDDEN))
def test_a_hidden_joint_is_recorded_inside_the_band(joints, predicted, elf, tmp_path, index):
    rig, course = rig_of(joints, SHOWN + index), step(GAINS.period)
    with joint_bench(rig, elf, seed=index) as bench:
        devices = simulated_devices(bench)
        devices.heater.open()
        devices.meter.open()
        plan = Sequence(load=0.0, stage=(Stage(duration=LENGTH),))
        about = run_metadata(plan, "step.toml", "synthetic", rig_tables(rig), 0.0)
        Holder(
            devices.heater.device, devices.meter.device, bench.clock,
            RunFile(tmp_path, "step", about),
            lambda time: float(course.setpoint[int(time / GAINS.period)]), LENGTH,
        ).run()  # fmt: skip
    found, sensor = read_run(tmp_path / "step.csv").table, about.potentiometer
    angle = (found["reading"] - sensor.zero_reading).to_numpy() * sensor.radians_per_count
    when, band = predicted
    inside = when < LENGTH - 1.0
    recorded = np.interp(when[inside], found["time"], angle)
    low, high = band[:, inside].min(0), band[:, inside].max(0)
    count = sensor.radians_per_count
    kept = (recorded > low - count) & (recorded < high + count)
    assert kept.mean() > 0.95
    assert np.ptp(recorded) > 0.05
    assert (high - low)[-20:].max() < 0.03  # a band that tells something: the step is 0.08
