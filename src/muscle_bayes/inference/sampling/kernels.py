"""The samplers' kernels: NumPyro's Gibbs of the slice-sampled block and of one for all smooth sites."""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpyro.infer import NUTS, Gibbs
from numpyro.infer.gibbs import GibbsState

from muscle_bayes.inference.model.calibration_model import CalibrationModel
from muscle_bayes.inference.sampling.crank_nicolson import CrankNicolson
from muscle_bayes.inference.sampling.gibbs_blocks import (
    SliceBlock,
    Slices,
    blocks_of,
    slice_update,
)

SCHEDULE = 1000
"""Warm-up that NUTS is told of. Its first 75 draws adapt the step size alone and without a restart;
ours is shorter and ends there."""


class Normal(NamedTuple):
    """The smooth sites, unconstrained, as the Fisher information at the mode has them."""

    names: tuple[str, ...]
    """Site of each entry."""
    centre: Float[np.ndarray, " n"]
    covariance: Float[np.ndarray, "n n"]


class SmoothBlock(Protocol):
    """How the smooth sites are sampled."""

    statistics: ClassVar[dict[str, str]]
    """What a draw leaves, by ArviZ's name, and its field of the block's state."""
    constrained: ClassVar[bool]
    """Whether the block's state holds values, rather than the unconstrained ones."""

    def kernel(self, model: CalibrationModel, sites: tuple[str, ...]) -> Any:
        """The block's kernel."""

    def begun(self, state: Any, sites: tuple[str, ...], normal: Normal) -> Any:
        """A block's first state with what the mode tells."""

    def warmed(self, state: Any, statistics: dict[str, np.ndarray]) -> Any:
        """The state of all chains after warm-up; statistics have chain and draw axes."""

    def unconstrained(
        self, values: dict[str, np.ndarray], statistics: dict[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        """Unconstrained draws of the block's sites from those that the state holds."""


@dataclass(frozen=True)
class Nuts:
    """NUTS. The inverse Fisher information is its inverse mass matrix.

    The step size is adapted, the matrix is not, for the noise's funnel would spoil it.
    """

    target_acceptance: float = 0.75
    max_tree_depth: int = 5

    statistics: ClassVar[dict[str, str]] = {
        "diverging": "diverging",
        "n_steps": "num_steps",
        "acceptance_rate": "accept_prob",
        "energy": "energy",
        "potential": "potential_energy",
        "step_size": "adapt_state.step_size",
    }
    constrained: ClassVar[bool] = False

    def kernel(self, model: CalibrationModel, sites: tuple[str, ...]) -> NUTS:
        return NUTS(
            model,
            dense_mass=[sites],
            adapt_mass_matrix=False,
            target_accept_prob=self.target_acceptance,
            max_tree_depth=self.max_tree_depth,
        )

    def begun(self, state: Any, sites: tuple[str, ...], normal: Normal) -> Any:
        root = np.linalg.cholesky(np.linalg.inv(normal.covariance))
        adapted = state.adapt_state._replace(
            inverse_mass_matrix={sites: jnp.asarray(normal.covariance)},
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

    def unconstrained(
        self, values: dict[str, np.ndarray], statistics: dict[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        return values


@dataclass(frozen=True)
class CrankNicolsonSteps:
    """Crank-Nicolson steps about the normal approximation at the mode."""

    steps: int = 8
    spread: float = 1.1
    """Standard deviation of proposals, in those of the approximation, whose tails may be too thin."""

    statistics: ClassVar[dict[str, str]] = {
        "acceptance_rate": "accept_prob",
        "potential": "potential_energy",
        "place": "place",
    }
    constrained: ClassVar[bool] = True

    def kernel(self, model: CalibrationModel, sites: tuple[str, ...]) -> CrankNicolson:
        return CrankNicolson(model, self.steps)

    def begun(self, state: Any, sites: tuple[str, ...], normal: Normal) -> Any:
        order = np.argsort(normal.names, kind="stable")
        root = self.spread * np.linalg.cholesky(normal.covariance[np.ix_(order, order)])
        return state._replace(centre=jnp.asarray(normal.centre[order]), root=jnp.asarray(root))

    def warmed(self, state: Any, statistics: dict[str, np.ndarray]) -> Any:
        """With the mean of what all chains drew in the later half of warm-up as the centre."""
        places = statistics["place"]
        later = places[:, places.shape[1] // 2 :]
        return state._replace(centre=jnp.asarray(later.mean((0, 1))))

    def unconstrained(
        self, values: dict[str, np.ndarray], statistics: dict[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        names = sorted(values)
        sizes = [int(np.prod(values[name].shape[2:])) for name in names]
        parts = np.split(statistics["place"], np.cumsum(sizes)[:-1], axis=2)
        return dict(zip(names, parts, strict=True))


def gibbs_kernel(
    model: CalibrationModel, smooth: SmoothBlock | None = None, slices: Slices | None = None
) -> Gibbs:
    """NumPyro's kernel for a model: slices of minimum forces and noise, then all smooth sites at once.

    Args:
        model: of the runs.
        smooth: how the smooth sites are sampled; `Nuts()` unless given.
        slices: how the slice-sampled block moves.
    """
    smooth, slices = smooth or Nuts(), slices or Slices()
    blocks = blocks_of([name for name, _ in model.problem.layout.shapes])
    sliced = SliceBlock(slice_update(model, slices))
    whole = smooth.kernel(model, blocks.smooth)
    return Gibbs([(sliced, blocks.minimum_forces + blocks.noise), (whole, blocks.smooth)])


def with_smooth(state: GibbsState, block: Any) -> GibbsState:
    """The state with another one of the smooth block."""
    return state._replace(block_states=(state.block_states[0], block))


def smooth_state(state: GibbsState) -> Any:
    """State of the smooth block."""
    return state.block_states[1]


def statistics_of(smooth: SmoothBlock) -> dict[str, str]:
    """Fields of the whole state, by ArviZ's name."""
    return {name: f"block_states.1.{field}" for name, field in smooth.statistics.items()}
