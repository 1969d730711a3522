"""Linear algebra on one thread."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from muscle_bayes.inference.running.blas import one_blas_thread


def blas_threads() -> list[int]:
    np.eye(2) @ np.eye(2)
    return [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]


@one_blas_thread
def threads_inside(fail: bool = False) -> list[int]:
    if fail:
        raise ValueError("as asked")
    return blas_threads()


def test_one_thread_inside_and_as_before_afterwards() -> None:
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        assert set(threads_inside()) == {1}
        assert blas_threads() == before
        with pytest.raises(ValueError, match="as asked"):
            threads_inside(fail=True)
        assert blas_threads() == before
