"""An axis that nothing pulls back: its record is cut into segments, each start integrated out."""

from collections.abc import Iterator
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_run
from muscle_bayes.discovery.discover import discover
from muscle_bayes.inference.model.density import constrain, explained
from muscle_bayes.inference.model.lane_model import predictions
from muscle_bayes.inference.model.problem import Data, Problem, pose
from muscle_bayes.inference.running.programs import potential_at
from muscle_bayes.inference.search.mode import Mode, find_mode
from muscle_bayes.inference.search.pivots import pivoted

pytestmark = pytest.mark.slow

MASS, DRY, VISCOUS, OFFSET = 95.0, 20.0, 200.0, 3.0
TRUTH = {
    "J": MASS,
    "D": DRY,
    "viscous-friction.coefficient": VISCOUS,
    "bias-torque.torque": OFFSET,
}
NOISE = 3e-6
"""Of the logged position, m."""
DURATION = 3.0
METADATA = """
format = 1
protocol = "free"
origin = "synthetic"
[columns]
time = "time_s"
position = "position_m"
position_unit = "m"
applied = "force_n"
[fixture]
motion = "linear"
[element_a]
kind = "none"
[element_b]
kind = "none"
"""


def _force(time: np.ndarray) -> np.ndarray:
    return 60.0 * np.sin(2.0 * np.pi * 1.3 * time) + 25.0 * np.sin(2.0 * np.pi * 3.1 * time + 1.0)


def _positions(step: float, every: int) -> tuple[np.ndarray, np.ndarray]:
    """Time stepping with dry friction taken implicitly: it stops the axis, never reverses it."""
    time = np.arange(round(DURATION / step) + 1) * step
    middle = _force(time[:-1] + 0.5 * step)
    position, speed, result = 0.0, 0.0, [0.0]
    for force in middle:
        free = speed + step * (force + OFFSET - VISCOUS * speed) / MASS
        change = step * DRY / MASS
        after = np.sign(free) * max(abs(free) - change, 0.0)
        position += 0.5 * step * (speed + after)
        speed = after
        result.append(position)
    return time[::every], np.array(result[::every])


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    folder = tmp_path_factory.mktemp("axis")
    time, position = _positions(2e-5, 50)
    position = position + NOISE * np.random.default_rng(1).normal(size=time.size)
    rows = np.stack([time, position, _force(time)], 1)
    np.savetxt(
        folder / "axis.csv",
        rows,
        "%.9g",
        delimiter=",",
        header="time_s,position_m,force_n",
        comments="",
    )
    Path(folder / "axis.toml").write_text(METADATA)
    with jax.enable_x64(True):
        return pose([read_run(folder / "axis.csv")], "coulomb", ("viscous-friction", "bias-torque"))


@pytest.fixture(scope="module")
def mode(axis: Problem) -> Iterator[Mode]:
    with jax.enable_x64(True):
        yield find_mode(jax.random.key(0), axis.layout, axis.data)


@pytest.fixture(scope="module")
def centred(axis: Problem, mode: Mode) -> Data:
    """The data with pivots at the most probable starts."""
    with jax.enable_x64(True):
        return pivoted(mode.vector, axis.layout, axis.data)


def test_an_independent_integrators_values_are_found(axis: Problem, mode: Mode) -> None:
    assert axis.layout.segmented == (True,)
    values = constrain(mode.vector, axis.layout, axis.data)
    sd = np.sqrt(np.diag(np.linalg.inv(mode.information)))
    for index, (name, truth) in enumerate(TRUTH.items()):
        assert axis.layout.shapes[index] == (name, ())
        above = constrain(mode.vector.at[index].add(sd[index]), axis.layout, axis.data)
        spread = abs(above[name] - values[name])
        assert abs(values[name] - truth) < 4.0 * spread, name
        assert spread < 0.05 * abs(truth), name


def test_starts_are_integrated_out(axis: Problem, mode: Mode, centred: Data) -> None:
    """Quadrature over position and speed of the start, with the motion solved anew from each."""
    values = constrain(mode.vector, axis.layout, axis.data)
    (lanes,) = centred.lanes
    predicted = predictions(values, axis.layout, centred)
    linear = explained(predicted, values, axis.layout, centred)[0].log_density.sum(1)
    # A start known exactly is integrated out by doing nothing.
    exact = lanes._replace(start_spread=1e-9 * lanes.start_spread)

    def given(offset):
        start = lanes.start + offset * lanes.start_spread
        moved = exact._replace(start=start, pivot=start)
        data = axis.data._replace(lanes=(moved,))
        predicted = predictions(values, axis.layout, data)
        log_prior = -0.5 * (offset**2).sum(1) - jnp.log(2.0 * jnp.pi)
        return explained(predicted, values, axis.layout, data)[0].log_density.sum(1) + log_prior

    # Readings tell a start far better than its prior: the grid need not span all of that.
    reach, size = 0.8, 161
    nodes = jnp.linspace(-reach, reach, size)
    grid = jnp.stack(jnp.meshgrid(nodes, nodes), -1).reshape(-1, 1, 2)
    middle = (lanes.pivot - lanes.start) / lanes.start_spread
    logs = jax.lax.map(lambda node: given(middle + node), grid, batch_size=64)
    cell = 2.0 * jnp.log(2.0 * reach / (size - 1))
    whole = jax.scipy.special.logsumexp(logs, axis=0) + cell
    np.testing.assert_allclose(linear, whole, atol=0.15)


def test_density_does_not_jump_where_sticking_comes_and_goes(
    axis: Problem, mode: Mode, centred: Data
) -> None:
    """Along every principal direction of the physical parameters."""
    size = len(TRUTH)
    factor = np.linalg.cholesky(np.linalg.inv(mode.information[:size, :size]))
    nodes = np.linspace(-3.0, 3.0, 121)
    for direction in factor.T:
        values = np.array(
            [
                potential_at(mode.vector.at[:size].add(node * direction), axis.layout, centred)
                for node in nodes
            ]
        )
        # A smooth density bends by the square of the spacing, a jump shows whole.
        assert np.abs(np.diff(values, 2)).max() < 0.05, direction


def test_every_effect_that_discovery_adds_shrinks_the_gap(axis: Problem) -> None:
    """From Coulomb friction alone, segments begin elsewhere than with what is missing."""
    found = discover(axis.runs, candidates=("viscous-friction", "bias-torque"))
    assert {step.added for step in found.steps} == {"viscous-friction", "bias-torque"}
    gaps = [found.nominal, *(step.after for step in found.steps)]
    rmse = [judged.checks["axis"].rmse for judged in gaps]
    assert rmse[0] > rmse[1] > rmse[2]
    assert rmse[2] < 1.2 * NOISE
