"""The trial's other rigs move as a general solver says."""

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from benchmarks.trial.other_rigs import HELD, HIDDEN, RIGS, hidden_effect, other_runs
from muscle_bayes.data import read_runs

KICK = 1.0
"""Seconds that are compared."""


@pytest.mark.parametrize("make", RIGS)
@pytest.mark.parametrize("name", ["viscous-friction", "stribeck-friction"])
def test_a_run_is_what_a_general_solver_gives(make, name):
    rng = np.random.default_rng(3)
    rig = make(rng)
    effect = hidden_effect(name, rig, 1.0)
    log, _ = other_runs(rig, [effect], rng)["run-1"]
    table = pd.DataFrame([line.split(",") for line in log.split()[1:]], dtype=float)
    time, shown = table[0].to_numpy(), table[1].to_numpy()
    known = np.zeros(time.size) if rig.drive is None else rig.drive[0]

    def slope(t, y):
        force = known[min(int(t / rig.period + 1e-9), known.size - 1)]
        pull = rig.pull(y[0]) + force + effect.extra_torque(y[0], y[1])
        dry = effect.dry_friction(rig.dry, abs(y[1]), 0.0, y[0])
        return [y[1], (pull - dry * np.tanh(y[1] / (1e-4 * rig.speed))) / rig.inertia]

    begin = [rig.starts[0], 0.0]
    found = solve_ivp(
        slope, (0.0, KICK), begin, "LSODA", rtol=1e-8, atol=1e-10, max_step=rig.period
    )
    exact = np.interp(time[time <= KICK], found.t, found.y[0])
    away = np.abs(shown[time <= KICK] - exact)
    assert away.max() < rig.step + 5.0 * rig.noise + 2e-4 * rig.reach


@pytest.mark.parametrize("make", RIGS)
def test_logs_are_read(make, tmp_path):
    rng = np.random.default_rng(1)
    rig = make(rng)
    for name, (log, metadata) in other_runs(rig, [], rng).items():
        (tmp_path / f"{name}.csv").write_text(log)
        (tmp_path / f"{name}.toml").write_text(metadata)
    runs = read_runs([tmp_path])
    assert len(runs) == len(rig.starts)
    assert HELD in {run.name for run in runs}
    assert {len(run.table) for run in runs} == {rig.rows}
    assert {run.unit for run in runs} == {rig.unit}


@pytest.mark.parametrize("name", HIDDEN)
def test_what_is_hidden_is_in_proportion_to_the_rig(name):
    rng = np.random.default_rng(2)
    rig = RIGS[0](rng)
    assert hidden_effect(name, rig, 2.0) != hidden_effect(name, rig, 1.0)
