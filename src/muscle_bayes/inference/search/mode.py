"""The most probable parameters: the best of many starts, and where it leads in slightly other data."""

from collections.abc import Callable, Iterable, Sequence
from itertools import batched
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.density import (
    likelihood_errors_and_scales,
    log_prior,
    prior_precision,
    unconstrain,
)
from muscle_bayes.inference.model.muscle_prior import MINIMUM_FORCES
from muscle_bayes.inference.model.prior_draws import sample_prior
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.batches import of_rows
from muscle_bayes.inference.running.program import program
from muscle_bayes.inference.running.side_by_side import side_by_side
from muscle_bayes.inference.search.factored import FactoredPrecision
from muscle_bayes.inference.search.least_squares import Row, least_squares
from muscle_bayes.inference.search.other_basins import with_other_basins
from muscle_bayes.inference.search.tempering import (
    AS_EXPECTED,
    OR_SUDDEN,
    Lasting,
    Misfit,
    entry_names,
    horizons,
    is_noise,
    misfit_at,
    up_to,
)
from muscle_bayes.physics.effects import effect_type

SHRUNK = 0.03
"""Factor on D, and on what effects do, in every other draw: where friction holds the rotor, no
parameter shows any effect, and where an effect drowns the rest, a descent goes to its own mode."""


class Mode(NamedTuple):
    """A maximum of the posterior density."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    potential: float
    """Negative log density there."""
    information: Float[Array, "n n"]
    """Fisher information of the likelihood (Gauss-Newton) plus prior precision."""
    steps: int


class Seen(NamedTuple):
    """A point, as least squares looks at it."""

    potential: Float[Array, ""]
    gradient: Float[Array, " n"]
    information: Float[Array, "n n"]


@program
def _likelihood_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> Seen:
    """Its part of the potential, with derivatives by forward mode."""

    def both(vector: Array) -> tuple:
        found = likelihood_errors_and_scales(vector, layout, data)
        return found, found[0]

    (gradient, jacobian), log_likelihood = jax.jacfwd(both, has_aux=True)(vector)
    return Seen(-log_likelihood, -gradient, jacobian.T @ jacobian)


@program
def _prior_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> Seen:
    """Its part: a program of its own, for it needs neither runs nor simulation."""
    log_density, gradient = jax.value_and_grad(log_prior)(vector, layout, data)
    return Seen(-log_density, -gradient, prior_precision(vector, layout, data))


def seen_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> Seen:
    """Potential, its gradient, and Gauss-Newton information plus prior precision."""
    parts = (
        _likelihood_at(vector, layout, data),
        _prior_at(vector, layout, data._replace(lanes=())),
    )
    return jax.tree.map(jnp.add, *parts)


def _descended(
    starts: Sequence[Array],
    layout: Layout,
    data: Data,
    held: Sequence[int] = (),
    steps: int = 60,
    workers: int = 1,
    least_gain: float = 1e-3,
) -> list[Row[Seen]]:
    def looker(points: Sequence[np.ndarray], _: Sequence[int]) -> list[Seen]:
        return of_rows(seen_at, [(point, data) for point in points], layout, workers)

    return least_squares(
        looker, [np.asarray(start) for start in starts], held, steps, least_gain=least_gain
    )


def _as_mode(row: Row[Seen]) -> Mode:
    return Mode(jnp.asarray(row.point), row.potential, row.look.information, row.steps)


def descended(
    point: Float[np.ndarray, " n"], layout: Layout, data: Data, held: Sequence[int] = ()
) -> Mode:
    """The local maximum to which a point leads, the entries `held` as they are."""
    return _as_mode(_descended([jnp.asarray(point)], layout, data, held)[0])


def refine(mode: Mode, layout: Layout, data: Data) -> Mode:
    """The local maximum to which a mode of slightly different data leads."""
    return descended(np.asarray(mode.vector), layout, data)


@program
def _starts_of(
    values: dict[str, Array], shrinking: Float[Array, " draw"], layout: Layout, data: Data
) -> Float[Array, "draw n"]:
    """Unconstrained draws, each shrunk by its factor."""

    def one(values: dict[str, Array], factor: Array) -> Array:
        values = dict(values)
        if "D" in values:
            values["D"] = factor * values["D"]
        for effect in layout.effects:
            for field, parameter in effect_type(effect).parameters.items():
                name = f"{effect}.{field}"
                values[name] = parameter.weakened(values[name], factor)
        return unconstrain(values, layout, data)

    return jax.vmap(one)(values, shrinking)


def _likely_draws(
    key: Array, count: int, layout: Layout, data: Data, workers: int
) -> list[Float[Array, " n"]]:
    """Draws of the prior, those of the least misfit first, one in two shrunk."""
    factors = np.where(np.arange(count) % 2 == 0, 1.0, SHRUNK)
    draws = np.asarray(_starts_of(sample_prior(key, count, layout, data), factors, layout, data))
    levels = side_by_side(lambda draw: misfit_at(draw, layout, data)[1], draws, workers)
    values = np.array(list(levels))
    order = np.argsort(values)
    if not np.isfinite(values[order[0]]):
        raise MuscleBayesError(
            "the model cannot be simulated anywhere in the prior for these runs. Fix: check the "
            "geometry in their metadata (lengths in m, masses in kg, angles in rad)"
        )
    pairs = zip(order[order % 2 == 1], order[order % 2 == 0], strict=True)
    return [jnp.asarray(draws[index]) for pair in pairs for index in pair]


class _Shape(NamedTuple):
    """A start after its misfit was fitted as if it were white."""

    level: float
    """Negative log density with its misfit taken for lasting."""
    vector: Float[Array, " n"]
    """With that noise."""
    ratio: float
    """Largest ratio of a regime's RMS misfit to the noise expected of a reading."""


def _shaped(
    starts: Iterable[Array], layout: Layout, data: Data, workers: int, shares: Sequence[float]
) -> list[_Shape]:
    """Fit the whole shape of runs from every start, the noise set to the misfit before each round.

    Over growing horizons, then four rounds over the whole. In the first round minimum forces are held:
    while all else is wrong, their prior alone would pull a spring open that has to be shut. Descents end
    where a step gains less than a tenth of a nat, for the next round has another noise.
    """
    names = entry_names(layout)
    noise = np.flatnonzero(is_noise(names))
    forces = np.flatnonzero(np.isin(names, MINIMUM_FORCES))
    vectors = list(starts)

    def misfits(seen: Data, ways: Sequence[Lasting] = AS_EXPECTED) -> list[tuple[Misfit, float]]:
        return list(side_by_side(lambda v: misfit_at(v, layout, seen, ways), vectors, workers))

    for count, share in enumerate((*shares, 1.0, 1.0, 1.0)):
        seen = up_to(share, layout, data)
        tempered = [misfit.white for misfit, _ in misfits(seen)]
        held = np.concatenate([noise, forces]) if count == 0 else noise
        rows = _descended(tempered, layout, seen, list(held), 15, workers, least_gain=0.1)
        vectors = [jnp.asarray(row.point) for row in rows]
    return [
        _Shape(level, misfit.lasting, float(misfit.ratio))
        for misfit, level in misfits(data, OR_SUDDEN)
    ]


def find_mode(
    key: Array,
    layout: Layout,
    data: Data,
    report: Callable[[int, int], None] = lambda done, total: None,
    workers: int = 1,
    *,
    prior_draws: int = 256,
    most_starts: int = 40,
    wave: int = 4,
    agreeing: tuple[int, int] = (3, 20),
    agreement: float = 5.0,
    kicks: int = 6,
    kick: float = 2.0,
) -> Mode:
    """The best of several local maxima, started from the most probable of many prior draws.

    Each start is first fitted as if its misfit were white noise, which looks at the whole shape of a
    run, and only the best of these with the discrepancy's correlation, which looks at how it changes.
    From the best shape minimum forces are tried elsewhere, for descents do not find their way from a
    spring that is open to one that is shut. In the end the best maximum is left by random kicks, as long
    as one of them leads to a higher one.

    Args:
        key: random key of the prior draws.
        layout, data: of the problem.
        report: is told how many starts have been fitted, and how many may be.
        workers: rows that are evaluated side by side; the result does not depend on it.
        prior_draws: draws of the prior, of which the likeliest are starts.
        most_starts: starts at most.
        wave: starts that are fitted together.
        agreeing: starts that must come within `agreement` nats of the best to end the search; the second
            where the misfit of the best is 1.2 times the noise: then the model is wrong, or most
            starts lead to a mode that is.
        agreement: see `agreeing`.
        kicks: tried at a time.
        kick: their size, in posterior standard deviations as the Fisher information has them.

    Raises:
        MuscleBayesError: when no prior draw gives a finite density.
    """
    shares = horizons(layout)
    near = up_to(shares[0], layout, data)
    begun = _likely_draws(key, prior_draws, layout, near, workers)[:most_starts]
    shapes: list[_Shape] = []

    def best() -> _Shape:
        return min(shapes, key=lambda shape: shape.level)

    for starts in batched(begun, wave):
        shapes += _shaped(starts, layout, data, workers, shares)
        report(len(shapes), most_starts)
        wanted = agreeing[best().ratio > 1.2]
        if sum(shape.level < best().level + agreement for shape in shapes) >= wanted:
            break
    level = np.inf
    while best().level < level - agreement:
        level = best().level
        shapes += _shaped(
            with_other_basins(best().vector, layout, data), layout, data, workers, (1.0,)
        )
    shapes.sort(key=lambda shape: shape.level)
    rows: list[Row[Seen]] = []
    for two in batched((shape.vector for shape in shapes[:5]), 2):
        rows = sorted(
            rows + _descended(two, layout, data, workers=workers), key=lambda row: row.potential
        )
        if rows[-1].potential - rows[0].potential < 0.1:
            break
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key)))

    def kicked(mode: Mode) -> Mode:
        factor = FactoredPrecision(np.asarray(mode.information))
        moves = [kick * factor.spread(rng.standard_normal(mode.vector.size)) for _ in range(kicks)]
        found = _descended([mode.vector + move for move in moves], layout, data, workers=workers)
        return _as_mode(min(found, key=lambda row: row.potential))

    return hopped(_as_mode(rows[0]), kicked, agreement)


def hopped(mode: Mode, kicked: Callable[[Mode], Mode], least: float) -> Mode:
    """The highest of maxima to each of which kicks lead from the one before, by `least` nats or more.

    Thresholds make a density with many maxima side by side. Source: basin hopping at no temperature, Wales
    and Doye, Journal of Physical Chemistry A 101 (1997), 5111-5116.
    """
    while (further := kicked(mode)).potential < mode.potential - least:
        mode = further
    return mode
