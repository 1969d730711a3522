"""Whole runs: reproducible, true to their metadata, and converged in the step."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.trial.random_rigs import random_rig
from muscle_bayes.data import HEADER, read_run
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin import (
    Element,
    Logger,
    Potentiometer,
    Rig,
    Stage,
    free,
    make_effect,
    save_runs,
    sawtooth,
    simulate,
    spring,
    spring_masses,
    spring_rig,
    staircase,
)
from muscle_bayes.twin.simulate import record

SPRING = spring_rig(Rig())


@pytest.fixture(scope="module")
def heating():
    """A short heated run with a pour."""
    stages = (
        Stage(setpoint_a=25.0, duration=5.0),
        Stage(setpoint_a=50.0),
        Stage(setpoint_a=50.0, duration=8.0, load=0.166, pour_time=4.0),
    )
    return simulate(Rig(), free(stages, load=0.139), 3)


def test_log_has_the_fixtures_header_and_rising_uneven_time(heating):
    assert tuple(heating.log.columns) == HEADER
    time = heating.log["Time (s)"].to_numpy()
    gaps = np.diff(time)
    assert time[0] == 0.0
    assert gaps.min() > 0.0
    assert np.median(gaps) == pytest.approx(0.03, abs=0.001)
    assert gaps.std() > 0.002
    assert time == pytest.approx(np.round(time, 3), abs=1e-9)


def test_temperature_columns_are_held_between_updates(heating):
    log = heating.log
    changed = log["Temperature A (C)"].diff().fillna(0.0) != 0.0
    assert not (changed & (log["Temperature Update"] == 0)).any()
    updates = log["Time (s)"][log["Temperature Update"] == 1].diff().dropna()
    assert updates.mean() == pytest.approx(0.4, abs=0.04)
    assert set(log["Temperature Stable A"]) == {0, 1}
    assert (log["Setpoint B (C)"] == 0.0).all()
    assert log["Temperature B (C)"].between(24.7, 25.3).all()


def test_stages_follow_the_stable_rule(heating):
    log = heating.log
    aimed = log[log["Setpoint A (C)"] == 50.0]
    stable = aimed[aimed["Temperature Stable A"] == 1]
    before = aimed[
        aimed["Time (s)"].between(stable["Time (s)"].min() - 9.9, stable["Time (s)"].min())
    ]
    assert (before["Temperature A (C)"] - 50.0).abs().max() <= 1.0 + 1e-9


def test_metadata_states_what_hung(heating):
    metadata = heating.metadata
    assert metadata.origin == "synthetic"
    load = metadata.load
    assert load is not None
    assert load.mass[0] == 0.139
    assert load.mass[-1] == 0.166
    assert len(load.time) == 21
    recording, zero = record(
        Rig(),
        free(
            (
                Stage(setpoint_a=25.0, duration=5.0),
                Stage(setpoint_a=50.0),
                Stage(setpoint_a=50.0, duration=8.0, load=0.166, pour_time=4.0),
            ),
            load=0.139,
        ),
        3,
    )
    for hidden in recording.trace:
        step = np.searchsorted(load.time, hidden.time + 1e-9, side="right") - 1
        assert hidden.load == load.mass[step]
    assert heating.truth["run"]["zero_reading"] == zero
    assert heating.truth["run"]["initial_angle"] == recording.trace[0].angle


def test_metadata_hides_the_truth(heating):
    potentiometer = heating.metadata.potentiometer
    assert potentiometer is not None
    assert potentiometer.zero_reading == 512.0
    zero = heating.truth["run"]["zero_reading"]
    assert zero != 512.0
    assert abs(zero - 512.0) <= 2.0


def test_spring_runs_start_at_rest_and_end_stuck():
    recording, zero = record(SPRING, spring(0.118), 5)
    first, last = recording.trace[0], recording.trace[-1]
    assert (first.time, first.angle, first.velocity) == (0.0, 0.0, 0.0)
    assert not last.slipping
    rest = [hidden.time for hidden in recording.trace if hidden.angle == last.angle]
    assert 3.5 < rest[-1] - rest[0] < 4.5
    assert abs(recording.rows[0][8] - zero) < 3


def test_linear_friction_never_sticks():
    rig = replace(
        SPRING, truth=replace(SPRING.truth, friction_law="linear", J=0.0013139, D=0.00415667)
    )
    recording, _ = record(rig, spring(0.118), 5)
    assert recording.rows[-1][0] > 11.5
    assert all(hidden.slipping for hidden in recording.trace[2:])


def test_equal_seeds_write_equal_bytes(tmp_path):
    for folder, seed in (("one", 4), ("two", 4), ("three", 5)):
        runs = {"run": simulate(SPRING, spring(0.118), seed)}
        save_runs(tmp_path / folder, runs)
    one, two, three = (
        [(tmp_path / f / name).read_bytes() for name in ("run.csv", "run.toml", "truth.toml")]
        for f in ("one", "two", "three")
    )
    assert one == two
    assert one[0] != three[0]
    assert one[2] != three[2]


def test_runs_of_a_set_have_noise_of_their_own():
    first, second = (simulate(SPRING, spring(0.118), (7, number)) for number in range(2))
    assert first.truth["run"]["zero_reading"] != second.truth["run"]["zero_reading"]
    assert list(first.log.iloc[:20, 0]) != list(second.log.iloc[:20, 0])


def test_noise_streams_do_not_disturb_each_other():
    """Without the potentiometer's noise the clock and the meter give the same rows."""
    quiet = replace(SPRING, potentiometer=Potentiometer(count_noise=0.0))
    usual, other = (simulate(rig, spring(0.118), 4).log for rig in (SPRING, quiet))
    assert usual.iloc[:, :8].equals(other.iloc[:, :8])


def test_reader_takes_the_run_back_without_repairs(heating, tmp_path):
    save_runs(tmp_path, {"heating": heating})
    run = read_run(tmp_path / "heating.csv")
    assert not run.repairs
    assert run.metadata == heating.metadata


@pytest.mark.parametrize("protocol", ["coarse", "default"])
def test_angles_converge_with_the_step(protocol):
    """At the default step the whole trace is within a hundredth of a count of a finer one."""
    step = 1e-3 if protocol == "coarse" else Rig().slip_step
    stages = (Stage(setpoint_a=60.0), Stage(setpoint_a=60.0, duration=5.0, load=0.2))
    plan = free(stages, load=0.139, log_period=0.1)
    steady = Logger(jitter=0.0, pause_probability=0.0)
    traces = []
    for length in (step, 1e-4):
        recording, _ = record(Rig(logger=steady, slip_step=length), plan, 1)
        traces.append(np.array([hidden.angle for hidden in recording.trace]))
    assert np.abs(traces[0] - traces[1]).max() < 0.01 * 0.0058


def test_staircase_and_sawtooth_are_trained_before_the_log_starts():
    for protocol in (staircase(0.139), sawtooth()):
        logged = [stage.logged for stage in protocol.stages]
        assert logged == sorted(logged)
        assert not logged[0]
        assert max(stage.setpoint_a or 0.0 for stage in protocol.stages) == 90.0


def test_sawtooth_pours_at_room_temperature():
    pours = [stage for stage in sawtooth().stages if stage.load is not None and stage.logged]
    assert [stage.load for stage in pours] == [0.166, 0.212]
    assert all(stage.setpoint_a == 25.0 and stage.pour_time > 0 for stage in pours)


def test_both_sides_may_hold_a_heated_muscle():
    rig = Rig(element_b=Element(kind="muscle"))
    stages = [Stage(setpoint_a=40.0, setpoint_b=30.0)]
    run = simulate(rig, free(stages, load=0.0), 1)
    last = run.log.iloc[-1]
    assert last["Temperature A (C)"] == pytest.approx(40.0, abs=1.0)
    assert last["Temperature B (C)"] == pytest.approx(30.0, abs=1.0)
    assert last["Temperature Stable A"] == last["Temperature Stable B"] == 1
    assert run.log["Potentiometer Reading"].iloc[-1] < run.log["Potentiometer Reading"].iloc[0]
    assert "initial_hyst_b" in run.truth["run"]


def test_a_setpoint_out_of_reach_is_an_error(monkeypatch):
    monkeypatch.setattr("muscle_bayes.twin.recording.STAGE_LIMIT", 60.0)
    with pytest.raises(MuscleBayesError, match="were not reached"):
        simulate(Rig(), free([Stage(setpoint_a=10.0)], load=0.139), 1)


def test_random_rigs_run_clear_of_their_stops():
    rng = np.random.default_rng(11)
    seen = set()
    for _ in range(3):
        rig = random_rig(rng)
        seen.add(rig.truth.J)
        bench = spring_rig(rig)
        for mass in spring_masses(bench, 2):
            recording, _ = record(bench, spring(mass), 1)
            angles = [hidden.angle for hidden in recording.trace]
            assert min(angles) == 0.0
            assert 0.4 < max(angles) < 1.0
        stages = (Stage(setpoint_a=90.0, logged=True), Stage(duration=20.0, load=0.212))
        recording, _ = record(rig, free(stages, load=0.06, initial_hyst=0.0, log_period=0.1), 1)
        lower, upper = rig.fixture.stops
        assert all(lower < hidden.angle < upper for hidden in recording.trace)
    assert len(seen) == 3


def test_an_effect_shows_in_the_run_and_in_the_truth():
    bias = make_effect("bias-torque", torque=0.01)
    rig = replace(SPRING, truth=replace(SPRING.truth, effects=(bias,)))
    plain, biased = (record(r, spring(0.11), 2)[0].trace[-1].angle for r in (SPRING, rig))
    assert biased > plain + 0.02
    assert simulate(rig, spring(0.11), 2).truth["effects"] == {"bias-torque": {"torque": 0.01}}
