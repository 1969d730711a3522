"""Rows become intervals without inventing or losing information."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import Run, Thermometer, read_run
from muscle_bayes.data.reader import run_from_bytes
from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.model.lane_model import predictions
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.records.fast import fast_record, segments
from muscle_bayes.inference.records.load_changes import HAND, JOLT, SWINGS
from muscle_bayes.inference.records.slow import slow_record
from muscle_bayes.inference.running.programs import solved_at

DATA = Path(__file__).parents[2] / "data" / "plain"


@pytest.fixture(scope="module")
def sawtooth() -> Run:
    return read_run(DATA / "sawtooth.csv")


def test_every_reading_of_a_slow_run_counts_once(sawtooth: Run) -> None:
    record = slow_record(sawtooth)
    assert record.weight.sum() <= len(sawtooth.table)
    assert record.weight.sum() > 0.95 * len(sawtooth.table)


def test_means_of_uneven_rows_are_those_of_even_ones(sawtooth: Run) -> None:
    """Readings of a rotor that turns evenly, whose rows come unevenly and pause."""
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(0.05, 0.15, len(sawtooth.table)))
    time[3000:] += 0.7
    time -= time[0]
    table = sawtooth.table.assign(time=time, load=0.1, reading=400.0 + 5.0 * time)
    record = slow_record(type(sawtooth)(sawtooth.name, None, sawtooth.metadata, table))
    seen = record.weight > 0
    nodes = record.schedule.time
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    np.testing.assert_allclose(record.reading[seen], 400.0 + 5.0 * middles[seen], atol=1e-6)
    paused = (nodes[:-1] >= time[2999]) & (nodes[1:] <= time[3000])
    assert paused.any()
    assert np.all(record.weight[paused] == 0.0)


@pytest.mark.parametrize("record_of", [slow_record, fast_record])
def test_temperatures_that_are_logged_late_are_dated_back(sawtooth: Run, record_of) -> None:
    time = sawtooth.table["time"].to_numpy()
    warm = 40.0 + 20.0 * np.sin(0.05 * time)
    table = sawtooth.table.assign(temperature_a=warm, temperature_b=25.0)
    late = 40.0 + 20.0 * np.sin(0.05 * (time - 0.8))
    metadata = sawtooth.metadata.model_copy(update={"thermometer": Thermometer(delay=0.8)})
    prompt = record_of(Run(sawtooth.name, None, sawtooth.metadata, table))
    told = record_of(Run(sawtooth.name, None, metadata, table.assign(temperature_a=late)))
    inside = (prompt.schedule.time > 5.0) & (prompt.schedule.time < time[-1] - 5.0)
    found = np.interp(prompt.schedule.time, told.schedule.time, told.schedule.temperature[:, 0])
    np.testing.assert_allclose(found[inside], prompt.schedule.temperature[inside, 0], atol=0.05)
    silent = record_of(
        Run(sawtooth.name, None, sawtooth.metadata, table.assign(temperature_a=late))
    )
    off = np.interp(prompt.schedule.time, silent.schedule.time, silent.schedule.temperature[:, 0])
    assert np.abs(off - prompt.schedule.temperature[:, 0])[inside].max() > 0.7


def test_load_changes_lie_on_nodes(sawtooth: Run) -> None:
    nodes = slow_record(sawtooth).schedule.time
    for jump in sawtooth.load_steps:
        assert np.min(np.abs(nodes - jump)) < 1e-9


def test_a_jolt_leaves_the_rotor_s_position_open(sawtooth: Run) -> None:
    record = slow_record(sawtooth)
    jolted = record.jolted > 0.0
    begins = record.schedule.time[:-1][jolted]
    np.testing.assert_allclose(begins, sawtooth.load_steps, atol=0.25)
    steps = np.array(sawtooth.load_steps)
    time, reading = (sawtooth.table[name].to_numpy() for name in ("time", "reading"))
    for early in (True, False):  # the run's two pours
        pour = steps[(steps < 1000.0) == early]
        before = reading[(time > pour[0] - 2.0) & (time < pour[0])].mean()
        after = reading[(time > pour[-1] + 2.0) & (time < pour[-1] + 4.0)].mean()
        total = record.jolted[(record.time < 1000.0) == early].sum()
        np.testing.assert_allclose(np.sqrt(total), JOLT * abs(after - before), rtol=0.05)


def test_readings_do_not_count_while_a_hand_changes_the_load(sawtooth: Run) -> None:
    """Until the rotor is at rest again; a load that was logged is known at any time."""
    record = slow_record(sawtooth)
    away = np.min(np.abs(record.time[:, None] - np.array(sawtooth.load_steps)), axis=1)
    assert not record.weight[away < HAND].any()
    assert np.mean(record.weight[away > SWINGS + 1.0] > 0.0) > 0.9
    metadata = sawtooth.metadata.model_copy(update={"load": None})
    logged = slow_record(Run(sawtooth.name, None, metadata, sawtooth.table))
    np.testing.assert_allclose(logged.jolted.sum(), record.jolted.sum(), rtol=0.1)
    jumps = np.min(np.abs(logged.time[:, None] - np.array(sawtooth.load_steps)), axis=1)
    assert logged.weight[jumps < HAND].any()


def test_peaks_of_temperature_survive(sawtooth: Run) -> None:
    peak = sawtooth.table["temperature_a"].max()
    assert slow_record(sawtooth).schedule.temperature[:, 0].max() > peak - 0.6


def test_spring_readings_are_taken_one_by_one() -> None:
    run = read_run(DATA / "spring-1.csv")
    record = fast_record(run)
    assert record.time.size == len(run.table) - 1
    assert record.start_reading == run.table["reading"].iloc[0]


def test_a_reading_that_never_changes_is_one_observation() -> None:
    run = read_run(DATA / "spring-1.csv")
    table = run.table.copy()
    table.loc[100:, "reading"] = 530.0
    frozen = fast_record(type(run)(run.name, None, run.metadata, table))
    stuck = frozen.weight[frozen.time >= table["time"].iloc[100]]
    assert np.count_nonzero(stuck) == 1


def test_the_rotor_swings_on_through_a_gap_of_the_log() -> None:
    """Readings after half a second without rows are predicted as if nothing were missing."""
    run = read_run(DATA / "spring-1.csv")
    time = run.table["time"]
    kept = run.table[(time < 0.3) | (time > 0.8)].reset_index(drop=True)
    models = []
    with jax.enable_x64(True):
        for table in (run.table, kept):
            problem = pose([type(run)(run.name, None, run.metadata, table)])
            # The first reading tells zero and start alike in both.
            values = {"J": 1.2e-3, "D": 2e-3, "fast.zero": [run.sensor.zero]}
            values |= {"fast.start": [float(table["reading"].iloc[0])]}
            values |= {f"fast.{key}": 0.5 for key in ("noise", "discrepancy", "correlation_time")}
            values = {key: jnp.asarray(value) for key, value in values.items()}
            vector = unconstrain(values, problem.layout, problem.data)
            solved = solved_at(vector, problem.layout, problem.data).responses[0].averaged[0]
            nodes = np.asarray(problem.data.lanes[0].schedule.time[0, 1:])
            lasting = np.diff(nodes, prepend=0.0) > 0.0
            models.append((nodes[lasting], np.asarray(solved)[lasting]))
    (full, expected), (gapped, found) = models
    after = (full > 0.85) & (full < 3.0)
    assert np.ptp(expected[after]) > 20.0
    np.testing.assert_allclose(np.interp(full[after], gapped, found), expected[after], atol=0.3)


def test_runs_that_something_restores_are_not_cut() -> None:
    run = read_run(DATA / "spring-1.csv")
    record = fast_record(run)
    assert segments(run, record) == [record]


def test_segments_of_an_axis_at_rest_begin_where_it_stands(tmp_path) -> None:
    """Equal readings count once: what is left out of a segment's readings is no reading of 0."""
    time = np.arange(0.0, 3.0, 2e-3)
    moved = 0.3 + 0.05 * np.clip(time - 2.0, 0.0, None)
    noise = 4e-6 * np.random.default_rng(0).standard_normal(time.size)
    shown = np.round((moved + np.where(time < 1.0, noise, 0.0)) / 5e-6) * 5e-6
    rows = "".join(f"{t:.4g},{x:.6f},0.0\n" for t, x in zip(time, shown, strict=True))
    (tmp_path / "axis.csv").write_text("t,x,f\n" + rows)
    (tmp_path / "axis.toml").write_text(
        'format = 1\nprotocol = "free"\norigin = "synthetic"\n[columns]\ntime = "t"\n'
        'position = "x"\nposition_unit = "m"\napplied = "f"\n[fixture]\nmotion = "linear"\n'
        '[element_a]\nkind = "none"\n[element_b]\nkind = "none"\n'
    )
    run = read_run(tmp_path / "axis.csv")
    record = fast_record(run)
    assert (record.weight == 0).any()
    cut = segments(run, record)
    begins = [one.schedule.time[0] for one in cut]
    true = np.interp(begins, time, moved)
    np.testing.assert_allclose([one.start_reading for one in cut], true, atol=5e-4)
    speeds = np.array([one.start_speed for one in cut])
    near = np.abs(np.array(begins) - 2.0) < 0.1
    expected = np.where(np.array(begins) < 2.0, 0.0, 0.05)
    np.testing.assert_allclose(speeds[~near], expected[~near], atol=1e-3)


@pytest.mark.parametrize("hertz", [0.5, 5.0, 30.0])
@pytest.mark.parametrize("jitter", [0.0, 4e-4])
def test_a_swing_is_not_averaged_away(hertz, jitter):
    time = np.arange(0.0, 2.0, 5e-4) + jitter * np.random.default_rng(0).random(4000)
    rows = "".join(f"{t:.6f},{np.cos(2 * np.pi * hertz * t):.6f}\n" for t in time)
    about = (
        'format = 1\nprotocol = "free"\norigin = "synthetic"\n[columns]\ntime = "t"\n'
        'position = "q"\nposition_unit = "rad"\n[element_a]\nkind = "spring"\nlinkage = "torsion"\n'
    )
    run = run_from_bytes(f"t,q\n{rows}".encode(), about.encode(), Path("q.csv"), Path("q.toml"))
    record = fast_record(run)
    swing = np.cos(2 * np.pi * hertz * (record.time + time[0]))
    assert np.quantile(np.abs(record.reading - swing), 0.95) < 3e-4
    assert record.time.size >= min(30 * hertz * 2.0, 100)


@pytest.mark.parametrize("noise", [1e-5, 1e-2])
def test_a_swing_is_solved_as_well_as_it_is_measured(noise: float) -> None:
    """A torsion pendulum by closed form, 8.6 Hz, seen by a fine and by a poor sensor."""
    swing, inertia, time = 54.0, 1e-3, np.arange(0.0, 2.0, 1e-3)
    angle = np.cos(swing * time) + noise * np.random.default_rng(0).standard_normal(time.size)
    rows = "".join(f"{t:.3f},{q:.7f}\n" for t, q in zip(time, angle, strict=True))
    about = (
        'format = 1\nprotocol = "free"\norigin = "synthetic"\n[columns]\ntime = "t"\n'
        f'position = "q"\nposition_unit = "rad"\n[fixture]\ninertia = {inertia}\n[element_a]\n'
        f'kind = "spring"\nlinkage = "torsion"\nrate = {inertia * swing**2}\ntension_at_zero = 0.0\n'
        "damping = 0.0\n"
    )
    run = run_from_bytes(f"t,q\n{rows}".encode(), about.encode(), Path("q.csv"), Path("q.toml"))
    problem = pose([run])
    truth = {"D": 1e-12, "fast.start": np.ones(1), "fast.speed": np.zeros(1)}
    with jax.enable_x64(True):
        values = {
            name: jnp.asarray(truth.get(name, site.prior.mean)) * jnp.ones(site.prior.shape())
            for name, site in problem.sites.items()
        }
        shown = predictions(values, problem.layout, problem.data)[0].reading[0]
    lanes = problem.data.lanes[0]
    away = np.asarray(lanes.reading[0] - shown)[np.asarray(lanes.weight[0]) > 0]
    assert np.sqrt(np.mean(away**2)) < 1.5 * noise
