"""Independent computations on several threads: compiled programs hold no lock of Python's."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import jax


def side_by_side[T, R](function: Callable[[T], R], items: Iterable[T], workers: int) -> Iterator[R]:
    """`function` of each item, in order; up to `workers` are computed ahead of what was asked for.

    Once nothing more is asked for, none is begun. One worker is the caller's thread.
    """
    if workers == 1:
        yield from map(function, items)
        return

    def computed(item: T) -> R:
        # Worker threads do not inherit the caller's precision.
        with jax.enable_x64(precise):
            return function(item)

    precise = jax.config.jax_enable_x64
    pool = ThreadPoolExecutor(workers)
    ahead: deque[Future[R]] = deque()
    try:
        for item in items:
            ahead.append(pool.submit(computed, item))
            if len(ahead) == workers:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
