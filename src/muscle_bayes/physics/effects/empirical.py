"""A smooth function that nobody has named: what is left when no effect of the catalogue fits."""

from collections.abc import Sequence
from functools import cache
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
from numpyro import distributions as dist

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.effect import Effect, Parameter, Port, Scales, Signals
from muscle_bayes.physics.linkage import Scalar

TERMS = 22
"""Degree of the function: a polynomial without constant."""
SIGNALS = ("q", "speed", "load", "strain", "hyst", "temperature")
"""What it may depend on."""
PORT_SIGNALS: dict[Port, tuple[str, ...]] = {
    "torque": ("q", "speed", "load"),
    "tension": ("strain", "temperature", "hyst", "load"),
    "offset": ("temperature", "strain", "hyst", "load"),
    "damper": ("temperature", "strain", "hyst", "load"),
    "reading": ("q",),
}
"""Of each port, the signals that differ from what the plant already has there."""
SPREAD = {"offset": 0.02, "damper": 0.5, "reading": 0.03}
"""Prior standard deviation of the first term; of torque and tension, a tenth of the driving ones."""
PREFIX = "unknown"


def polynomial(coefficients: Sequence[Scalar], signal: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """sum_k c_k T_k(x), k = 1..TERMS: Chebyshev polynomials.

    x is the signal from -1 at `low` to 1 at `high`, held beyond.
    """
    x = jnp.clip(2.0 * (signal - low) / (high - low) - 1.0, -1.0, 1.0)
    return _sum(tuple(coefficients), x)


@jax.custom_jvp
def _sum(c: tuple[Scalar, ...], x: Scalar) -> Scalar:
    """sum_k c_k T_k(x), k from 1, with T_k(cos a) = cos(k a).

    As arrays: a recurrence, unrolled, takes minutes to compile within a solver.
    """
    first, _ = _terms(len(c), x)
    return jnp.sum(jnp.stack([one + jnp.zeros_like(x) for one in c]) * first, axis=0)


def _terms(count: int, x: Scalar) -> tuple[Scalar, Scalar]:
    """T_k(x) and their slopes k sin(k a) / sin(a), k from 1, along a leading axis."""
    order = jnp.arange(1.0, count + 1.0).reshape(-1, *[1] * jnp.ndim(x))
    angle = jnp.arccos(jnp.clip(x, -1.0 + 1e-12, 1.0 - 1e-12))
    slopes = order * jnp.sin(order * angle) / jnp.sin(angle)
    return jnp.cos(order * angle), slopes


@_sum.defjvp
def _sum_slope(primals: Any, tangents: Any) -> tuple[Scalar, Scalar]:
    """T_k and the slope are worked out once for all directions, not along each of them."""
    (c, x), (dc, dx) = primals, tangents
    first, slopes = _terms(len(c), x)
    sizes, moves = (jnp.stack([one + jnp.zeros_like(x) for one in part]) for part in (c, dc))
    value, moved = jnp.sum(sizes * first, axis=0), jnp.sum(moves * first, axis=0)
    return value, moved + jnp.sum(sizes * slopes, axis=0) * dx


def applied(port: Port, value: Scalar, change: Scalar) -> Scalar:
    """`value + change`; on the damper port `value exp(change)`, which stays positive."""
    return value * jnp.exp(change) if port == "damper" else value + change


def _coefficient(port: Port, order: int) -> Parameter:
    """Smoother functions are likelier: the k-th term's standard deviation falls with k."""

    def prior(scales: Scales) -> dist.Distribution:
        sizes = {"torque": 0.1 * scales.force, "tension": 0.1 * scales.tension}
        return dist.Normal(0.0, (sizes | SPREAD)[port] / order)

    units = {"torque": "N m or N", "tension": "N", "offset": "1", "damper": "1"}
    unit = units.get(port, "rad or m")
    return Parameter(unit, 0.0, prior, f"coefficient of T_{order}")


def _coefficients(port: Port) -> dict[str, Parameter]:
    return {f"c{order}": _coefficient(port, order) for order in range(1, TERMS + 1)}


class AnyFunction(Effect):
    """value -> value + sum_k c_k T_k(x), x a signal chosen by `w_*`, from -1 at `low` to 1 at `high`.

    All signals of a port share compiled code. `low`, `high` and the weights are constants of a
    search, not unknowns.
    """

    dissipative: ClassVar[bool] = False
    c: tuple[Scalar, ...]
    w: tuple[Scalar, ...]
    low: Scalar
    high: Scalar

    def __init__(self, **values: Scalar) -> None:
        self.c = tuple(values[f"c{order}"] for order in range(1, TERMS + 1))
        self.w = tuple(values[f"w_{signal}"] for signal in SIGNALS)
        self.low, self.high = values["low"], values["high"]

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        chosen = sum(
            weight * getattr(signals, name) for weight, name in zip(self.w, SIGNALS, strict=True)
        )

        def changed() -> Scalar:
            return applied(self.port, still, polynomial(self.c, chosen, self.low, self.high))

        # Of all ports that are searched together one has its function on: the others cost little.
        still = value + jnp.zeros_like(chosen)
        return jax.lax.cond(jnp.any(jnp.stack(self.w) != 0.0), changed, lambda: still)


def _constant(off: float) -> Parameter:
    return Parameter("", off, lambda scales: dist.Normal(off, 1.0), "constant of the search")


@cache
def any_function(port: Port) -> type[AnyFunction]:
    """The class of AnyFunction on `port`."""
    constants = {f"w_{signal}": _constant(0.0) for signal in SIGNALS}
    constants |= {"low": _constant(0.0), "high": _constant(1.0)}
    fields: dict[str, Any] = {"name": f"{PREFIX}-{port}", "port": port, "__module__": __name__}
    fields |= {"parameters": _coefficients(port) | constants}
    return type(f"Any{port.title()}Function", (AnyFunction,), fields)


class Function(Effect):
    """value -> value + sum_k c_k T_k(x), x the signal from -1 at `low` to 1 at `high`."""

    dissipative: ClassVar[bool] = False
    signal: ClassVar[str]
    low: ClassVar[float]
    high: ClassVar[float]
    c: tuple[Scalar, ...]

    def __init__(self, **values: Scalar) -> None:
        self.c = tuple(values[f"c{order}"] for order in range(1, TERMS + 1))

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        signal = getattr(signals, self.signal)
        return applied(self.port, value, polynomial(self.c, signal, self.low, self.high))


def function_name(port: Port, signal: str, low: float, high: float) -> str:
    """Name of a Function, from which it can be made again: unknown-torque(q:-0.6:0.8)."""
    return f"{PREFIX}-{port}({signal}:{low:.4g}:{high:.4g})"


@cache
def function_type(name: str) -> type[Function]:
    """The Function of that name. Raises MuscleBayesError where the name is none of a Function."""
    head, _, tail = name.removesuffix(")").partition("(")
    port, parts = head.removeprefix(f"{PREFIX}-"), tail.split(":")
    try:
        signal, low, high = parts[0], float(parts[1]), float(parts[2])
    except (IndexError, ValueError):
        signal, low, high = "", 0.0, 0.0
    if port not in PORT_SIGNALS or signal not in SIGNALS or not low < high:
        raise MuscleBayesError(
            f"effect '{name}' is no function. Fix: write {PREFIX}-PORT(SIGNAL:LOW:HIGH) with a port of "
            f"{', '.join(PORT_SIGNALS)} and a signal of {', '.join(SIGNALS)}"
        )
    fields: dict[str, Any] = {
        "name": name,
        "port": port,
        "signal": signal,
        "low": low,
        "high": high,
    }
    fields |= {"parameters": _coefficients(port), "__module__": __name__}
    return type(f"{port.title()}Of{signal.title()}", (Function,), fields)


def empirical_type(name: str) -> type[Effect]:
    """The effect behind a name that begins with PREFIX: a Function, or a port's AnyFunction."""
    port = name.removeprefix(f"{PREFIX}-")
    return any_function(port) if port in PORT_SIGNALS else function_type(name)


__all__ = ["PORT_SIGNALS", "SIGNALS", "TERMS", "empirical_type", "function_name", "function_type"]
