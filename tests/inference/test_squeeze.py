"""Coordinates for a start at an edge of its dead band: an exact change of variables."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import Layout
from muscle_bayes.inference.squeeze import Squeeze, squeezed, unsqueezed

SIZE = 4
# Two edges of one start, entry 2: a lower one told by a wide start, an upper one by a narrow one.
SLOPE = np.array([[0.5, -0.2, -0.9, 0.0], [0.1, 0.7, 1.1, 0.0]])
DIRECTION = np.zeros((2, SIZE))
DIRECTION[:, 2] = 1.0 / SLOPE[:, 2]
RATIO = np.array([0.05, 0.2])
SQUEEZE = Squeeze(
    offset=np.array([0.3, -0.4]),
    slope=SLOPE,
    direction=DIRECTION,
    ratio=RATIO,
    width=np.array([0.2, 0.3]),
    scale=np.array([1.0, RATIO[1]]),
)


def distance(x: np.ndarray, edge: int) -> float:
    return float(SQUEEZE.offset[edge] + SLOPE[edge] @ x)


@pytest.mark.parametrize("seed", range(4))
@double_precision
def test_it_is_undone_and_its_volume_is_that_of_the_jacobian(seed):
    y = jnp.asarray(2.0 * np.random.default_rng(seed).standard_normal(SIZE))
    there = unsqueezed(y, SQUEEZE)
    np.testing.assert_allclose(squeezed(there.bent, SQUEEZE), y, rtol=1e-9, atol=1e-9)
    jacobian = jax.jacfwd(lambda y: unsqueezed(y, SQUEEZE).bent)(y)
    sign, log_volume = np.linalg.slogdet(jacobian)
    assert sign == 1.0
    np.testing.assert_allclose(there.log_volume, log_volume, rtol=1e-9)


@double_precision
def test_many_points_are_squeezed_as_one_is():
    y = jnp.asarray(np.random.default_rng(5).standard_normal((3, SIZE)))
    rows = unsqueezed(y, SQUEEZE)
    for index, one in enumerate(y):
        np.testing.assert_allclose(rows.bent[index], unsqueezed(one, SQUEEZE).bent, rtol=1e-12)
    np.testing.assert_allclose(squeezed(rows.bent, SQUEEZE), y, rtol=1e-9, atol=1e-9)


@double_precision
def test_distances_are_kept_far_beyond_an_edge_and_squeezed_far_inside():
    lower = Squeeze(*(part[:1] for part in SQUEEZE))
    for far, share in ((50.0, 1.0), (-50.0, RATIO[0])):
        y = (far - float(lower.offset[0])) * DIRECTION[0]
        found = distance(np.asarray(unsqueezed(jnp.asarray(y), lower).bent), 0)
        np.testing.assert_allclose(found, share * far, rtol=1e-3)


@double_precision
def test_without_edges_nothing_changes():
    layout = Layout("coulomb", (), ("slow",), (False,), (("slow.start", (2,)), ("D", ())))
    y = jnp.asarray([1.0, -2.0, 0.5])
    there = unsqueezed(y, Squeeze.none(layout))
    np.testing.assert_array_equal(there.bent, y)
    assert there.log_volume == 0.0
