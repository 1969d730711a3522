"""The sampler's kernels as compiled programs, made once for each layout and shapes of data."""

from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array

from muscle_bayes.inference.guided_kernel import GuidedState, guided_kernel_of
from muscle_bayes.inference.kernel import ChainState, Kernel, Transition, kernel_of
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program
from muscle_bayes.inference.surrogate import Surrogate, blank_surrogate
from muscle_bayes.inference.whitening import Whitening, blank


@Program
def _start(key: Array, white: Whitening, data: Data, layout: Layout) -> ChainState:
    return kernel_of(layout).start(key, white, data)


@Program
def _start_guided(key: Array, white: Whitening, data: Data, layout: Layout) -> GuidedState:
    return guided_kernel_of(layout).start(key, white, data)


@Program
def _advance_guided(
    state: GuidedState,
    white: Whitening,
    surrogate: Surrogate,
    data: Data,
    step: Array,
    count: Array,
    layout: Layout,
) -> tuple[GuidedState, Transition]:
    return guided_kernel_of(layout).advance(state, white, surrogate, data, step, count)


@Program
def _advance(
    state: ChainState, white: Whitening, data: Data, step: Array, count: Array, layout: Layout
) -> tuple[ChainState, Transition]:
    return kernel_of(layout).advance(state, white, data, step, count)


class Preparation:
    """Kernels of a layout and shapes of data; the guided one is traced at once.

    Compiling it can be left to another thread, tracing cannot: JAX traces the same function in two
    threads at once at its peril, and tracing holds Python's lock.
    """

    def __init__(self, layout: Layout, data: Data) -> None:
        self._layout, self._data = layout, data
        self._step, self._count = jnp.asarray(0.0), jnp.asarray(0)
        key, white = jax.random.key(0), blank(layout)
        state = jax.eval_shape(guided_kernel_of(layout).start, key, white, data)
        surrogate = blank_surrogate(state.predicted, layout)
        self._guided = Kernel(
            _start_guided.lower(key, white, data, layout),
            _advance_guided.lower(state, white, surrogate, data, self._step, self._count, layout),
        )

    @cached_property
    def guided(self) -> Kernel:
        """The kernel along a surrogate, compiled."""
        with jax.enable_x64(True):
            return Kernel(*(one.compile() for one in self._guided))

    @cached_property
    def kernel(self) -> Kernel:
        """The kernel along the model itself, traced and compiled."""
        layout, data = self._layout, self._data
        with jax.enable_x64(True):
            key, white = jax.random.key(0), blank(layout)
            state = jax.eval_shape(kernel_of(layout).start, key, white, data)
            start = _start.lower(key, white, data, layout)
            advance = _advance.lower(state, white, data, self._step, self._count, layout)
            return Kernel(start.compile(), advance.compile())


_PREPARED: dict[Any, Preparation] = {}


def prepare(layout: Layout, data: Data) -> Preparation:
    """The preparation for data of this layout and these shapes, made once in a session."""
    leaves, structure = jax.tree.flatten(data)
    shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
    known = (layout, structure, shapes)
    if known not in _PREPARED:
        _PREPARED[known] = Preparation(layout, data)
    return _PREPARED[known]
