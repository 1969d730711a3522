"""Where dry friction lets the rotor rest: the play operator of quasi-static motion."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Int

from muscle_bayes.physics.linkage import Scalar

START, STEPPED, WIDENING, ENCLOSED, FOUND, AT_STOP = range(6)
"""Stages of the search."""

Forces = tuple[Scalar, Scalar]
"""What drives the rotor, with its sign, and the magnitude of dry friction, in any one unit."""
Stops = tuple[Scalar | float, Scalar | float]
"""Coordinates of the endstops [rad or m]; infinite where there are none."""


class Search(NamedTuple):
    """How the nearest rest is searched for.

    Lengths are shares of the way between the stops, or of `widest` where that is longer.
    """

    tolerance: float = 1e-11
    """Width of the bracket, or Newton step, at which the search ends."""
    most_looks: int = 80
    """At the force, since the rest was enclosed."""
    straight: float = 0.05
    """Largest ratio of the second Newton step to the first at which both are believed."""
    direct_error: float = 1e-8
    """Largest error that two Newton steps may leave: the step that carries the derivative squares it."""
    first_reach: float = 0.04
    """Largest first guess of the distance to the next rest."""
    widest: float = 6.3
    """A whole turn [rad], or as many metres."""
    farthest: float = 1e3
    """Distance at which a rotor without endstops has none; its coordinate is not finite then."""


class _Reached(NamedTuple):
    """How far the search is."""

    stage: Int[Array, ""]
    x: Scalar
    """Where force is looked at next; at last, the rest."""
    direction: Scalar
    """Of the slide; 0 where the rotor stays."""
    near: Scalar
    """Farthest coordinate from which it is known to slide on."""
    beyond: Scalar
    """Nearest coordinate at which it is known not to."""
    step: Scalar
    """Length of the last step; while the search widens, distance from its start."""
    looks: Int[Array, ""]
    """Looks at the force since the rest was enclosed."""


class _Look(NamedTuple):
    """What is seen at one coordinate."""

    direction: Scalar
    slides: Bool[Array, ""]
    slope: Scalar
    """Of the force less friction, along the direction."""
    newton: Scalar
    """Length of Newton's step along the direction."""
    broken: Bool[Array, ""]
    """Whether the force is not finite."""


def _looked(forces: Callable[[Scalar], Forces], now: _Reached) -> _Look:
    (value, dry), (slope, dry_slope) = jax.jvp(forces, (now.x,), (jnp.ones_like(now.x),))
    # So written, a pull that is not finite moves the rotor instead of passing for a stuck one.
    breaks_away = jnp.where(jnp.abs(value) <= dry, 0.0, jnp.sign(value))
    direction = jnp.where(now.stage == START, breaks_away, now.direction)
    over = direction * value - dry
    slope = slope - direction * dry_slope
    newton = over / jnp.where(slope == 0.0, 1.0, -slope)
    return _Look(direction, over > 0.0, slope, newton, ~jnp.isfinite(value))


def _is_direct(now: _Reached, seen: _Look, begin: Scalar, room: Scalar, error: Scalar, by: Search):
    """Whether two Newton steps, enough for nearly every interval, are believed.

    They are where the second is so much shorter than the first that the force is nearly straight.
    """
    newton = jnp.abs(seen.newton)
    shrinks = newton <= by.straight * now.step
    # The error left, since errors go with the square of the step before.
    left = newton**3 / jnp.where(now.step > 0.0, now.step, 1.0) ** 2
    ahead = jnp.abs(now.x + seen.direction * seen.newton - begin)
    inside = (now.step < room) & (ahead < room)
    return (seen.slope < 0.0) & shrinks & (left <= error) & inside


def _closer(now: _Reached, seen: _Look, near: Scalar, beyond: Scalar) -> Scalar:
    """Newton's method inside a bracket; a step that leaves it, or hardly shrinks, bisects it instead."""
    closer = now.x + seen.direction * seen.newton
    leaves = jnp.abs(2.0 * closer - near - beyond) > jnp.abs(beyond - near)
    slow = (jnp.abs(seen.newton) > 0.5 * now.step) & (now.looks > 8)
    return jnp.where((seen.slope == 0.0) | leaves | slow, 0.5 * (near + beyond), closer)


def _searched(
    forces: Callable[[Scalar], Forces], begin: Scalar, stops: Stops, by: Search
) -> _Reached:
    """The rest after a slide from `begin`; no derivatives."""
    span = jnp.minimum(jnp.abs(stops[1] - stops[0]), by.widest)
    shortest = by.tolerance * span

    # All stages share one look at the force: each use of it is compiled anew, and is most of the code.
    def look(now: _Reached) -> _Reached:
        seen = _looked(forces, now)
        direction, slides = seen.direction, seen.slides
        room = jnp.abs(jnp.where(direction > 0, stops[1], stops[0]) - begin)
        room = jnp.minimum(room, by.farthest * span)
        reach = jnp.where(seen.slope < 0.0, seen.newton, 0.0)
        direct = _is_direct(now, seen, begin, room, by.direct_error * span, by)
        # Else the search widens from the start, so that it ends at the nearest rest and not at one
        # beyond an over-centre position, unless that is narrower than half the way to it.
        first = jnp.clip(4.0 * now.step, shortest, by.first_reach * span)
        wider = jnp.minimum(jnp.where(now.stage == STEPPED, first, 2.0 * now.step), room)
        widened = begin + direction * wider

        enclosed = (now.stage == ENCLOSED) | ((now.stage == WIDENING) & ~slides)
        near = jnp.where((now.stage >= WIDENING) & slides, now.x, now.near)
        beyond = jnp.where(enclosed & ~slides, now.x, now.beyond)
        closer = _closer(now, seen, near, beyond)
        moved, width = jnp.abs(closer - now.x), jnp.abs(beyond - near)
        ends = (jnp.minimum(moved, width) <= shortest) | (now.looks >= by.most_looks)

        def staged(start, stepped, widening, enclosing):
            other = jnp.where(now.stage == STEPPED, stepped, widening)
            other = jnp.where(enclosed, enclosing, other)
            return jnp.where(now.stage == START, start, other)

        stage = staged(
            jnp.where(direction == 0.0, FOUND, STEPPED),
            jnp.where(direct, FOUND, WIDENING),
            jnp.where(now.step >= room, AT_STOP, WIDENING),
            jnp.where(ends, FOUND, ENCLOSED),
        )
        stepped = jnp.where(direct, now.x + direction * seen.newton, widened)
        x = staged(begin + direction * jnp.minimum(reach, room), stepped, widened, closer)
        # Where force is not finite the search ends, and what comes of it is not finite either.
        stage, x = jnp.where(seen.broken, FOUND, stage), jnp.where(seen.broken, now.x, x)
        looks = jnp.where(enclosed, now.looks + 1, 0)
        return _Reached(
            stage, x, direction, near, beyond, staged(reach, wider, wider, moved), looks
        )

    none = jnp.zeros_like(begin)
    start = _Reached(jnp.asarray(START), begin, none, begin, begin, none, jnp.asarray(0))
    return jax.lax.while_loop(lambda now: now.stage < FOUND, look, start)


def play(
    forces: Callable[[Scalar, Any], Forces],
    q: Scalar,
    args: Any,
    stops: Stops,
    search: Search = Search(),  # noqa: B008, immutable
) -> Scalar:
    """The coordinate after forces have changed slowly, starting at rest at `q`.

    `forces(x, args)` is the force at x and the dry friction against a slide from `q` to there. The
    rotor stays while |force| <= friction at q; else it slides to the first point where they are
    equal, or to the stop. The force falls with x around a stable equilibrium. Found by Newton's method
    inside a shrinking bracket; the derivative of the result is that of the implicit equation, so
    it is exact in forward and reverse mode. [rad or m].
    """
    begin, still, ends = jax.tree.map(stopped, (q, args, stops))
    found = jax.lax.stop_gradient(_searched(lambda x: forces(x, still), begin, ends, search))
    root, direction = found.x, found.direction

    def excess(x: Scalar) -> Scalar:
        force, dry = forces(x, args)
        return force - direction * dry

    # One Newton step with the slope held fixed carries the derivative of the implicit equation.
    residual, slope = jax.jvp(excess, (root,), (jnp.ones_like(root),))
    slope = jax.lax.stop_gradient(slope)
    slides = root - residual / jnp.where(slope == 0.0, -1.0, slope)
    slides = jnp.where(slope == 0.0, root, slides)
    stop = jnp.where(direction > 0, stops[1], stops[0])
    return jnp.where(direction == 0.0, q, jnp.where(found.stage == AT_STOP, stop, slides))


def stopped(leaf: Any) -> Any:
    """The leaf without its derivatives."""
    return jax.lax.stop_gradient(leaf) if eqx.is_inexact_array(leaf) else leaf
