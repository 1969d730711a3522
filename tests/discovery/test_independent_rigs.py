"""Names, and none, of rigs that a general solver simulated: nothing of the twin is in them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.discover import discover

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

STEP = 1.53e-3
"""Of the encoder, rad."""
MOMENT, INERTIA, DRY = 0.44, 7.5e-3, 4e-3
PENDULUM = """format = 1
protocol = "free"
origin = "synthetic"
[columns]
time = "s"
position = "angle"
position_unit = "rad"
[element_a]
kind = "arm"
mass = 0.3
centre_distance = 0.15
"""


def swings(begin: float, drag: float, time: np.ndarray) -> np.ndarray:
    """From rest at `begin` to rest: half swings, each under friction of one sign."""

    def turns(t: float, y: np.ndarray) -> float:
        return y[1]

    angle, t, q = np.empty(time.size), 0.0, begin
    while t < time[-1] and abs(MOMENT * np.sin(q)) > DRY:
        way = -np.sign(q)

        def slope(t: float, y: np.ndarray, way: float = way) -> list[float]:
            drive = -MOMENT * np.sin(y[0]) - way * DRY - drag * abs(y[1]) * y[1]
            return [y[1], drive / INERTIA]

        turns.terminal, turns.direction = True, -way
        half = solve_ivp(slope, (t, t + 2.0), [q, way * 1e-9], events=turns, rtol=1e-9, atol=1e-11,
                         dense_output=True)  # fmt: skip
        inside = (time >= t) & (time <= half.t[-1])
        angle[inside] = half.sol(time[inside])[0]
        t, q = float(half.t[-1]), float(half.y[0, -1])
    angle[time >= t] = q
    return angle


@pytest.mark.parametrize(("drag", "said"), [(0.0, "none"), (6e-4, "quadratic-drag")])
def test_a_pendulum_in_air(tmp_path: Path, drag: float, said: str) -> None:
    rng, time = np.random.default_rng(5), np.arange(0.0, 8.0, 4e-3)
    for number, begin in enumerate((1.3, -1.0, 0.7)):
        angle = swings(begin, drag, time) + 7e-4 * rng.standard_normal(time.size)
        rows = np.stack([time, STEP * np.round(angle / STEP)], 1)
        name = tmp_path / f"fall-{number}.csv"
        np.savetxt(name, rows, "%.6f", delimiter=",", header="s,angle", comments="")
        name.with_suffix(".toml").write_text(PENDULUM)
    found = discover(read_runs([tmp_path]))
    assert found.verdict == said or (found.steps and said in found.steps[0].tie)
