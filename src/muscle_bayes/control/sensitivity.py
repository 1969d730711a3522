"""Costs of many draws and their derivatives with respect to the gains' numbers."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.control.batch import Bank, Shape, batch_by_batch, cycles_of
from muscle_bayes.control.closed_loop import Clock, simulate
from muscle_bayes.control.cost import Cost
from muscle_bayes.control.criteria import JUDGED
from muscle_bayes.control.gains import Gains
from muscle_bayes.control.laws.build import Numbers, build_law
from muscle_bayes.control.metrics import metrics
from muscle_bayes.control.scenario import Course, Scenario

NAMES = ("cost", *JUDGED)


def _judged(
    numbers: Numbers, joint, start, key, course: Course, gains: Gains, shape, clock, cost, cycles
) -> Float[Array, " name"]:
    law = build_law(gains, shape.design, numbers)
    trace = simulate(joint, law, course, start, key, clock)
    found = metrics(course, trace, clock.period, cycles)
    return jnp.stack([cost(course, trace), *(getattr(found, name) for name in JUDGED)])


@partial(jax.jit, static_argnames=("gains", "shape", "clock", "cost", "cycles", "derivatives"))
def _values(
    values: Any,
    starts: Any,
    keys: Any,
    numbers: Numbers,
    course: Course,
    *,
    gains: Gains,
    shape: Shape,
    clock: Clock,
    cost: Cost,
    cycles: int,
    derivatives: bool,
) -> Any:
    def one(argument: Any) -> Any:
        draw, start, key = argument
        joint = shape.joint(draw)

        def judged(numbers: Numbers) -> Any:
            rest = (joint, start, key, course, gains, shape, clock, cost, cycles)
            return _judged(numbers, *rest)

        if not derivatives:
            return judged(numbers), None

        def twice(numbers: Numbers) -> Any:
            found = judged(numbers)
            return found, found

        # Three numbers: forward mode carries them along and keeps no history.
        slopes, found = jax.jacfwd(twice, has_aux=True)(numbers)
        return found, jnp.stack(slopes, -1)

    return jax.vmap(one)((values, starts, keys))


def _without_numbers(gains: Gains) -> Gains:
    """The law alone, so that its program is the same whatever the numbers."""
    return gains.model_copy(update={"proportional": 1.0, "integral": 1.0, "bias": 0.0})


def judged_values(
    bank: Bank,
    gains: Gains,
    numbers: Numbers,
    scenario: Scenario,
    cost: Cost,
    *,
    derivatives: bool = True,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray] | None]:
    """Cost and metrics of every draw (draw,), and their derivatives (draw, 3) by `Numbers`' order.

    Rounding and truncation count with the derivative of the identity.
    """
    course = scenario.course

    found, slopes = batch_by_batch(
        _values,
        bank.arguments(course),
        (numbers, course),
        gains=_without_numbers(gains),
        shape=bank.shape,
        clock=bank.clock,
        cost=cost,
        cycles=cycles_of(course),
        derivatives=derivatives,
    )
    values = {name: found[:, place] for place, name in enumerate(NAMES)}
    if slopes is None:
        return values, None
    return values, {name: slopes[:, place] for place, name in enumerate(NAMES)}
