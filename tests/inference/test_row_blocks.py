"""Any number of rows goes through a program of one shape, and comes back as if each went alone."""

import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.inference.row_blocks import BLOCK, in_blocks


@pytest.mark.parametrize("count", [1, BLOCK - 1, BLOCK, 2 * BLOCK + 3])
def test_every_row_comes_back_once_and_in_order(count):
    shapes = []

    def program(rows, factor):
        shapes.append(rows.shape)
        return jnp.stack([factor * rows[:, 0], rows.sum(axis=1)], axis=1)

    rows = np.arange(3.0 * count).reshape(count, 3)
    found = in_blocks(program, rows, 2.0)
    np.testing.assert_allclose(found, np.stack([2.0 * rows[:, 0], rows.sum(axis=1)], axis=1))
    assert set(shapes) == {(BLOCK, 3)}
