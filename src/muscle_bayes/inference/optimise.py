"""The most probable parameters, and the Fisher information there."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.damped_steps import Walls, between_walls, damped_move
from muscle_bayes.inference.density import (
    constrain,
    first_hyst_entries,
    log_prior,
    potential_errors_and_scales,
    rms_by_regime,
    unconstrain,
)
from muscle_bayes.inference.lane_model import LanePrediction
from muscle_bayes.inference.noise import NoiseParameters
from muscle_bayes.inference.other_basins import with_other_basins
from muscle_bayes.inference.prior_draws import sample_prior
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program
from muscle_bayes.inference.programs import (
    potential_at,
    potential_with,
    predictions_at,
    walls_at,
)
from muscle_bayes.inference.side_by_side import side_by_side
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
SHAPE_ROUNDS, SHAPE_STEPS = 4, 15
"""Most rounds of fitting a shape, the noise set to the misfit before each, and steps in a round."""
SETTLED = 1e-3
"""Relative change of the misfit in a round after which there is none more."""
MAX_STEPS = 60
LEAST_GAIN = 1e-3
"""Decrease of the potential below which a descent ends."""
EFFECTIVE_SHARE = 5.0
"""Readings per independent one while a shape is fitted."""
LEAST_PRECISION = 1e-4
"""Least prior precision of a direction, for flat or concave priors."""


class Mode(NamedTuple):
    """A maximum of the posterior density."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    potential: float
    """Negative log density there."""
    information: Float[Array, "n n"]
    """Fisher information of the likelihood (Gauss-Newton) plus prior precision."""
    steps: int


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


@Program
def _curvature(vector, layout: Layout, data: Data):
    """Gradient of the potential, and Gauss-Newton information plus prior precision."""
    gradient, jacobian = jax.jacfwd(potential_errors_and_scales)(vector, layout, data)

    def slope(vector: Array) -> Array:
        return jax.grad(log_prior)(vector, layout, data)

    # Priors are independent of each other: their Hessian is diagonal.
    prior = -jax.jvp(slope, (vector,), (jnp.ones_like(vector),))[1]
    return gradient, jacobian.T @ jacobian + jnp.diag(jnp.maximum(prior, LEAST_PRECISION))


class Misfit(NamedTuple):
    """A vector with each regime's noise set to its misfit."""

    white: Float[Array, " n"]
    """As if all of it were white: looks at the whole shape of a run."""
    lasting: Float[Array, " n"]
    """As if all of it were discrepancy: looks at how it changes."""
    ratio: Float[Array, ""]
    """Largest ratio of a regime's RMS misfit to the noise expected of a reading."""


@Program
def _misfit_of(predicted: list[LanePrediction], vector: Array, layout: Layout, data: Data):
    values = constrain(vector, layout, data)
    white, lasting, ratio = dict(values), dict(values), jnp.zeros(())
    for regime, misfit in rms_by_regime(predicted, values, layout, data).items():
        typical = {key: data.priors[f"{regime}.{key}"] for key in NoiseParameters._fields}
        weights = [
            lanes.weight.ravel()
            for lanes, name in zip(data.lanes, layout.regimes, strict=True)
            if name == regime
        ]
        readings = jnp.quantile(jnp.concatenate(weights), 0.9)
        time = typical["correlation_time"].mean
        ratio = jnp.maximum(ratio, misfit / typical["noise"].mean)
        for target, noise in (
            (white, (misfit * jnp.sqrt(EFFECTIVE_SHARE * readings), 1e-3 * misfit, time)),
            (lasting, (typical["noise"].mean, misfit, time)),
        ):
            keys = (f"{regime}.{key}" for key in NoiseParameters._fields)
            target.update(zip(keys, noise, strict=True))
    return Misfit(unconstrain(white, layout, data), unconstrain(lasting, layout, data), ratio)


def _with_misfit(vector: Array, layout: Layout, data: Data) -> tuple[Misfit, float]:
    """The misfit of a vector, and the potential where it is taken for lasting."""
    predicted = predictions_at(vector, layout, data)
    misfit = _misfit_of(predicted, vector, layout, data)
    return misfit, float(potential_with(predicted, misfit.lasting, layout, data))


def _noise_mask(layout: Layout) -> np.ndarray:
    """1 for entries of the vector that are not noise parameters."""
    ends = tuple(f".{key}" for key in NoiseParameters._fields)
    return np.concatenate(
        [
            np.full(int(np.prod(shape)), float(not name.endswith(ends)))
            for name, shape in layout.shapes
        ]
    )


class Descent(NamedTuple):
    """Where a descent has ended."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    potential: float
    steps: int


def _descend(vector: Array, layout: Layout, data: Data, free: np.ndarray, limit: int) -> Descent:
    """Levenberg-Marquardt on the potential in the free entries: damped until a step descends."""
    entries = first_hyst_entries(layout.shapes)

    def walled(vector: np.ndarray) -> Walls:
        return walls_at(jnp.asarray(vector), layout, data)

    inside, walls = between_walls(np.asarray(vector), walled, entries)
    vector = jnp.asarray(inside)
    value, damping, step = potential_at(vector, layout, data), 1e-2, 0
    gradient, information = _curvature(vector, layout, data)
    chosen = np.flatnonzero(free)
    while step < limit:
        step += 1
        part = np.asarray(information)[np.ix_(chosen, chosen)]
        move = np.zeros(vector.shape)
        slope = np.asarray(gradient)[chosen]
        move[chosen] = damped_move(part, slope, damping, walls.of(chosen))
        further, ahead = between_walls(np.asarray(vector) + move, walled, entries)
        trial = potential_at(jnp.asarray(further), layout, data)
        if trial < value:
            gain, vector, walls, value = value - trial, jnp.asarray(further), ahead, trial
            damping = max(damping * 0.2, 1e-9)
            if gain < LEAST_GAIN:
                break
            gradient, information = _curvature(vector, layout, data)
        else:
            damping *= 6.0
            if damping > 1e8:
                break
    return Descent(vector, value, step)


def _to_mode(vector: Array, layout: Layout, data: Data) -> Mode:
    """Descend in all entries, as far as it goes."""
    found = _descend(vector, layout, data, np.ones(vector.size), MAX_STEPS)
    information = _curvature(found.vector, layout, data)[1]
    return Mode(found.vector, found.potential, information, found.steps)


class Shape(NamedTuple):
    """A start after its misfit was fitted as if it were white."""

    level: float
    """Negative log density with its misfit taken for lasting."""
    vector: Float[Array, " n"]
    """With that noise."""
    ratio: float
    """Largest ratio of a regime's RMS misfit to the noise expected of a reading."""


def _shaped(vector: Array, layout: Layout, data: Data) -> Shape:
    """Fit the whole shape of runs, the noise set to the misfit before each round.

    In the first round minimum forces are held: while all else is wrong, their prior alone would pull a
    spring open that has to be shut.
    """
    free = _noise_mask(layout)
    misfit, level = _with_misfit(vector, layout, data)
    for count in range(SHAPE_ROUNDS):
        held = blocks(layout).walled if count == 0 else np.zeros(0, int)
        physical = np.where(np.isin(np.arange(free.size), held), 0.0, free)
        vector = _descend(misfit.white, layout, data, physical, SHAPE_STEPS).vector
        before, (misfit, level) = misfit, _with_misfit(vector, layout, data)
        if count and abs(before.ratio - misfit.ratio) < SETTLED * misfit.ratio:
            break
    # Where nothing can be simulated the level is NaN, which no other start would count as better than.
    return Shape(level if np.isfinite(level) else np.inf, misfit.lasting, float(misfit.ratio))


def refine(mode: Mode, layout: Layout, data: Data) -> Mode:
    """The local maximum to which a mode of slightly different data leads."""
    return _to_mode(mode.vector, layout, data)


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
    _curvature.begin(pool, jnp.zeros(_noise_mask(layout).size), layout, data)
    pool.shutdown(wait=False)
    # A draw of the right shape must not be passed over because of the noise that was drawn with it.
    draws = np.asarray(_prior_draws(key, PRIOR_DRAWS, layout, data))
    levels = side_by_side(lambda draw: _with_misfit(draw, layout, data)[1], draws, workers)
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
        for shape in side_by_side(lambda start: _shaped(start, layout, data), starts, workers):
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
    for mode in side_by_side(lambda vector: _to_mode(vector, layout, data), finalists, workers):
        modes.append(mode)
        modes.sort(key=lambda mode: mode.potential)
        if len(modes) > 1 and modes[1].potential - modes[0].potential < SAME_MODE:
            break
    return modes[0]
