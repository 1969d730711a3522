from pathlib import Path
from threading import Event

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.running.side_by_side import side_by_side
from muscle_bayes.inference.search.mode import find_mode

DATA = Path(__file__).parents[2] / "data" / "plain"


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_results_come_in_order(workers: int) -> None:
    assert list(side_by_side(lambda x: x * x, range(7), workers)) == [x * x for x in range(7)]


def test_items_are_computed_at_the_same_time() -> None:
    begun = [Event(), Event()]

    def meet(index: int) -> bool:
        begun[index].set()
        return begun[1 - index].wait(10.0)

    assert list(side_by_side(meet, range(2), 2)) == [True, True]


def test_nothing_is_begun_once_nothing_more_is_asked_for() -> None:
    begun: list[int] = []
    results = side_by_side(lambda x: begun.append(x), range(100), 2)
    next(results)
    results.close()
    assert len(begun) <= 3


def test_failures_reach_the_caller() -> None:
    with pytest.raises(ZeroDivisionError):
        list(side_by_side(lambda x: 1 / x, [1, 0, 1], 2))


@double_precision
def test_precision_is_the_callers() -> None:
    assert [one.dtype for one in side_by_side(jnp.zeros, [1, 2], 2)] == [jnp.float64] * 2
    with jax.enable_x64(False):
        assert [one.dtype for one in side_by_side(jnp.zeros, [1, 2], 2)] == [jnp.float32] * 2


@double_precision
def test_the_most_probable_point_does_not_depend_on_the_number_of_workers() -> None:
    problem = pose(read_runs([DATA / "spring-1.csv"]))
    one, two = (
        find_mode(jax.random.key(0), problem.layout, problem.data, workers=workers)
        for workers in (1, 2)
    )
    assert one.steps == two.steps
    np.testing.assert_array_equal(one.vector, two.vector)
    np.testing.assert_array_equal(one.information, two.information)
