"""Runs that nothing pulls back are cut into segments, those that are held out, too."""

import numpy as np
import pytest

from muscle_bayes.data import Run, read_runs
from muscle_bayes.discovery.draws import Draws, predictions
from muscle_bayes.discovery.nominal import nominal

MASS, FRICTION, STEP = 8.0, 1.5, 2e-5
"""kg, N, m"""


def driven(phase: float, rng: np.random.Generator) -> str:
    """A carriage under a force that holds from row to row, by small explicit steps."""
    lines, x, v, fine = ["time_s,shown_m,force_n"], 0.0, 0.0, 40
    for row in range(1000):
        time = 0.004 * row
        force = round(20.0 * np.cos(3.0 * time + phase), 4)
        shown = STEP * round((x + 0.5 * STEP * rng.normal()) / STEP)
        lines.append(f"{time:.3f},{shown:.9g},{force}")
        for _ in range(fine):
            if v == 0.0 and abs(force) <= FRICTION:
                break
            way = np.sign(v) or np.sign(force)
            after = v + 0.004 / fine * (force - way * FRICTION) / MASS
            after = 0.0 if way * after < 0.0 else after
            x, v = x + 0.5 * 0.004 / fine * (v + after), after
    return "\n".join([*lines, ""])


@pytest.fixture
def runs(tmp_path) -> list[Run]:
    rng = np.random.default_rng(4)
    for number in range(3):
        (tmp_path / f"run-{number}.csv").write_text(driven(1.1 * number, rng))
        (tmp_path / f"run-{number}.toml").write_text(
            'format = 1\nprotocol = "free"\norigin = "synthetic"\n\n[columns]\ntime = "time_s"\n'
            'position = "shown_m"\nposition_unit = "m"\napplied = "force_n"\napplied_held = true\n'
            '\n[fixture]\nmotion = "linear"\n\n[element_a]\nkind = "none"\n'
        )
    return read_runs([tmp_path])


@pytest.mark.slow
def test_a_held_out_axis_is_predicted_to_its_noise(compiled_fast, runs) -> None:
    import jax

    with jax.enable_x64(True):
        search, base = nominal(runs, "coulomb", (), ["viscous-friction"], ["run-2"])
        found = predictions(search, base, Draws.laplace_of(base, 0, 60))
    error = STEP * np.sqrt(0.5**2 + 1.0 / 12.0)
    for one in found:
        rmse = np.sqrt(np.mean((one.model.mean(axis=0) - one.observed) ** 2))
        assert rmse < 1.15 * error, one.run
