"""The most probable parameters: the best of many starts."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.model.prior_draws import sample_prior
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.program import Program
from muscle_bayes.inference.running.side_by_side import side_by_side
from muscle_bayes.inference.search.mode import Mode, curvature, to_mode
from muscle_bayes.inference.search.other_basins import with_other_basins
from muscle_bayes.inference.search.shape import Shape, noise_mask, shaped, with_misfit
from muscle_bayes.physics.effects import effect_type

PRIOR_DRAWS = 256
"""Draws of the prior among which optimisation starts."""
SHRUNK = 0.03
"""Factor on D, and on what effects do, in every other draw: where friction holds the rotor, no
parameter shows any effect, and where an effect drowns the rest, a descent goes to its own mode."""
STARTS = 40
"""Most draws whose shape is fitted, best first, every other one shrunk."""
AGREEING, AGREEMENT = 3, 5.0
"""The search ends when so many starts have come within this of the least -log density so far."""
CLOSE, AGREEING_AFAR = 1.2, 20
"""So many must agree where the misfit is more than CLOSE times the noise that is expected: then the
model is wrong, or most starts lead to a mode that is."""
FINALISTS, SAME_MODE = 5, 0.1
"""Most shapes that are fitted in full, best first, until the best two come so close in -log density."""


@Program
def _starts_of(
    values: dict[str, Array], shrinking: Float[Array, " draw"], layout: Layout, data: Data
) -> Float[Array, "draw n"]:
    """Unconstrained draws, each shrunk by its factor."""

    def one(values: dict[str, Array], factor: Array) -> Array:
        values = values | {"D": factor * values["D"]}
        for effect in layout.effects:
            for field, parameter in effect_type(effect).parameters.items():
                name = f"{effect}.{field}"
                values[name] = parameter.off + factor * (values[name] - parameter.off)
        return unconstrain(values, layout, data)

    return jax.vmap(one)(values, shrinking)


def _prior_draws(key: Array, count: int, layout: Layout, data: Data) -> Float[Array, "draw n"]:
    """Prior draws, unconstrained, every other one shrunk."""
    factors = np.where(np.arange(count) % 2 == 0, 1.0, SHRUNK)
    return _starts_of(sample_prior(key, count, layout, data), factors, layout, data)


def find_mode(
    key: Array,
    layout: Layout,
    data: Data,
    report: Callable[[str], None] = lambda text: None,
    workers: int = 1,
) -> Mode:
    """The best of several local maxima, started from the most probable of many prior draws.

    Each start is first fitted as if its misfit were independent noise, which looks at the whole
    shape of a run, and only the best of these with the discrepancy's correlation, which looks at
    how it changes. From the best shape minimum forces are tried elsewhere, for descents do not find
    their way from a spring that is open to one that is shut. `workers` descents go on side by side; the
    result does not depend on their number. Raises MuscleBayesError when no prior draw gives a finite
    density.
    """
    # Of all programs this one takes longest to make: others are made meanwhile.
    pool = ThreadPoolExecutor(1)
    curvature.begin(pool, jnp.zeros(noise_mask(layout).size), layout, data)
    pool.shutdown(wait=False)
    # A draw of the right shape must not be passed over because of the noise that was drawn with it.
    draws = np.asarray(_prior_draws(key, PRIOR_DRAWS, layout, data))
    levels = side_by_side(lambda draw: with_misfit(draw, layout, data)[1], draws, workers)
    values = np.array(list(levels))
    values = np.where(np.isfinite(values), values, np.inf)
    order = np.argsort(values)
    if not np.isfinite(values[order[0]]):
        raise MuscleBayesError(
            "the model cannot be simulated anywhere in the prior for these runs; check the geometry "
            "in their metadata (lengths in m, masses in kg, angles in rad)"
        )
    shapes: list[Shape] = []

    def best() -> Shape:
        return min(shapes, key=lambda shape: shape.level)

    def shaped_from(starts: Iterable[Array]) -> Iterator[None]:
        """After each start, its shape is among those known."""
        for shape in side_by_side(lambda start: shaped(start, layout, data), starts, workers):
            shapes.append(shape)
            report(f"start {len(shapes)}: -log density {shape.level:.2f}")
            yield

    pairs = zip(order[order % 2 == 1], order[order % 2 == 0], strict=True)
    begun = [jnp.asarray(draws[index]) for pair in pairs for index in pair][:STARTS]
    for _ in shaped_from(begun):
        wanted = AGREEING if best().ratio < CLOSE else AGREEING_AFAR
        if sum(shape.level < best().level + AGREEMENT for shape in shapes) >= wanted:
            break
    level = np.inf
    while best().level < level - AGREEMENT:
        level = best().level
        for _ in shaped_from(with_other_basins(best().vector, layout, data)):
            pass
    shapes.sort(key=lambda shape: shape.level)
    modes: list[Mode] = []
    finalists = [shape.vector for shape in shapes[:FINALISTS]]
    for mode in side_by_side(lambda vector: to_mode(vector, layout, data), finalists, workers):
        modes.append(mode)
        modes.sort(key=lambda mode: mode.potential)
        if len(modes) > 1 and modes[1].potential - modes[0].potential < SAME_MODE:
            break
    return modes[0]
