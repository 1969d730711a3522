"""Where friction holds the start of a run: the surrogate's kinks are the model's."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.bend_hyst import starts
from muscle_bayes.inference.bent_rows import bent_rows
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.dead_bands import START, starts_of
from muscle_bayes.inference.first_edges import Frame
from muscle_bayes.inference.optimise import find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import pose
from muscle_bayes.inference.programs import predictions_at
from muscle_bayes.inference.surrogate import first_surrogate
from muscle_bayes.inference.whitening import whitening

DATA = Path(__file__).parents[2] / "data"


@pytest.fixture(scope="module")
def fitted():
    with jax.enable_x64(True):
        problem = pose(read_runs([DATA / "staircase-166g.csv"]))
        mode = find_mode(jax.random.key(0), problem.layout, problem.data)
        return problem, mode, whitening(mode, problem.layout, problem.data)


@double_precision
def test_readings_stay_at_the_start_until_its_dead_band_has_moved_there(fitted):
    """Of a rotor put below, inside and above its first dead band."""
    problem, mode, white = fitted
    layout, data = problem.layout, problem.data
    found = first_surrogate(jax.random.key(1), white, layout, data)
    inner, outer, _ = blocks(layout)
    frame = Frame(np.asarray(white.centre), np.asarray(white.factor), inner, outer)
    place = starts(layout)[START]
    spread = float(data.priors[START].scale[0])
    middle = np.asarray(mode.vector)

    def x_of(vector: np.ndarray) -> jnp.ndarray:
        return jnp.asarray(frame.of(bent_rows(vector[None], white.bend, layout, data))[0])

    band = found.bands[0]
    low, high = (float(line.at(x_of(middle))[0, 0]) for line in (band.low, band.high))
    start = float(starts_of(middle, layout, data)[0][0])
    assert low < high
    inside = middle.copy()
    inside[place] += np.clip(0.5 * (low + high), start - 2 * spread, start + 2 * spread) - start
    for moved in (0.0, -0.3, 0.3):
        vector = inside.copy()
        vector[place] += moved * spread
        exact = predictions_at(jnp.asarray(vector), layout, data)[0].reading[0]
        seen = found.at(x_of(vector))[0].reading[0]
        np.testing.assert_allclose(seen, exact, atol=0.15)
    held = np.asarray(band.start.middle)[0] != 0.0
    assert held[0]
    assert not held[-1]
    np.testing.assert_allclose(np.asarray(band.low.middle)[0][~held], 0.0)
