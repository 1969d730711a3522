"""Many joints under one law, in one scenario at a time: one compiled program, batches on every core.

Single precision, for speed. What has to be the board's to the digit runs `closed_loop.simulate` in double
precision.
"""

import os
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np

from muscle_bayes.control.closed_loop import Clock, simulate, start_of
from muscle_bayes.control.judging.metrics import Metrics, metrics
from muscle_bayes.control.laws.law import Law
from muscle_bayes.control.plant.draws import JointDraws
from muscle_bayes.control.plant.joint import Joint
from muscle_bayes.control.plant.rotor import Motion
from muscle_bayes.control.scenarios.scenario import Course, Scenario

SIDE_BY_SIDE = 64
"""Loops per batch of a core: what fills its vector units and hides the cost of a step. Fewer are filled
up, so that one program serves any number: compiling takes longer than hundreds of loops."""
SHOWN_EVERY = 10
"""Periods between the samples of responses that are kept."""


class Outcome(NamedTuple):
    """What came of one scenario, one row a draw; with a leading axis where several laws ran."""

    metrics: Metrics
    angle: Any
    """(draw, sample), every SHOWN_EVERY-th period [rad]"""
    temperature: Any
    """(draw, sample, 2) [C]"""


@dataclass(frozen=True)
class Shape:
    """What of JointDraws a compiled program depends on, apart from its values."""

    key: tuple[str, str, tuple[str, ...]]
    """The design as JSON, friction and effects."""
    joint: Callable[..., Joint] = field(compare=False)


def _single(tree: Any) -> Any:
    """Floats in single precision, keys and integers as they are."""

    def one(x: Any) -> Any:
        x = np.asarray(x)
        return x.astype(np.float32) if x.dtype == np.float64 else x

    return jax.tree.map(one, tree)


@partial(jax.jit, static_argnames=("shape",))
def _starts(values: Any, load: Any, trained: Any, *, shape: Shape) -> Motion:
    return jax.vmap(lambda one: start_of(shape.joint(one), load, trained))(values)


@partial(jax.jit, static_argnames=("shape", "clock"))
def _outcomes(
    values: Any,
    starts: Motion,
    seeds: Any,
    laws: Law,
    course: Course,
    *,
    shape: Shape,
    clock: Clock,
) -> Outcome:
    def one(argument: Any) -> Outcome:
        draw, start, seed, law = argument
        trace = simulate(shape.joint(draw), law, course, start, jax.random.key(seed), clock)
        return Outcome(
            metrics(course, trace, clock.period),
            trace.angle[::SHOWN_EVERY],
            trace.temperature[::SHOWN_EVERY],
        )

    return jax.vmap(one)((values, starts, seeds, laws))


class Bank:
    """Draws made ready, with their states at rest."""

    def __init__(self, draws: JointDraws, clock: Clock | None = None, seed: int = 0) -> None:
        self.draws, self.clock, self.seed = draws, clock or Clock(), seed
        key = (draws.design.model_dump_json(), draws.friction, draws.effects)
        self.shape = Shape(key, draws.joint)
        self.values = _single({key: np.asarray(value) for key, value in draws.values.items()})
        self._starts: dict[tuple[float, float], Motion] = {}

    def __len__(self) -> int:
        return len(self.draws)

    def seeds(self) -> np.ndarray:
        """A seed for every draw; the same whatever the law, so that laws compare."""
        generator = np.random.default_rng(self.seed)
        return generator.integers(2**31, size=len(self)).astype(np.uint32)

    def starts(self, course: Course) -> Motion:
        """The state of every draw's joint as the course begins."""
        known = (float(course.load[0]), float(course.trained))
        if known not in self._starts:
            self._starts[known] = batch_by_batch(_starts, (self.values,), known, shape=self.shape)
        return self._starts[known]


_COMPILED: dict[Hashable, Callable[..., Any]] = {}


def batch_by_batch(program: Any, arguments: Any, common: tuple[Any, ...], **static: Any) -> Any:
    """`program(*arguments, *common, **static)`, on each core one batch of rows after another.

    Compiled here and once: threads that call a new program each compile it for themselves.
    """
    count = jax.tree.leaves(arguments)[0].shape[0]
    batches = -(-count // SIDE_BY_SIDE)
    arguments, common = _single(arguments), _single(common)
    # The last batch is filled up with rows from the front, which are dropped afterwards.
    places = np.arange(batches * SIDE_BY_SIDE).reshape(batches, SIDE_BY_SIDE) % count
    own = [jax.tree.map(lambda x, i=i: x[i], arguments) for i in places]
    leaves, structure = jax.tree.flatten((own[0], common))
    shapes = tuple((leaf.shape, str(leaf.dtype)) for leaf in leaves)
    key = (program, tuple(static.items()), structure, shapes)
    if key not in _COMPILED:
        with jax.enable_x64(False):
            _COMPILED[key] = program.lower(*own[0], *common, **static).compile()

    def part(number: int) -> Any:
        with jax.enable_x64(False):  # worker threads do not inherit the caller's
            return jax.tree.map(np.asarray, _COMPILED[key](*own[number], *common))

    with ThreadPoolExecutor(min(batches, os.cpu_count() or 1)) as pool:
        parts = list(pool.map(part, range(batches)))
    return jax.tree.map(lambda *all_: np.concatenate(all_)[:count], *parts)


def run(bank: Bank, law: Law, scenario: Scenario) -> Outcome:
    """The scenario for every draw of the bank, under a law or under each of several (`law_of`)."""
    several = np.ndim(law.numbers.kp)
    laws, draws = (np.size(law.numbers.kp), len(bank))
    numbers = jax.tree.map(lambda x: np.asarray(x) if several else np.asarray(x)[None], law)
    rows = (bank.values, bank.starts(scenario.course), bank.seeds())
    rows = jax.tree.map(lambda x: np.concatenate([x] * laws), rows)
    each = jax.tree.map(lambda x: np.repeat(x, draws, axis=0), numbers)
    outcome = batch_by_batch(
        _outcomes, (*rows, each), (scenario.course,), shape=bank.shape, clock=bank.clock
    )
    if not several:
        return outcome
    return jax.tree.map(lambda x: x.reshape(laws, draws, *x.shape[1:]), outcome)
