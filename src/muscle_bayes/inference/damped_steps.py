"""Steps of Levenberg and Marquardt that stop at walls."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solve_triangular
from scipy.optimize import nnls
from scipy.special import log_ndtr

from muscle_bayes.inference.factored import FactoredPrecision

LONGEST_MOVE = 2.0
"""Longest step of any entry, in units of the unconstrained vector: many prior standard deviations at
once leave the region the model is good in."""
ROUNDING = 1e-9
"""Room that a point is given which would lie beyond a wall."""
TOUCHING = 1e-6
"""Room below which a point lies at a wall."""


class Walls(NamedTuple):
    """Where a point is possible: room + slopes @ move >= 0 for small moves."""

    room: Float[np.ndarray, " wall"]
    """Distance that is left."""
    slopes: Float[np.ndarray, "wall n"]
    """Its derivative."""

    def of(self, entries: np.ndarray) -> "Walls":
        """The same for moves of these entries alone."""
        return Walls(self.room, self.slopes[:, entries])


def damped_move(
    information: Float[np.ndarray, "n n"],
    gradient: Float[np.ndarray, " n"],
    damping: float,
    walls: Walls,
) -> Float[np.ndarray, " n"]:
    """Minimum of g'd + d'(I + damping diag I)d / 2 between walls, cut to LONGEST_MOVE in any entry.

    A step that merely ended at a wall would be damped to nothing there, at no minimum: this one goes
    along it.
    """
    damped = FactoredPrecision(information + damping * np.diag(np.diag(information)))
    move = -damped.solve(gradient)
    room = walls.room + walls.slopes @ move
    if np.any(room < 0.0):
        pushed = damped.solve(walls.slopes.T)
        move += pushed @ _pressure(walls.slopes @ pushed, room)
    return move * min(1.0, LONGEST_MOVE / max(np.abs(move).max(), 1e-300))


def between_walls(
    point: Float[np.ndarray, " n"],
    walls_at: Callable[[np.ndarray], Walls],
    entries: Int[np.ndarray, " wall"],
) -> tuple[Float[np.ndarray, " n"], Walls]:
    """A point and its walls; from beyond a wall it is moved onto it.

    `entries`: of each wall, the entry of the point by which its room rises one for one, no other's
    does.
    """
    walls = walls_at(point)
    if np.all(walls.room >= 0.0):
        return point, walls
    point = point.copy()
    point[entries] += np.maximum(ROUNDING - walls.room, 0.0) * (walls.room < 0.0)
    return point, walls_at(point)


def _pressure(give: Float[np.ndarray, "wall wall"], room: np.ndarray) -> np.ndarray:
    """Multipliers p >= 0 with room + give p >= 0, of which one is 0 at every wall (dual problem)."""
    lower = np.linalg.cholesky(give + 1e-12 * np.diag(np.diag(give)))
    return nnls(lower.T, -solve_triangular(lower, room, lower=True))[0]


def log_share(
    precision: FactoredPrecision, gradient: Float[np.ndarray, " n"], walls: Walls
) -> float:
    """Log of the share of a minimum's normal approximation that lies between walls.

    With the pressure p of a wall at distance r, and the variance v across it, the integral of
    exp(-p t - t^2 / 2v) over t > -r is exp(p^2 v / 2) Phi(r / s - p s) s sqrt(2 pi), s^2 = v. Walls
    count as independent of each other.
    """
    if not walls.room.size:
        return 0.0
    give = walls.slopes @ precision.solve(walls.slopes.T)
    touching = np.flatnonzero(walls.room < TOUCHING)
    pressure = np.zeros(walls.room.size)
    if touching.size:
        bound = Walls(walls.room[touching], walls.slopes[touching])
        pressure[touching] = _pressure(
            give[np.ix_(touching, touching)], -bound.slopes @ precision.solve(gradient)
        )
    spread = np.sqrt(np.diag(give))
    steep = pressure * spread
    return float(np.sum(0.5 * steep**2 + log_ndtr(walls.room / spread - steep)))
