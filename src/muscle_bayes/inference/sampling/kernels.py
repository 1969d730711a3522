"""The samplers' kernels, NumPyro's Gibbs of a block for each kind of site."""

from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpyro.distributions import biject_to
from numpyro.infer import NUTS, Gibbs

from muscle_bayes.inference.model.calibration_model import CalibrationModel
from muscle_bayes.inference.model.damper_axes import from_axes, to_axes
from muscle_bayes.inference.model.muscle_prior import MINIMUM_FORCES
from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import Layout, Problem
from muscle_bayes.inference.sampling.gibbs_blocks import (
    Blocks,
    SliceBlock,
    Slices,
    blocks_of,
    noise_slices,
    noise_update,
    wall_update,
)
from muscle_bayes.inference.sampling.linearised import Linearised, linearised, surrogate_of
from muscle_bayes.inference.sampling.normal import Normal, entries_of
from muscle_bayes.inference.sampling.surrogate_transitions import SurrogateTransitions
from muscle_bayes.inference.search.tempering import entry_names

SCHEDULE = 1000
"""Warm-up that NUTS is told of. Its first 75 draws adapt the step size alone and without a restart;
ours is shorter and ends there."""


class Sampler(Protocol):
    """How the sites are sampled. The last block has the smooth ones, and leaves the statistics."""

    statistics: ClassVar[dict[str, str]]
    """What a draw leaves, by ArviZ's name, and its field of the last block's state."""
    constrained: ClassVar[bool]
    """Whether that block is begun with values, rather than with unconstrained ones."""
    recentred: ClassVar[bool]
    """Whether half of the warm-up tells of a point that serves better than the mode."""

    def kernel(self, model: CalibrationModel) -> Gibbs:
        """The kernel of all sites."""

    def blocks(self, layout: Layout) -> Blocks:
        """In which block each site is."""

    def prepared(self, normal: Normal, problem: Problem, workers: int) -> Any:
        """What all chains need of the normal approximation."""

    def begun(self, state: Any, prepared: Any) -> Any:
        """The last block's state with that."""

    def warmed(self, state: Any, statistics: dict[str, np.ndarray]) -> Any:
        """The state of all chains after warm-up; statistics have chain and draw axes."""

    def vectors(
        self, values: dict[str, np.ndarray], statistics: dict[str, np.ndarray], problem: Problem
    ) -> Float[np.ndarray, "chain draw n"]:
        """Unconstrained draws of all sites from those that the blocks hold."""


@dataclass(frozen=True)
class Nuts:
    """Slices of what acts like a wall, slices of the noise, NUTS over all other sites.

    The inverse Fisher information is NUTS' inverse mass matrix. Its step size is adapted, the matrix is
    not, for the noise's funnel would spoil it.
    """

    target_acceptance: float = 0.75
    max_tree_depth: int = 5
    walls: tuple[str, ...] = MINIMUM_FORCES
    """As those of `LinearisedSteps`."""
    slices: Slices = field(default_factory=Slices)

    statistics: ClassVar[dict[str, str]] = {
        "diverging": "diverging",
        "n_steps": "num_steps",
        "acceptance_rate": "accept_prob",
        "energy": "energy",
        "potential": "potential_energy",
        "step_size": "adapt_state.step_size",
    }
    constrained: ClassVar[bool] = False
    recentred: ClassVar[bool] = False

    def kernel(self, model: CalibrationModel) -> Gibbs:
        sites = self.blocks(model.problem.layout)
        whole = NUTS(
            model,
            dense_mass=[sites.smooth],
            adapt_mass_matrix=False,
            target_accept_prob=self.target_acceptance,
            max_tree_depth=self.max_tree_depth,
        )
        noise = SliceBlock(noise_update(model, self.slices)), sites.noise
        return Gibbs([*_walls(model, self.slices, sites), noise, (whole, sites.smooth)])

    def blocks(self, layout: Layout) -> Blocks:
        return blocks_of([name for name, _ in layout.shapes], self.walls)

    def prepared(self, normal: Normal, problem: Problem, workers: int) -> Normal:
        """Without the axes of `damper_axes`, which NumPyro's own sites know nothing of."""
        slopes = jax.jacfwd(from_axes)(jnp.asarray(normal.point), problem.layout, problem.data)
        own = np.asarray(slopes)[np.ix_(normal.entries, normal.entries)]
        return normal._replace(covariance=own @ normal.covariance @ own.T)

    def begun(self, state: Any, prepared: Normal) -> Any:
        sites = tuple(dict.fromkeys(prepared.names))
        root = np.linalg.cholesky(np.linalg.inv(prepared.covariance))
        adapted = state.adapt_state._replace(
            inverse_mass_matrix={sites: jnp.asarray(prepared.covariance)},
            mass_matrix_sqrt={sites: jnp.asarray(root)},
            mass_matrix_sqrt_inv={sites: jnp.asarray(np.linalg.inv(root))},
        )
        return state._replace(adapt_state=adapted)

    def warmed(self, state: Any, statistics: dict[str, np.ndarray]) -> Any:
        """With the median step size that all chains took in the later half of warm-up."""
        sizes = statistics["step_size"]
        size = np.exp(np.median(np.log(sizes[:, sizes.shape[1] // 2 :])))
        adapted = state.adapt_state
        adapted = adapted._replace(step_size=jnp.full_like(adapted.step_size, size))
        return state._replace(adapt_state=adapted, i=jnp.full_like(state.i, SCHEDULE))

    def vectors(
        self, values: dict[str, np.ndarray], statistics: dict[str, np.ndarray], problem: Problem
    ) -> Float[np.ndarray, "chain draw n"]:
        layout, data = problem.layout, problem.data
        smooth = self.blocks(layout).smooth  # NUTS holds its sites unconstrained

        def free(name: str) -> np.ndarray:
            found = jnp.asarray(values[name])
            return np.asarray(
                found if name in smooth else biject_to(data.priors[name].support).inv(found)
            )

        parts = [free(name) for name, _ in layout.shapes]
        whole = jnp.concatenate([part.reshape(*part.shape[:2], -1) for part in parts], axis=2)
        along = jax.vmap(jax.vmap(lambda vector: to_axes(vector, layout, data)))
        return np.asarray(along(whole))


@dataclass(frozen=True)
class LinearisedSteps:
    """Slices of what acts like a wall, and `SurrogateTransitions` over all other sites.

    The surrogate takes the model's predictions as linear about a typical point.
    """

    steps: int = 8
    moves: int = 4
    """Of the noise, in each step."""
    spread: float = 1.1
    """Standard deviation of proposals, in those of the surrogate, whose tails may be too thin."""
    noise_widths: tuple[float, float, float] = (0.5, 2.0, 2.0)
    """Largest scale of moves in log noise, log discrepancy and log correlation time."""
    walls: tuple[str, ...] = MINIMUM_FORCES
    """Sites, and effects with all of theirs, that are slice sampled: they act beyond a threshold only."""
    slices: Slices = field(default_factory=lambda: Slices(noise_rounds=2))

    statistics: ClassVar[dict[str, str]] = {
        "acceptance_rate": "accept_prob",
        "potential": "potential_energy",
        "place": "place",
    }
    constrained: ClassVar[bool] = True
    recentred: ClassVar[bool] = True

    def kernel(self, model: CalibrationModel) -> Gibbs:
        layout = model.problem.layout
        sites = self.blocks(layout)
        smooth = entries_of(sites.smooth, layout)
        whole = SurrogateTransitions(
            model,
            surrogate_of(layout, smooth, self.spread),
            smooth,
            self._noise_directions(layout),
            noise_slices(model, self.slices),
            steps=self.steps,
            moves=self.moves,
        )
        return Gibbs([*_walls(model, self.slices, sites), (whole, sites.smooth + sites.noise)])

    def blocks(self, layout: Layout) -> Blocks:
        return blocks_of([name for name, _ in layout.shapes], self.walls)

    def _noise_directions(self, layout: Layout) -> Float[np.ndarray, "k n"]:
        """Each quantity alone, and a long-lived discrepancy along which its steps stay as large."""
        rows = []
        for regime in dict.fromkeys(layout.regimes):
            names = [f"{regime}.{key}" for key in NoiseParameters._fields]
            entries = [int(entries_of([name], layout)[0]) for name in names]
            time = self.noise_widths[2]
            for widths in (*np.diag(self.noise_widths), (0.0, 0.5 * time, time)):
                row = np.zeros(len(entry_names(layout)))
                row[entries] = widths
                rows.append(row)
        return np.array(rows)

    def prepared(self, normal: Normal, problem: Problem, workers: int) -> Linearised:
        return linearised(normal.point, normal.entries, normal.covariance, problem, workers)

    def begun(self, state: Any, prepared: Linearised) -> Any:
        return state._replace(about=prepared)

    def warmed(self, state: Any, statistics: dict[str, np.ndarray]) -> Any:
        return state

    def vectors(
        self, values: dict[str, np.ndarray], statistics: dict[str, np.ndarray], problem: Problem
    ) -> Float[np.ndarray, "chain draw n"]:
        return statistics["place"]


def _walls(
    model: CalibrationModel, slices: Slices, sites: Blocks
) -> list[tuple[SliceBlock, tuple[str, ...]]]:
    """The block of the walls, where there are any."""
    return (
        [(SliceBlock(wall_update(model, slices, sites.walls)), sites.walls)] if sites.walls else []
    )
