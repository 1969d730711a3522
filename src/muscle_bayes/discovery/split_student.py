"""Split Student t: a proposal that is as wide as the posterior on either side of each of its axes."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.special import gammaln

HALF_NAT = 0.5
"""By which a normal density falls within one standard deviation."""


@dataclass(frozen=True)
class SplitStudent:
    """x = mode + axes u, u a Student t in every orthant, with widths of its own on either side.

    Source: Geweke, Econometrica 57 (1989), 1317-1339, section 4.
    """

    axes: Float[np.ndarray, "n n"]
    widths: Float[np.ndarray, "side n"]
    """Of u where it is positive, and where it is negative."""
    mean: Float[np.ndarray, " n"]
    root: Float[np.ndarray, "n n"]
    """u = mean + root v, with v split."""
    freedom: float

    def draw(
        self, rng: np.random.Generator, count: int
    ) -> tuple[Float[np.ndarray, "draw n"], Float[np.ndarray, " draw"]]:
        """Draws less the mode, and their log density."""
        above, below = self.widths
        size = above.size
        stretch = np.sqrt(self.freedom / rng.chisquare(self.freedom, count))
        kicks = stretch[:, None] * np.abs(rng.standard_normal((count, size)))
        # Either side as often as it is wide: so the density is continuous.
        positive = rng.uniform(size=(count, size)) < above / (above + below)
        split = np.where(positive, kicks * above, -kicks * below)
        half = 0.5 * (self.freedom + size)
        log_density = (
            gammaln(half)
            - gammaln(0.5 * self.freedom)
            - 0.5 * size * np.log(self.freedom * np.pi)
            - half * np.log1p(np.sum(kicks**2, axis=1) / self.freedom)
            + np.log(2.0 / (above + below)).sum()
            - np.linalg.slogdet(self.axes @ self.root)[1]
        )
        return (self.mean + split @ self.root.T) @ self.axes.T, log_density

    def moved(
        self, moves: Float[np.ndarray, "draw n"], share: Float[np.ndarray, " draw"]
    ) -> "SplitStudent":
        """Half way to the mean and covariance of weighted draws (population Monte Carlo)."""
        u = np.linalg.solve(self.axes, moves.T).T
        scale = 0.5 * self.widths.sum(axis=0)
        away = (u - share @ u) / scale
        now = self.root * scale / scale[:, None]
        mixed = 0.5 * now @ now.T + 0.5 * (share[:, None] * away).T @ away
        root = np.linalg.cholesky(mixed) * scale[:, None] / scale
        return replace(self, mean=0.5 * self.mean + 0.5 * share @ u, root=root)


def split_student(
    rise: Callable[[Float[np.ndarray, "row n"]], Float[np.ndarray, " row"]],
    covariance: Float[np.ndarray, "n n"],
    prior: Float[np.ndarray, " n"],
    *,
    freedom: float = 20.0,
    rounds: int = 5,
    widest: float = 4.0,
) -> SplitStudent:
    """The proposal about a mode.

    Axes are columns of the covariance's Cholesky factor, entries of which readings say least first: an
    entry of which they say nothing is an axis of its own. Along each, on either side, its width is where
    the density has fallen by half a nat, however it falls: behind a wall, or in a long tail.

    Args:
        rise: fall of the log density by moves from the mode; inf where it is 0.
        covariance: of the normal at the mode (Laplace).
        prior: diagonal of the prior's precision.
        freedom: degrees of freedom.
        rounds: evaluations of each side at most, one round after the other.
        widest: width at most, in standard deviations.
    """
    order = np.argsort(-np.diag(covariance) * prior)
    axes = np.zeros_like(covariance)
    axes[order] = np.linalg.cholesky(covariance[np.ix_(order, order)])
    ways = np.concatenate([axes.T, -axes.T])
    width, low, high = np.ones(len(ways)), np.zeros(len(ways)), np.full(len(ways), np.inf)
    wanted = np.arange(len(ways))
    for _ in range(rounds):
        found = np.maximum(rise(width[wanted, None] * ways[wanted]), 0.0)
        near = (found > 0.5 * HALF_NAT) & (found < 2.0 * HALF_NAT)
        short, far = wanted[found <= 0.5 * HALF_NAT], wanted[found >= 2.0 * HALF_NAT]
        width[wanted[near]] *= np.sqrt(HALF_NAT / found[near])
        low[short], high[far] = width[short], width[far]
        wanted = np.sort(np.concatenate([short[width[short] < widest], far]))
        between = np.sqrt(np.maximum(low, 0.1 * high)[wanted] * high[wanted])
        width[wanted] = np.where(np.isfinite(high[wanted]), between, 2.0 * width[wanted])
    size = len(covariance)
    return SplitStudent(axes, width.reshape(2, size), np.zeros(size), np.eye(size), freedom)
