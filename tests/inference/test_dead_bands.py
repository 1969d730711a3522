"""Runs that begin at an edge of their dead band: bands and coordinates are told as the model has them."""

from pathlib import Path

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference import first_edges, whitening_at_mode, whitening_of_draws
from muscle_bayes.inference.bend_hyst import starts
from muscle_bayes.inference.bent_rows import bent_rows, unbent_rows
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.dead_bands import START, ZERO, fitted_bands
from muscle_bayes.inference.first_edges import Frame, squeeze_at
from muscle_bayes.inference.optimise import find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.preparation import prepare
from muscle_bayes.inference.problem import pose
from muscle_bayes.inference.programs import predictions_at
from muscle_bayes.inference.sampler import Effort, draw
from muscle_bayes.inference.whitening_at_mode import whitening

DATA = Path(__file__).parents[2] / "data"
TOLD = 0.1
"""How well readings tell a start inside its dead band, in its prior standard deviations."""
LOWER = -6.77
"""Where the run's dead band ends below its start, in the start's prior standard deviations."""


@pytest.fixture(scope="module")
def fitted():
    with jax.enable_x64(True):
        problem = pose(read_runs([DATA / "staircase-166g.csv"]))
        mode = find_mode(jax.random.key(0), problem.layout, problem.data)
        return problem, mode, whitening(mode, problem.layout, problem.data)


class Edge:
    """Points of the posterior, but for starts about the dead band's lower edge."""

    def __init__(self, fitted, middle: float) -> None:
        problem, _, white = fitted
        self.layout, self.data = problem.layout, problem.data
        self.inner, self.outer, _ = blocks(self.layout)
        self.place = starts(self.layout)[START]
        self.spread = float(self.data.priors[START].scale[0])
        self.bend = white.bend
        factor = np.asarray(white.factor)
        points = np.tile(np.asarray(white.centre), (80, 1))
        points[:, self.inner] += (
            np.random.default_rng(1).standard_normal((80, len(factor))) @ factor.T
        )
        self.vectors = unbent_rows(points, self.bend, self.layout, self.data)
        offsets = middle + np.random.default_rng(2).uniform(-2.0, 2.0, 80)
        self.vectors[:, self.place] += (LOWER + offsets) * self.spread
        self.bent = bent_rows(self.vectors, self.bend, self.layout, self.data)
        scale = np.diag(np.maximum(self.bent[:, self.inner].std(axis=0), 1e-9))
        self.frame = Frame(self.bent.mean(axis=0), scale, self.inner, self.outer)
        self.x = self.frame.of(self.bent)

    def first_reading(self, vector: np.ndarray) -> float:
        """As the model has it."""
        (found,) = predictions_at(jnp.asarray(vector), self.layout, self.data)
        return float(found.reading[0, 0] + vector[starts(self.layout)[ZERO]])

    def slid(self) -> np.ndarray:
        """By how much the model's rotor is above its start in the first reading."""
        return np.array([self.first_reading(one) for one in self.vectors]) - self.start

    @property
    def start(self) -> np.ndarray:
        return self.vectors[:, self.place]


@double_precision
def test_a_band_holds_the_first_reading_where_the_model_does(fitted):
    edge = Edge(fitted, 0.0)
    (band,) = fitted_bands(edge.x, edge.vectors, edge.layout, edge.data)
    zero = edge.vectors[:, starts(edge.layout)[ZERO]]
    held = np.array([float(band.at(jnp.asarray(x))[0, 0]) for x in edge.x]) + zero - edge.start
    slid = edge.slid()
    below = slid > 0.05
    assert 10 < below.sum() < 70
    np.testing.assert_allclose(held, slid, atol=0.05)
    # Once the band has closed, a run has forgotten where it began.
    counts = np.asarray(band.start.middle)[0] != 0.0
    assert counts[0]
    assert not counts[-1]


@pytest.mark.parametrize(("middle", "inside"), [(-0.5, False), (0.5, True)])
@double_precision
def test_a_start_is_squeezed_inside_its_edge_as_far_as_readings_tell_it(
    fitted, middle, inside, monkeypatch
):
    edge = Edge(fitted, middle)
    central = edge.vectors[np.argmin((edge.x**2).sum(axis=1))].copy()
    central[edge.place] -= 10.0 * edge.spread
    lowest = edge.first_reading(central)

    def energy(vector, layout, data):
        """Readings tell where the rotor rests to a tenth of what the first row tells its start."""
        return 0.5 * ((edge.first_reading(vector) - lowest) / (TOLD * edge.spread)) ** 2

    monkeypatch.setattr(first_edges, "potential_at", energy)
    squeeze = squeeze_at(edge.x, edge.vectors, edge.frame, edge.layout, edge.data)
    beyond = np.asarray(squeeze.offset[0] + edge.bent @ squeeze.slope[0])
    slid = edge.slid()
    passed = slid > 0.05
    assert 10 < passed.sum() < 70
    np.testing.assert_allclose(beyond[passed], slid[passed], atol=0.05)
    assert np.all(beyond[slid < 1e-6] < 0.05)
    direction = np.asarray(squeeze.direction[0])
    np.testing.assert_allclose(squeeze.slope[0] @ direction, 1.0, rtol=1e-9)
    assert set(np.flatnonzero(direction)) == {edge.place}
    ratio = float(squeeze.ratio[0])
    # The depth from which the energy has risen by a half, on a grid of steps of 1.43.
    assert TOLD / 1.45 <= ratio <= 1.45 * TOLD
    assert float(squeeze.scale[0]) == (ratio if inside else 1.0)
    # The upper edge lies far away: nothing is squeezed there.
    assert float(squeeze.ratio[1]) == 1.0
    np.testing.assert_array_equal(squeeze.direction[1], 0.0)


@pytest.mark.slow
@double_precision
def test_squeezed_coordinates_change_no_draw_s_distribution(fitted, monkeypatch):
    """Also where there is no edge: the start is squeezed amid its posterior."""
    problem, mode, _ = fitted
    layout, data = problem.layout, problem.data
    place = starts(layout)[START]
    effort = Effort(warmup=150, draws=500, min_ess=600, rounds=12)

    def drawn(seed: int) -> np.ndarray:
        preparation = prepare(layout, data)
        return draw(jax.random.key(seed), mode, preparation, layout, data, effort).vector

    plain = drawn(3)

    def amid(x, vectors, frame, layout, data):
        squeeze = squeeze_at(x, vectors, frame, layout, data)
        assert np.all(np.asarray(squeeze.ratio) == 1.0)
        entry = jnp.zeros(mode.vector.size).at[place].set(1.0)
        return squeeze._replace(
            offset=squeeze.offset.at[0].set(-plain[..., place].mean()),
            slope=squeeze.slope.at[0].set(entry),
            direction=squeeze.direction.at[0].set(entry),
            ratio=squeeze.ratio.at[0].set(0.2),
            width=squeeze.width.at[0].set(0.2 * plain[..., place].std()),
        )

    for module in (whitening_at_mode, whitening_of_draws):
        monkeypatch.setattr(module, "squeeze_at", amid)
    other = drawn(4)
    trees = [az.convert_to_datatree({"v": one}) for one in (plain, other)]
    error = np.hypot(*(az.mcse(tree)["v"].values for tree in trees))
    away = (other.mean(axis=(0, 1)) - plain.mean(axis=(0, 1))) / error
    np.testing.assert_array_less(np.abs(away), 4.5)
    np.testing.assert_allclose(other[..., place].std() / plain[..., place].std(), 1.0, atol=0.15)
