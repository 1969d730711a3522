"""Velocities and forces as measured outputs, from file to posterior."""

from pathlib import Path

import jax
import numpy as np
import pytest

import muscle_bayes as mb
from muscle_bayes.data import Run, RunError
from muscle_bayes.data.reader import run_from_bytes
from muscle_bayes.inference.model.lane_model import predictions
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.posteriors.summary import summarise
from muscle_bayes.inference.records.fast import fast_record

HEAD = 'format = 1\nprotocol = "PROTOCOL"\norigin = "synthetic"\n[columns]\ntime = "t"\n'
SPRING = '[fixture]\nmotion = "linear"\n[element_a]\nkind = "spring"\nlinkage = "straight"\n'
TIME = np.arange(0.0, 20.0, 0.02)
TRUTH = {"element_a.rate": 300.0, "element_a.tension_at_zero": 2.0, "element_a.damping": 5.0}


def read(columns: dict[str, np.ndarray], about: str) -> Run:
    rows = zip(*columns.values(), strict=True)
    log = "\n".join([",".join(columns), *(",".join(f"{x:.7g}" for x in row) for row in rows)])
    return run_from_bytes(log.encode(), about.encode(), Path("pull.csv"), Path("pull.toml"))


def pulled(protocol: str = "imposed", extra: str = "") -> Run:
    x = 0.01 * np.sin(2.0 * TIME) + 0.002 * TIME
    speed = 0.02 * np.cos(2.0 * TIME) + 0.002
    rate, pull, damping = TRUTH.values()
    noise = 0.05 * np.random.default_rng(0).standard_normal(TIME.size)
    columns = {"t": TIME, "x": x, "f": pull + rate * x + damping * speed + noise}
    about = HEAD.replace("PROTOCOL", protocol)
    about += f'position = "x"\nposition_unit = "m"\nforce = "f"\n{extra}' + SPRING
    return read(columns, about)


@pytest.mark.slow
def test_a_tensile_test_tells_the_spring() -> None:
    posterior = mb.fit([pulled()], effort="quick", progress=False)
    assert posterior.parameters == tuple(TRUTH)
    for name, row in summarise(posterior)["parameters"].items():
        assert abs(row["mean"] - TRUTH[name]) < 4.0 * row["sd"], name
        assert row["sd"] < 0.05 * TRUTH[name], name
    assert list(posterior.tree["observed_data"].data_vars) == ["pull-force"]


def test_force_and_position_are_both_explained() -> None:
    problem = pose([pulled("free")])
    assert [run.name for run in problem.runs] == ["pull", "pull-force"]
    assert problem.layout.regimes == ("fast", "imposed")
    assert {"J", "D", *TRUTH} <= set(problem.sites)
    assert [run.unit for run in problem.runs] == ["m", "N"]


def test_a_coasting_wheels_speed_is_its_first_reading() -> None:
    about = HEAD.replace("PROTOCOL", "free") + 'position = "w"\nposition_unit = "rad/s"\n'
    run = read({"t": TIME, "w": 9.0 - 0.3 * TIME}, about + '[element_a]\nkind = "none"\n')
    own = {name for name in pose([run]).sites if name.startswith("fast.")}
    assert own - {"fast.noise", "fast.discrepancy", "fast.correlation_time"} == {"fast.start"}


def test_a_held_element_needs_no_position() -> None:
    about = HEAD.replace("PROTOCOL", "imposed") + 'force = "f"\n' + SPRING
    run = read({"t": TIME, "f": 2.0 + 0.01 * np.sin(TIME)}, about)
    assert set(run.coordinate) == {0.0}
    assert pose([run]).layout.regimes == ("imposed",)


@pytest.mark.parametrize(
    ("protocol", "line", "told"),
    [
        ("free", "", "columns.position: missing"),
        ("imposed", 'position = "x"\nposition_unit = "m"\n', "columns.force: missing"),
        ("imposed", 'force = "f"\nforce_unit = "N*m"\n', "columns.force_unit: .*does not fit"),
    ],
)
def test_what_is_missing_is_said(protocol: str, line: str, told: str) -> None:
    if protocol == "free":
        line = 'force = "f"\n'
    with pytest.raises(RunError, match=told):
        read({"t": TIME, "x": TIME, "f": TIME}, HEAD.replace("PROTOCOL", protocol) + line + SPRING)


@pytest.mark.slow
def test_the_rate_of_a_pendulum_tells_what_its_angle_tells() -> None:
    """A pendulum by closed form: small swings, viscous damping."""
    inertia, moment = 4e-3, 0.3
    inner = np.sqrt(moment / inertia - 0.5**2)
    time = np.arange(0.0, 6.0, 0.01)
    swing = 0.05 * np.exp(-0.5 * time)
    speed = -swing * (inner + 0.25 / inner) * np.sin(inner * time)
    speed += 1e-3 * np.random.default_rng(1).standard_normal(time.size)
    about = HEAD.replace("PROTOCOL", "free") + 'position = "w"\nposition_unit = "rad/s"\n'
    run = read({"t": time, "w": speed}, about + f'[element_a]\nkind = "arm"\nmoment = {moment}\n')
    assert run.measured == "velocity"
    posterior = mb.fit([run], "linear", effort="quick", progress=False)
    found = summarise(posterior)
    assert found["explained"], found["unexplained"]
    assert found["parameters"]["J"]["mean"] == pytest.approx(inertia, rel=5e-3)
    assert found["parameters"]["D"]["mean"] == pytest.approx(2 * 0.5 * inertia, rel=0.03)


@pytest.mark.slow
def test_a_static_curve_needs_no_time() -> None:
    """Force against extension, in any order of the rows: a spring without damping."""
    x = np.random.default_rng(2).uniform(0.0, 0.05, 40)
    force = 2.0 + 300.0 * x + 0.05 * np.random.default_rng(3).standard_normal(x.size)
    about = 'format = 1\nprotocol = "imposed"\norigin = "synthetic"\n[log]\nsample_rate = 1.0\n'
    about += '[columns]\nposition = "x"\nposition_unit = "m"\nforce = "f"\n'
    run = read({"x": x, "f": force}, about + SPRING + "damping = 0.0\n")
    found = summarise(mb.fit([run], effort="quick", progress=False))["parameters"]
    assert abs(found["element_a.rate"]["mean"] - 300.0) < 4.0 * found["element_a.rate"]["sd"]
    assert found["element_a.rate"]["sd"] < 3.0


def test_a_thermometer_beside_a_heater_is_explained() -> None:
    """dT/dt = 0.9 P - (T - 25) / 30 in small steps of its own; the thermometer is read late."""
    time, heat = np.arange(0.0, 120.0, 0.1), [25.0]
    power = np.where(np.mod(time, 60.0) < 30.0, 1.5, 0.2)
    for watts in power[:-1].repeat(10):
        heat.append(heat[-1] + 0.01 * (0.9 * watts - (heat[-1] - 25.0) / 30.0))
    seen = np.interp(time - 0.7, time, heat[::10]) + 0.1 * np.random.default_rng(1).normal(
        size=1200
    )
    about = (
        HEAD.replace("PROTOCOL", "imposed") + 'force = "f"\npower_a = "p"\ntemperature_a = "c"\n'
    )
    about += (
        '[fixture]\nmotion = "linear"\n[thermometer]\ndelay = 0.7\n[element_a]\nkind = "muscle"\n'
    )
    about += 'linkage = "straight"\nbase_length = 0.1\nlength_at_zero = 0.12\n'
    run = read({"t": time, "f": 2.0 + 0.01 * np.sin(time), "p": power, "c": seen}, about)
    problem = pose([run])
    assert [one.name for one in problem.runs] == ["pull-force", "pull-temperature-a"]
    assert problem.layout.regimes == ("imposed", "heated")
    assert {"heater_a.heating_rate", "heater_a.cooling_time", "heated.noise"} <= set(problem.sites)
    assert "clock-offset.delay" not in problem.sites
    values = {
        name: np.asarray(site.prior.mean) * np.ones(site.prior.shape())
        for name, site in problem.sites.items()
    }
    values |= {"heater_a.heating_rate": np.asarray(0.9), "heater_a.cooling_time": np.asarray(30.0)}
    with jax.enable_x64(True):
        told = predictions(values, problem.layout, problem.data)[1].reading[0]
    lanes = problem.data.lanes[1]
    away = np.asarray(lanes.reading[0] - told)[np.asarray(lanes.weight[0]) > 0]
    assert np.sqrt(np.mean(away**2)) < 0.15


@pytest.mark.parametrize("left_out", ["", "offset = 0.0\n"])
def test_scales_do_not_need_what_acts_on_speed(left_out: str) -> None:
    about = HEAD.replace("PROTOCOL", "free") + 'position = "x"\nposition_unit = "m"\n'
    about += 'applied = "u"\napplied_unit = "V"\n[fixture]\nmotion = "linear"\n'
    about += '[element_a]\nkind = "none"\n[drive]\ngain = 1.8\n' + left_out
    voltage = 4.0 * np.sin(2.0 * TIME)
    run = read({"t": TIME, "x": 0.05 * np.sin(2.0 * TIME), "u": voltage}, about)
    # The back-EMF is unknown, the force at rest is not: gain times the voltage's RMS.
    assert pose([run]).scales.force == pytest.approx(1.8 * np.sqrt(np.mean(voltage**2)), rel=1e-3)


def test_a_stated_mass_says_how_large_unknown_forces_are() -> None:
    about = HEAD.replace("PROTOCOL", "free") + 'position = "x"\nposition_unit = "m"\n'
    about += 'applied = "u"\napplied_unit = "V"\n' + SPRING.replace("[element_a]", "{}[element_a]")
    columns = {"t": TIME, "x": 0.05 * np.sin(2.0 * TIME), "u": np.sin(2.0 * TIME)}
    known, unknown = (
        pose([read(columns, about.format(line))]).scales.force for line in ("inertia = 0.6\n", "")
    )
    assert known == pytest.approx(200.0 * unknown)  # 3e-3 kg where none is stated
    assert known == pytest.approx(0.6 * 0.05 * 4.0, rel=1.0)


def test_muscles_without_a_load_pull_with_a_usual_tension() -> None:
    muscle = 'kind = "muscle"\nlinkage = "drum"\ndrum_radius = 0.012\nbase_length = 0.1\n'
    muscle += "length_at_zero = 0.11\n"
    about = HEAD.replace("PROTOCOL", "free") + 'position = "x"\nposition_unit = "rad"\n'
    about += f'temperature_a = "a"\n[element_a]\n{muscle}[element_b]\n{muscle}'
    columns = {"t": TIME, "x": 0.2 * np.sin(0.3 * TIME), "a": 50.0 + 20.0 * np.sin(0.3 * TIME)}
    size = pose([read(columns, about)]).scales
    assert size.force == pytest.approx(0.012 * size.tension)


def test_a_spring_of_unknown_damping_pulls() -> None:
    about = HEAD.replace("PROTOCOL", "free") + 'position = "x"\nposition_unit = "m"\n' + SPRING
    run = read({"t": TIME, "x": 0.05 * np.sin(2.0 * TIME)}, about + "rate = 300.0\n")
    assert pose([run]).scales.force == pytest.approx(300.0 * 0.05, rel=1e-2)


def test_a_command_holds_until_the_next_row() -> None:
    about = HEAD.replace("PROTOCOL", "free") + 'position = "x"\nposition_unit = "m"\n'
    about += 'applied = "u"\napplied_unit = "N"\n{held}[fixture]\nmotion = "linear"\n'
    about += '[element_a]\nkind = "none"\n'
    time = np.arange(0.0, 2.0, 0.02)
    columns = {"t": time, "x": 0.05 * np.sin(2.0 * time), "u": np.floor(10.0 * time)}
    forces = [read(columns, about.format(held=line)) for line in ("", "applied_held = true\n")]
    even, held = (fast_record(run).schedule for run in forces)
    middles = 0.5 * (held.time[1:] + held.time[:-1])
    row = np.searchsorted(time, middles) - 1
    np.testing.assert_allclose(held.applied, columns["u"][row], atol=1e-9)
    between = 0.5 * (columns["u"][row] + columns["u"][row + 1])
    np.testing.assert_allclose(even.applied, between, atol=1e-9)
