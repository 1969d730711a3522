"""A schedule as a path: linear temperatures, jumps with both their limits, and its segments."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.physics.schedule import Schedule

NODES = np.array([0.0, 1.0, 1.5, 1.5, 4.0])
PATH = (NODES, [20.0, 30.0, 25.0, 25.0, 50.0], [0.1, 0.2, 9.0, 0.3], [0.0, -1.0, 7.0, 2.0])


def path() -> Schedule:
    return Schedule.sampled(*PATH)


@pytest.mark.parametrize(
    ("time", "left", "temperature", "load", "applied"),
    [
        (0.5, True, 25.0, 0.1, 0.0),
        (1.0, True, 30.0, 0.1, 0.0),
        (1.0, False, 30.0, 0.2, -1.0),
        (1.25, False, 27.5, 0.2, -1.0),
        (1.5, True, 25.0, 0.2, -1.0),
        (1.5, False, 25.0, 0.3, 2.0),
        (2.75, True, 37.5, 0.3, 2.0),
        (4.0, False, 50.0, 0.3, 2.0),
        (-1.0, True, 20.0, 0.1, 0.0),
        (9.0, True, 50.0, 0.3, 2.0),
    ],
)
def test_values_and_limits(time, left, temperature, load, applied):
    at = path().evaluate(jnp.asarray(time), left=left)
    np.testing.assert_allclose(at.temperature, temperature, rtol=1e-15)
    assert (float(at.load), float(at.applied)) == (load, applied)


def test_increments_and_derivatives():
    change = path().evaluate(jnp.asarray(0.5), jnp.asarray(2.75))
    np.testing.assert_allclose(change.temperature, 12.5)
    assert float(change.load) == pytest.approx(0.2)
    rate = path().derivative(jnp.asarray(2.0))
    np.testing.assert_allclose(rate.temperature, 10.0)
    assert float(rate.load) == 0.0
    np.testing.assert_array_equal(path().jump_ts, NODES[1:-1])


@pytest.mark.parametrize("near", [None, 0, 1, 2, 3])
@pytest.mark.parametrize("ends", [(0.0, 1.0), (0.2, 0.4), (1.0, 1.5), (1.5, 2.0), (2.0, 4.0)])
def test_a_segment_is_the_path_over_its_step_wherever_it_is_looked_for(ends, near):
    begin, end = map(jnp.asarray, ends)
    place = None if near is None else jnp.asarray(near, jnp.int32)
    part = jax.jit(lambda: path().segment(begin, end, place))()
    assert (part.t0, part.t1) == ends
    for share in (0.0, 0.3, 1.0):
        t = begin + share * (end - begin)
        ours, whole = part.evaluate(t), path().evaluate(t, left=share > 0.0)
        np.testing.assert_allclose(ours.temperature, whole.temperature, rtol=1e-14)
        assert ours.load == path().evaluate(begin, left=False).load
    change = part.evaluate(begin, end)
    np.testing.assert_allclose(change.temperature, part.temperature_rate * (end - begin))


def test_a_step_of_no_length_has_a_segment():
    part = path().segment(jnp.asarray(1.5), jnp.asarray(1.5))
    assert np.isfinite(part.evaluate(jnp.asarray(1.5)).temperature).all()
    np.testing.assert_array_equal(part.temperature_rate, 0.0)


def test_one_number_or_course_serves_both_sides():
    one = Schedule.sampled([0.0, 1.0, 2.0], 40.0, 0.1)
    np.testing.assert_array_equal(one.temperature, np.full((3, 2), 40.0))
    np.testing.assert_array_equal(one.load, [0.1, 0.1])
    both = np.array([[20.0, 30.0], [21.0, 30.0]])
    np.testing.assert_array_equal(Schedule.sampled([0.0, 1.0], both).temperature, both)
