"""Where dry friction lets the rotor rest: the play operator of quasi-static motion."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Int

from muscle_bayes.physics.linkage import Scalar

TOLERANCE = 1e-11
"""Relative width of the bracket, or relative Newton step, at which the search ends."""
MAX_ITERATIONS = 80
STRAIGHT = 0.05
"""Largest ratio of the second Newton step to the first at which both are believed."""
DIRECT_ERROR = 1e-8
"""Largest error, as a share of the way between the stops, that two Newton steps may leave: the step
that carries the derivative squares it."""
FIRST_REACH = 0.04
"""Largest first guess of the distance to the next rest, as a share of the way between the stops."""

START, STEPPED, WIDENING, ENCLOSED, FOUND, AT_STOP = range(6)
"""Stages of the search."""


Forces = tuple[Scalar, Scalar]
"""What drives the rotor, with its sign, and the magnitude of dry friction, in any one unit."""


class _Search(NamedTuple):
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


def _search(
    forces: Callable[[Scalar], Forces], begin: Scalar, stops: tuple[Scalar, Scalar]
) -> _Search:
    """The rest after a slide from `begin`; no derivatives."""
    span = jnp.abs(stops[1] - stops[0])

    # All stages share one look at the force: each use of it is compiled anew, and is most of the code.
    def look(now: _Search) -> _Search:
        (value, dry), (slope, dry_slope) = jax.jvp(forces, (now.x,), (jnp.ones_like(now.x),))
        # So written, a pull that is not finite moves the rotor instead of passing for a stuck one.
        breaks_away = jnp.where(jnp.abs(value) <= dry, 0.0, jnp.sign(value))
        direction = jnp.where(now.stage == START, breaks_away, now.direction)
        room = jnp.abs(jnp.where(direction > 0, stops[1], stops[0]) - begin)
        over = direction * value - dry
        slope = slope - direction * dry_slope
        slides, falls = over > 0.0, slope < 0.0
        newton = over / jnp.where(slope == 0.0, 1.0, -slope)

        # Two Newton steps, enough for nearly every interval. They are believed where the second is so
        # much shorter than the first that the force is nearly straight all the way.
        reach = jnp.where(falls, newton, 0.0)
        shrinks = jnp.abs(newton) <= STRAIGHT * now.step
        # The error left, since errors go with the square of the step before.
        left = jnp.abs(newton) ** 3 / jnp.where(now.step > 0.0, now.step, 1.0) ** 2
        inside = (now.step < room) & (jnp.abs(now.x + direction * newton - begin) < room)
        direct = falls & shrinks & (left <= DIRECT_ERROR * span) & inside

        # Else the search widens from the start, so that it ends at the nearest rest and not at one
        # beyond an over-centre position, unless that is narrower than half the way to it.
        first = jnp.clip(4.0 * now.step, TOLERANCE * span, FIRST_REACH * span)
        wider = jnp.minimum(jnp.where(now.stage == STEPPED, first, 2.0 * now.step), room)

        # At last Newton's method inside a bracket. A step that leaves it, or hardly shrinks, is
        # replaced by bisection.
        enclosed = (now.stage == ENCLOSED) | ((now.stage == WIDENING) & ~slides)
        near = jnp.where((now.stage >= WIDENING) & slides, now.x, now.near)
        beyond = jnp.where(enclosed & ~slides, now.x, now.beyond)
        closer = now.x + direction * newton
        outside = (slope == 0.0) | (jnp.abs(2.0 * closer - near - beyond) > jnp.abs(beyond - near))
        slow = (jnp.abs(newton) > 0.5 * now.step) & (now.looks > 8)
        closer = jnp.where(outside | slow, 0.5 * (near + beyond), closer)
        moved, width = jnp.abs(closer - now.x), jnp.abs(beyond - near)
        ends = (jnp.minimum(moved, width) <= TOLERANCE * span) | (now.looks >= MAX_ITERATIONS)

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
        widened = begin + direction * wider
        stepped = jnp.where(direct, now.x + direction * newton, widened)
        x = staged(begin + direction * jnp.minimum(reach, room), stepped, widened, closer)
        # Where force is not finite the search ends, and what comes of it is not finite either.
        broken = ~jnp.isfinite(value)
        return _Search(
            jnp.where(broken, FOUND, stage),
            jnp.where(broken, now.x, x),
            direction,
            near,
            beyond,
            staged(reach, wider, wider, moved),
            jnp.where(enclosed, now.looks + 1, 0),
        )

    none = jnp.zeros_like(begin)
    start = _Search(jnp.asarray(START), begin, none, begin, begin, none, jnp.asarray(0))
    return jax.lax.while_loop(lambda now: now.stage < FOUND, look, start)


def play(
    forces: Callable[[Scalar, Any], Forces],
    q: Scalar,
    args: Any,
    stops: tuple[Scalar, Scalar],
) -> Scalar:
    """The coordinate after forces have changed slowly, starting at rest at `q`.

    `forces(x, args)` is the force at x and the dry friction against a slide from `q` to there. The
    rotor stays while |force| <= friction at q; else it slides to the first point where they are
    equal, or to the stop. The force falls with x around a stable equilibrium. Found by Newton's method
    inside a shrinking bracket; the derivative of the result is that of the implicit equation, so
    it is exact in forward and reverse mode. [rad or m].
    """
    begin, still, ends = jax.tree.map(stopped, (q, args, stops))
    found = jax.lax.stop_gradient(_search(lambda x: forces(x, still), begin, ends))
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
