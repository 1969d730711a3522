"""One law, many draws, one scenario at a time: on all cores, several draws side by side on each.

On a CPU programs are compiled for one batch, so that banks of any size share them.
"""

import os
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.control.closed_loop import Clock, simulate, start_of
from muscle_bayes.control.cost import Cost
from muscle_bayes.control.draws import JointDraws
from muscle_bayes.control.laws.law import Law
from muscle_bayes.control.metrics import Metrics, metrics
from muscle_bayes.control.rotor import Motion
from muscle_bayes.control.scenario import Course, Scenario
from muscle_bayes.inference.running.precision import double_precision

SIDE_BY_SIDE = 8
"""Draws per batch of a core: what fills its vector units."""
ON_ACCELERATORS = 4096
"""Most draws per batch there."""
SHOWN_EVERY = 10
"""Periods between the samples of responses that are kept."""


class Outcome(NamedTuple):
    """What came of one scenario, one row a draw."""

    metrics: Metrics
    cost: Any
    angle: Any
    """(draw, sample), every SHOWN_EVERY-th period [rad]"""
    temperature: Any
    """(draw, sample, 2) [C]"""


class Shape:
    """What of JointDraws a compiled program depends on, apart from its values."""

    def __init__(self, draws: JointDraws) -> None:
        self.joint, self.design = draws.joint, draws.design
        self._key = (draws.design.model_dump_json(), draws.friction, draws.effects)

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Shape) and self._key == other._key


@partial(jax.jit, static_argnames=("shape",))
def _starts(values: Any, load: Any, trained: Any, shape: Shape) -> Motion:
    return jax.vmap(lambda one: start_of(shape.joint(one), load, trained))(values)


@partial(jax.jit, static_argnames=("shape", "clock", "cost", "cycles"))
def _outcomes(
    values: Any,
    starts: Motion,
    keys: Any,
    law: Law,
    course: Course,
    *,
    shape: Shape,
    clock: Clock,
    cost: Cost,
    cycles: int,
) -> Outcome:
    def one(argument: Any) -> Outcome:
        draw, start, key = argument
        trace = simulate(shape.joint(draw), law, course, start, key, clock)
        return Outcome(
            metrics(course, trace, clock.period, cycles),
            cost(course, trace),
            trace.angle[::SHOWN_EVERY],
            trace.temperature[::SHOWN_EVERY],
        )

    return jax.vmap(one)((values, starts, keys))


def cycles_of(course: Course) -> int:
    """How often the setpoint repeats; 0 where it does not."""
    return int(course.setpoint.shape[0]) // int(course.cycle) if int(course.cycle) else 0


class Bank:
    """Draws made ready: their values on the device, their states at rest."""

    def __init__(self, draws: JointDraws, clock: Clock | None = None, seed: int = 0) -> None:
        self.draws, self.clock, self.seed = draws, clock or Clock(), seed
        self.shape = Shape(draws)
        self._starts: dict[tuple[float, float], Motion] = {}

    @double_precision
    def values(self) -> Any:
        """Values of every draw, as arrays."""
        return {key: jnp.asarray(value) for key, value in self.draws.values.items()}

    @double_precision
    def keys(self) -> Any:
        """A random key for every draw; the same whatever the law, so that laws compare."""
        return jax.random.split(jax.random.key(self.seed), len(self.draws))

    @double_precision
    def starts(self, course: Course) -> Motion:
        """The state of every draw's joint as the course begins."""
        known = (float(course.load[0]), float(course.trained))
        if known not in self._starts:
            self._starts[known] = batch_by_batch(_starts, (self.values(),), known, shape=self.shape)
        return self._starts[known]

    def arguments(self, course: Course) -> Any:
        """What differs between draws: values, start, key."""
        return self.values(), self.starts(course), self.keys()


_COMPILED: dict[Hashable, Callable[..., Any]] = {}


def batch_by_batch(program: Any, arguments: Any, common: tuple[Any, ...], **static: Any) -> Any:
    """`program(*arguments, *common, **static)`, on each core one batch of draws after another.

    Compiled here and once: threads that call a new program each compile it for themselves.
    """
    count = jax.tree.leaves(arguments)[0].shape[0]
    on_cpu = jax.default_backend() == "cpu"
    size = SIDE_BY_SIDE if on_cpu else min(ON_ACCELERATORS, count)
    batches = -(-count // size)
    common = jax.tree.map(jnp.asarray, common)
    # The last batch is filled up with draws from the front, which are dropped afterwards.
    places = np.arange(batches * size).reshape(batches, size) % count
    own = [jax.tree.map(lambda x, i=i: x[i], arguments) for i in places]
    leaves, structure = jax.tree.flatten((own[0], common))
    shapes = tuple((leaf.shape, str(leaf.dtype)) for leaf in leaves)
    key = (program, tuple(static.items()), structure, shapes)
    if key not in _COMPILED:
        _COMPILED[key] = program.lower(*own[0], *common, **static).compile()

    @double_precision  # worker threads do not inherit the caller's
    def part(number: int) -> Any:
        return jax.tree.map(np.asarray, _COMPILED[key](*own[number], *common))

    with ThreadPoolExecutor(min(batches, (os.cpu_count() or 1) if on_cpu else 1)) as pool:
        parts = list(pool.map(part, range(batches)))
    return jax.tree.map(lambda *all_: np.concatenate(all_)[:count], *parts)


@double_precision
def run(bank: Bank, law: Law, scenario: Scenario, cost: Cost | None = None) -> Outcome:
    """The scenario under the law for every draw of the bank."""
    course = scenario.course
    return batch_by_batch(
        _outcomes,
        bank.arguments(course),
        (law, course),
        shape=bank.shape,
        clock=bank.clock,
        cost=cost or Cost(),
        cycles=cycles_of(course),
    )
