"""Where dry friction lets the rotor rest: the play operator of quasi-static motion."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

from muscle_bayes.physics.friction import DryLevels
from muscle_bayes.physics.linkage import Scalar

TOLERANCE = 1e-11
"""Relative width of the bracket, or relative Newton step, at which the search ends."""
MAX_ITERATIONS = 80
STRAIGHT = 0.05
"""Largest ratio of the second Newton step to the first at which both are believed."""
DIRECT_ERROR = 1e-8
"""Largest error, as a share of the way between the stops, that two Newton steps may leave: the step
that carries the derivative squares it."""
FIRST_REACH = 0.02
"""Largest first guess of the distance to the next rest, as a share of the way between the stops."""


def play(
    force: Callable[[Scalar, Any], Scalar],
    q: Scalar,
    args: Any,
    dry: DryLevels,
    stops: tuple[Scalar, Scalar],
) -> Scalar:
    """The coordinate after forces have changed slowly, starting at rest at `q`.

    Rotor stays while |force(q)| <= dry.static; else it slides to the first point where |force| =
    dry.sliding, or to the stop. `force(q, args)` falls with q around a stable equilibrium. Found by
    Newton's method inside a shrinking bracket; the derivative of the result is that of the implicit
    equation, so it is exact in forward and reverse mode. [rad or m], [N m or N].
    """
    frozen = jax.lax.stop_gradient((q, args, dry, stops))
    q_start, args_f, (dry_f, static_f), stops_f = frozen

    def force_and_slope(x: Scalar) -> tuple[Scalar, Scalar]:
        return jax.jvp(lambda x: force(x, args_f), (x,), (jnp.ones_like(x),))

    pull, slope = force_and_slope(q_start)
    # So written, a pull that is not finite moves the rotor instead of passing for a stuck one.
    direction = jnp.where(jnp.abs(pull) <= static_f, 0.0, jnp.sign(pull))
    far = jnp.where(direction > 0, stops_f[1], stops_f[0])
    span = jnp.abs(stops_f[1] - stops_f[0])
    room = jnp.abs(far - q_start)

    # Two Newton steps, enough for nearly every interval. They are believed where the second is so
    # much shorter than the first that the force is nearly straight all the way.
    over = direction * pull - dry_f
    falling = slope < 0.0
    newton_reach = jnp.where(falling, over / jnp.where(falling, -slope, 1.0), 0.0)
    close = q_start + direction * jnp.minimum(newton_reach, room)
    value, slope = force_and_slope(close)
    correction = (direction * dry_f - value) / jnp.where(slope < 0.0, slope, 1.0)
    shrinks = jnp.abs(correction) <= STRAIGHT * newton_reach
    # The error left, since errors go with the square of the step before.
    square = jnp.where(newton_reach > 0.0, newton_reach, 1.0) ** 2
    left = jnp.abs(correction) ** 3 / square
    inside = (newton_reach < room) & (jnp.abs(close + correction - q_start) < room)
    direct = falling & (slope < 0.0) & shrinks & (left <= DIRECT_ERROR * span) & inside
    searching = (direction != 0.0) & ~direct

    def excess(x: Scalar) -> Scalar:
        """Force left after friction, positive while the rotor still slides away from q_start."""
        return direction * force(x, args_f) - dry_f

    def short(carry):
        reach, over = carry
        return searching & (over > 0.0) & (reach < room)

    def widen(carry):
        reach = jnp.minimum(2.0 * carry[0], room)
        return reach, excess(q_start + direction * reach)

    # The search widens from the start, so that it ends at the nearest rest and not at one beyond an
    # over-centre position. The first guess is twice a Newton step.
    guess = jnp.clip(2.0 * newton_reach, TOLERANCE * span, FIRST_REACH * span)
    guess = jnp.minimum(guess, 0.5 * room)
    reach, over = jax.lax.while_loop(short, widen, (guess, jnp.ones_like(over)))
    beyond = q_start + direction * reach
    at_stop = searching & (over > 0.0) & (reach >= room)

    def unfinished(carry):
        _, near, beyond, step, count = carry
        open_ = (jnp.abs(step) > TOLERANCE * span) & (jnp.abs(beyond - near) > TOLERANCE * span)
        return open_ & (count < MAX_ITERATIONS)

    def improve(carry):
        x, near, beyond, step, count = carry
        value, slope = jax.jvp(excess, (x,), (jnp.ones_like(x),))
        near = jnp.where(value > 0.0, x, near)
        beyond = jnp.where(value > 0.0, beyond, x)
        newton = x - value / jnp.where(slope == 0.0, 1.0, slope)
        low, high = jnp.minimum(near, beyond), jnp.maximum(near, beyond)
        # A Newton step that leaves the bracket, or hardly shrinks, is replaced by bisection.
        inside = (slope != 0.0) & (newton >= low) & (newton <= high)
        slow = jnp.abs(newton - x) > 0.5 * jnp.abs(step)
        bisect = ~inside | (slow & (count > 8))
        new = jnp.where(bisect, 0.5 * (near + beyond), newton)
        return new, near, beyond, new - x, count + 1

    bracketed = searching & ~at_stop
    start = (q_start, q_start, jnp.where(bracketed, beyond, q_start), span, 0)
    found = jax.lax.while_loop(unfinished, improve, start)[0]
    root = jax.lax.stop_gradient(jnp.where(searching, found, close + correction))
    # One Newton step with the slope held fixed carries the derivative of the implicit equation.
    _, slope = force_and_slope(root)
    residual = force(root, args) - direction * dry.sliding
    slides = root - residual / jnp.where(slope == 0.0, -1.0, slope)
    slides = jnp.where(slope == 0.0, root, slides)
    stop = jnp.where(direction > 0, stops[1], stops[0])
    return jnp.where(direction == 0.0, q, jnp.where(at_stop, stop, slides))
